"""`flightd doctor` against simulated vehicles, over real sockets, in real time."""

from __future__ import annotations

import asyncio
import json
import os
import pty
import re
import select
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from flightd.adapters.vehicle.mavlink.link.signing import make_key, read_key
from flightd.cli.main import main
from flightd.runtime.clock import LoopClock
from flightd.sim.autopilot.autopilot import AutopilotPeer, PeerConfig
from flightd.sim.autopilot.copter import ArduCopterPeer
from flightd.sim.autopilot.px4 import Px4Peer
from flightd.sim.plant.airframe import Airframe
from tests.rigs.event_loops import real

pytestmark = pytest.mark.slow  # the command has its own loop: real time

ROOT = Path(__file__).parents[2]
FACTORY = {"GUID_TIMEOUT": 3.0, "FS_GCS_TIMEOUT": 5.0, "FS_THR_ENABLE": 1.0, "BATT_FS_LOW_ACT": 0.0}
WRONG = {"GUID_TIMEOUT", "FS_GCS_TIMEOUT", "FS_THR_ENABLE", "BATT_FS_LOW_ACT"}
"""What an ArduCopter has that is half set up, and what of that should be better."""


@contextmanager
def serving(make_peer: Callable[..., AutopilotPeer], **options: Any) -> Iterator[tuple[AutopilotPeer, str]]:
    """An autopilot in a thread of its own, and its address."""
    started: threading.Event = threading.Event()
    found: list[Any] = []

    async def serve() -> None:
        peer = make_peer(LoopClock(), Airframe(), PeerConfig(ready_s=0.0, **options))
        host, port = await peer.open()
        stop = asyncio.Event()
        found.extend((peer, f"udpout://{host}:{port}", asyncio.get_running_loop(), stop))
        running = asyncio.ensure_future(peer.run())
        started.set()
        await stop.wait()
        running.cancel()
        await asyncio.wait([running])

    thread = threading.Thread(target=lambda: real(serve()))
    thread.start()
    try:
        assert started.wait(10.0)
        yield found[0], found[1]
    finally:
        found[2].call_soon_threadsafe(found[3].set)
        thread.join(10.0)


def write_config(folder: Path, vehicle: dict[str, Any], camera: dict[str, Any] | None = None) -> Path:
    """A configuration with pictures of a yellow line as its camera."""
    pictures = folder / "pictures"
    pictures.mkdir(exist_ok=True)
    floor = np.full((360, 640, 3), (128, 130, 126), np.uint8)
    cv2.line(floor, (0, 180), (639, 190), (20, 190, 235), 18)
    for number in range(12):
        assert cv2.imwrite(str(pictures / f"{number}.png"), floor)
    sections = {
        "mission": {"site": str(ROOT / "configs" / "site-demo.toml"), "lines_hold_s": 1.0},
        "camera": {
            "url": f"folder:{pictures}",
            "fps": 15.0,
            "fx_px": 381.4,
            "fy_px": 381.4,
            **(camera or {}),
        },
        "vision": {"workers": 1},
        "recorder": {"folder": str(folder / "flights"), "reserve_gb": 0.0},
        "vehicle": {"pose_output": "none", **vehicle},
    }
    path = folder / "flightd.toml"
    text = "".join(
        f"[{name}]\n" + "".join(f"{key} = {json.dumps(value)}\n" for key, value in section.items())
        for name, section in sections.items()
    )
    path.write_text(text)
    return path


class Doctor:
    """Runs the command in this process; gives exit code, stdout and stderr."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
        self._monkeypatch = monkeypatch
        self._capsys = capsys

    def __call__(self, config: Path, *options: str) -> tuple[int, str, str]:
        self._monkeypatch.setattr(sys, "argv", ["flightd", "doctor", "--config", str(config), *options])
        with pytest.raises(SystemExit) as ended:
            main()
        printed = self._capsys.readouterr()
        return int(ended.value.code or 0), printed.out, printed.err


@pytest.fixture
def doctor(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Doctor:
    return Doctor(monkeypatch, capsys)


def by_name(document: dict[str, Any], name: str) -> dict[str, Any]:
    return next(check for check in document["checks"] if check["name"] == name)


def test_wrong_parameters_are_named_then_set_and_the_vehicle_is_fit(tmp_path: Path, doctor: Doctor) -> None:
    with serving(ArduCopterPeer, parameters=FACTORY) as (peer, url):
        config = write_config(tmp_path, {"url": url})
        code, out, err = doctor(config, "--json")
        document = json.loads(out)
        assert code == 1
        assert err == "flightd: not fit to fly: 4 errors\n"
        assert document["fit"] is False
        assert {entry["name"] for entry in document["parameters"]} == WRONG
        timeout = next(entry for entry in document["parameters"] if entry["name"] == "GUID_TIMEOUT")
        assert (timeout["value"], timeout["expected"], timeout["better"]) == (3.0, "0.3 to 0.5 s", 0.3)
        assert "has died" in timeout["reason"]
        assert document["autopilot"]["version"] == "4.5.6"
        assert by_name(document, "camera")["level"] != "error"
        assert "1 lines seen" in by_name(document, "vision")["text"]
        assert by_name(document, "calibration")["level"] == "ok"
        assert by_name(document, "disk")["level"] != "error"
        assert peer.parameters["GUID_TIMEOUT"] == 3  # it only looked

        code, out, err = doctor(config, "--fix", "--yes", "--json")
        document = json.loads(out)
        assert (code, err) == (0, "")
        assert document["fit"] is True
        assert set(document["fixed"]) == WRONG
        assert document["parameters"] == []
        assert "reboot" in by_name(document, "fix")["remedy"]
        assert peer.parameters["GUID_TIMEOUT"] == pytest.approx(0.3)

        code, out, _ = doctor(config)
        assert code == 0
        assert out.splitlines()[-1] == "fit to fly"


def test_what_does_not_stay_as_set_is_still_wrong(tmp_path: Path, doctor: Doctor) -> None:
    with serving(ArduCopterPeer, parameters=FACTORY) as (peer, url):
        peer.parameters.locked.add("GUID_TIMEOUT")
        code, out, _ = doctor(write_config(tmp_path, {"url": url}), "--fix", "--yes", "--json")
        document = json.loads(out)
        assert code == 1
        assert [entry["name"] for entry in document["parameters"]] == ["GUID_TIMEOUT"]
        assert set(document["fixed"]) == WRONG - {"GUID_TIMEOUT"}
        assert any("GUID_TIMEOUT did not stay" in check["text"] for check in document["checks"])


def test_an_armed_vehicle_is_not_fit_and_not_written_to(tmp_path: Path, doctor: Doctor) -> None:
    with serving(ArduCopterPeer, parameters=FACTORY) as (peer, url):
        assert peer.pilot_arm()
        code, out, _ = doctor(write_config(tmp_path, {"url": url}), "--fix", "--yes", "--json")
        document = json.loads(out)
        assert code == 1
        assert "it is armed" in by_name(document, "vehicle")["text"]
        assert document["fixed"] == []
        assert peer.parameters["GUID_TIMEOUT"] == 3


def test_the_job_decides_what_is_right(tmp_path: Path, doctor: Doctor) -> None:
    job = {"raw_thrust": True, "pose_output": "odometry", "landing_target": True}
    with serving(ArduCopterPeer, parameters=FACTORY) as (_, url):
        code, out, _ = doctor(write_config(tmp_path, {"url": url, **job}), "--json")
        found = {entry["name"]: entry["better"] for entry in json.loads(out)["parameters"]}
        assert code == 1
        assert set(found) - WRONG == {
            "GUID_OPTIONS",
            "VISO_TYPE",
            "VISO_DELAY_MS",
            "EK3_SRC1_POSXY",
            "EK3_SRC1_VELXY",
            "PLND_ENABLED",
        }
        assert found["GUID_OPTIONS"] == 8


def test_an_estimator_that_could_take_our_motion_is_fit_to_fly_and_set_by_a_fix(
    tmp_path: Path, doctor: Doctor
) -> None:
    with serving(ArduCopterPeer) as (peer, url):
        config = write_config(tmp_path, {"url": url, "pose_output": "auto"})
        code, out, _ = doctor(config, "--json")
        document = json.loads(out)
        assert (code, by_name(document, "pose")["level"]) == (0, "warning")
        advised = {entry["name"] for entry in document["parameters"] if entry["advised"]}
        assert "EK3_SRC1_VELXY" in advised
        assert len(advised) == len(document["parameters"])
        code, out, _ = doctor(config, "--fix", "--yes", "--json")
        document = json.loads(out)
        assert (code, set(document["fixed"])) == (0, advised)
        assert by_name(document, "pose")["level"] == "ok"
        assert peer.parameters["EK3_SRC1_VELXY"] == 6


@pytest.mark.parametrize(("choice", "code", "level"), [("auto", 0, "ok"), ("odometry", 1, "warning")])
def test_a_px4_that_takes_no_motion_of_ours_is_fit_and_left_so_unless_it_is_demanded(
    tmp_path: Path, doctor: Doctor, choice: str, code: int, level: str
) -> None:
    with serving(Px4Peer, parameters={"EKF2_EV_CTRL": 0}) as (peer, url):
        config = write_config(tmp_path, {"url": url, "kind": "px4", "pose_output": choice})
        found, out, _ = doctor(config, "--json")
        document = json.loads(out)
        check = by_name(document, "pose")
        assert (found, check["level"]) == (code, level)
        assert check["text"] == "the autopilot's estimator does not take our motion"
        assert [entry["name"] for entry in document["parameters"]] == ["EKF2_EV_CTRL"][:code]
        doctor(config, "--fix", "--yes", "--json")
        assert peer.parameters["EKF2_EV_CTRL"] == 4 * code


def test_px4_behind_either_adapter_and_the_wrong_kind(tmp_path: Path, doctor: Doctor) -> None:
    with serving(Px4Peer, parameters={"COM_OBL_RC_ACT": 0}) as (_, url):
        for kind in ("px4", "mavsdk"):
            code, out, _ = doctor(write_config(tmp_path, {"url": url, "kind": kind}), "--json")
            document = json.loads(out)
            assert code == 1
            assert [entry["name"] for entry in document["parameters"]] == ["COM_OBL_RC_ACT"]
        code, out, _ = doctor(write_config(tmp_path, {"url": url, "kind": "ardupilot"}), "--json")
        check = by_name(json.loads(out), "vehicle")
        assert (code, check["level"], check["remedy"]) == (1, "error", 'set vehicle.kind = "px4"')


def test_a_signed_autopilot_answers_only_the_key(tmp_path: Path, doctor: Doctor) -> None:
    key = tmp_path / "mavlink.key"
    make_key(key)
    with serving(ArduCopterPeer, parameters=FACTORY, signing_key=read_key(key)) as (_, url):
        _, out, _ = doctor(write_config(tmp_path, {"url": url, "signing_key": "mavlink.key"}), "--json")
        assert {entry["name"] for entry in json.loads(out)["parameters"]} == WRONG
        other = tmp_path / "other.key"
        make_key(other)
        code, out, _ = doctor(write_config(tmp_path, {"url": url, "signing_key": "other.key"}), "--json")
        check = by_name(json.loads(out), "vehicle")
        assert code == 1
        assert check["level"] == "error"
        assert "signing key" in check["remedy"]


def test_no_autopilot_and_no_camera_are_lines_not_ends(tmp_path: Path, doctor: Doctor) -> None:
    camera = {"url": "device:/dev/no-such-camera"}
    code, out, err = doctor(write_config(tmp_path, {"url": "udpout://127.0.0.1:9"}, camera), "--json")
    document = json.loads(out)
    assert code == 1
    assert document["autopilot"] is None
    assert "no ArduPilot or PX4 heard" in by_name(document, "vehicle")["text"]
    assert by_name(document, "camera")["level"] == "error"
    assert "cannot be opened" in by_name(document, "camera")["text"]
    assert err == "flightd: not fit to fly: 2 errors\n"


def test_a_ground_port_that_is_taken_is_told(tmp_path: Path, doctor: Doctor) -> None:
    config = write_config(tmp_path, {"url": "udpout://127.0.0.1:9"})
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        ports = f"status_port = {taken.getsockname()[1]}\ncommand_port = 0\n"
        config.write_text(config.read_text() + f'[ground]\nlisten = "127.0.0.1"\n{ports}')
        code, out, _ = doctor(config, "--json")
    check = by_name(json.loads(out), "ground")
    assert (code, check["level"]) == (1, "error")
    config.write_text(config.read_text().replace(ports, "status_port = 0\ncommand_port = 0\n"))
    _, out, _ = doctor(config, "--json")
    assert by_name(json.loads(out), "ground")["level"] == "ok"


def test_bad_input_is_one_line_and_exit_2(tmp_path: Path, doctor: Doctor) -> None:
    good = write_config(tmp_path, {"url": "udpout://127.0.0.1:9"})
    code, out, err = doctor(good, "--fix", "--json")
    assert (code, out) == (2, "")
    assert "there is no terminal to ask on; add --yes" in err
    bad = tmp_path / "bad.toml"
    bad.write_text(good.read_text().replace("[vehicle]", "[vehicle]\nsystem_ids = 3"))
    code, out, err = doctor(bad, "--json")
    assert (code, out) == (2, "")
    assert err.startswith(f"flightd: config {bad}: vehicle.system_ids: unknown key")
    assert len(err.splitlines()) == 1
    code, _, err = doctor(write_config(tmp_path, {"url": "ftp://x"}), "--json")
    assert (code, len(err.splitlines())) == (2, 1)


@pytest.mark.parametrize(("answer", "kept"), [("n", 3.0), ("y", 0.3)])
def test_on_a_terminal_it_asks_first(tmp_path: Path, answer: str, kept: float) -> None:
    with serving(ArduCopterPeer, parameters=FACTORY) as (peer, url):
        config = write_config(tmp_path, {"url": url})
        command = [sys.executable, "-m", "flightd", "doctor", "--config", str(config), "--fix"]
        ours, theirs = pty.openpty()
        with subprocess.Popen(
            command, stdin=theirs, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, cwd=ROOT
        ) as program:
            os.close(theirs)
            try:
                assert program.stderr is not None
                said = read_until(program.stderr.fileno(), b"[y/N] ")
                assert b"GUID_TIMEOUT     3 -> 0.3" in said
                assert b"Write these 4 parameters to the autopilot?" in said
                os.write(ours, f"{answer}\n".encode())
                rest = program.stderr.read()
                code = program.wait(60.0)
            finally:
                program.kill()  # where a line above failed it would wait for an answer for ever
                os.close(ours)
        assert peer.parameters["GUID_TIMEOUT"] == pytest.approx(kept)
        assert code == (1 if answer == "n" else 0), rest
        assert (b"nothing was written" in rest) is (answer == "n")


def read_until(handle: int, end: bytes) -> bytes:
    """What comes up to `end`; fails after a minute of silence."""
    said = b""
    while end not in said:
        assert select.select([handle], [], [], 60.0)[0], said
        part = os.read(handle, 4096)
        assert part, said
        said += part
    return said


def test_an_ardrone_with_its_camera(tmp_path: Path, doctor: Doctor) -> None:
    command = [sys.executable, "-m", "flightd.sim.ardrone", "--ports", "0", "0", "0", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT) as program:
        try:
            assert program.stdout is not None
            ports = "&".join(re.findall(r"(?:at|navdata|video|control)=\d+", program.stdout.readline()))
            vehicle = {"kind": "ardrone", "url": f"ardrone://127.0.0.1?{ports}"}
            camera = {"url": "ardrone:", "fx_px": 686.0, "fy_px": 686.0}
            code, out, err = doctor(write_config(tmp_path, vehicle, camera), "--json")
        finally:
            program.terminate()
    assert code in {0, 1}, err  # a busy machine may render too few pictures a second
    document = json.loads(out)
    assert by_name(document, "vehicle")["level"] == "ok", document
    assert by_name(document, "battery")["level"] == "ok"
    assert document["autopilot"] is None
    assert "lands by itself 2 s after this computer falls silent" in by_name(document, "settings")["text"]
    assert "pictures a second" in by_name(document, "camera")["text"]


def test_an_ardrone_that_is_not_there(tmp_path: Path, doctor: Doctor) -> None:
    vehicle = {"kind": "ardrone", "url": "ardrone://127.0.0.1?at=9&navdata=9&video=9&control=9"}
    code, out, _ = doctor(write_config(tmp_path, vehicle), "--json")
    assert code == 1
    assert "no navdata" in by_name(json.loads(out), "vehicle")["text"]
    code, _, err = doctor(tmp_path / "flightd.toml", "--fix", "--yes")
    assert code == 2
    assert "AR.Drone" in err
