"""`flightctl` as a person runs it, against a link on loopback sockets."""

from __future__ import annotations

import asyncio
import json
import socket
import sys
from contextlib import closing
from pathlib import Path

import pytest

from flightd.adapters.ground_link.link import ZmqGround
from flightd.core.preview import CameraName, Preview
from flightd.core.types import CommandKind, Phase
from tests.rigs.event_loops import in_real_time, real
from tests.rigs.ground_link import Keyring, address_of, local, serving, tell_once
from tests.rigs.waiting import until

ROOT = Path(__file__).parents[3]


async def flightctl(*arguments: str) -> tuple[int, str, str]:
    """Exit code, stdout, stderr."""
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        "-m",
        "flightd.cli.ctl",
        *arguments,
        cwd=ROOT,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
    )
    out, err = await process.communicate()
    assert process.returncode is not None
    return process.returncode, out.decode(), err.decode()


def at(link: ZmqGround) -> tuple[str, ...]:
    address = address_of(link)
    ports = "--status-port", str(address.status_port), "--command-port", str(address.command_port)
    return (*ports, "--timeout", "20")


@in_real_time
async def test_status_and_commands() -> None:
    async with serving(local()) as link:
        code, out, err = await flightctl(*at(link), "status")
        assert (code, out) == (2, "")
        assert "has not published a status yet" in err
        tell_once(link)
        code, out, _ = await flightctl(*at(link), "status")
        assert code == 0
        assert out.startswith("follow: arrived")
        assert "GUIDED_NOGPS, armed, battery 80%" in out
        assert "delay -10 ms (sigma 2)" in out
        assert "focal length +2.0 % (sigma 1.0), height +5.1 % (sigma 1.2)" in out
        code, out, _ = await flightctl(*at(link), "status", "--json")
        assert (code, json.loads(out)["node"]) == (0, "A2")
        code, out, _ = await flightctl(*at(link), "goto", "A5")
        assert (code, out) == (0, "goto A5: accepted\n")
        code, out, _ = await flightctl(*at(link), "stop", "--json")
        assert (code, json.loads(out)["answer"]) == (0, "accepted")
        sent = [(command.kind, command.node) for command in link.take_commands()]
        assert sent == [(CommandKind.GOTO, "A5"), (CommandKind.STOP, "")]


@pytest.mark.parametrize(
    ("command", "code", "said"),
    [
        (["goto", "Q7"], 2, "no node 'Q7'"),
        (["start"], 1, "cannot start in phase follow"),
        (["inventory"], 2, "keeps no inventory store"),
        (["goto"], 2, "Missing argument"),
        (["--key", "no-such.key_secret", "status"], 2, "belong together"),
    ],
)
def test_what_cannot_be_done_is_one_line_and_an_exit_code(command: list[str], code: int, said: str) -> None:
    async def run() -> None:
        async with serving(local()) as link:
            tell_once(link)
            got, out, err = await flightctl(*at(link), *command)
            assert (got, out) == (code, "")
            assert said in err
            assert "Traceback" not in err
            assert link.take_commands() == []

    real(run())


@in_real_time
async def test_keys_from_keygen_open_a_daemon_beyond_loopback(tmp_path: Path) -> None:
    """The whole way that the guide describes, with nothing but the commands."""
    code, out, _ = await flightctl("keygen", "ann", "--out", str(tmp_path / "mine"), "--json")
    assert code == 0
    line = json.loads(out)["client"]
    ring = Keyring.make(tmp_path)
    with (tmp_path / "clients").open("a") as file:
        file.write(line + "\n")
    keys = ("--key", str(tmp_path / "mine" / "ann.key_secret"), "--server-key", str(tmp_path / "daemon.key"))
    async with serving(ring.config()) as link:
        tell_once(link, Phase.HOVER)
        code, out, err = await flightctl(*at(link), *keys, "pause")
        assert (code, out) == (0, "pause: accepted\n"), err
        stranger = ("--key", str(tmp_path / "stranger.key_secret"), *keys[2:])
        code, _, err = await flightctl(*at(link), *stranger, "land")
        assert (code, err.count("\n")) == (2, 1)
        assert "not on the daemon's list" in err
    assert '"client":"ann"' in (tmp_path / "audit.jsonl").read_text()


@in_real_time
async def test_a_picture_is_written_to_a_file(tmp_path: Path) -> None:
    async with serving(local()) as link, asyncio.TaskGroup() as tasks:
        asked = tasks.create_task(flightctl(*at(link), "picture", str(tmp_path / "now.jpg")))
        await until(lambda: link.picture_due(10**10))
        link.picture(Preview(CameraName.DOWN, 1, 10**10, b"\xff\xd8 a picture"))
        assert (await asked)[0] == 0
        assert (tmp_path / "now.jpg").read_bytes() == b"\xff\xd8 a picture"


@in_real_time
async def test_nobody_listening_is_one_line() -> None:
    with closing(socket.socket()) as held:  # nobody else gets its port meanwhile
        held.bind(("127.0.0.1", 0))
        port = str(held.getsockname()[1])
        where = "--status-port", port, "--command-port", port
        code, out, err = await flightctl(*where, "--timeout", "0.5", "home", "--json")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "nobody listens" in err


@in_real_time
async def test_the_protocol_is_printed_for_writers_of_clients() -> None:
    code, out, _ = await flightctl("protocol")
    assert code == 0
    assert "**StatusReport**" in out
    code, out, _ = await flightctl("protocol", "--json")
    assert "StatusReport" in json.loads(out)["$defs"]
