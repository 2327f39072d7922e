"""`flightd ground`: its words, what it refuses in one line, and its end."""

from __future__ import annotations

import gzip
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import pytest
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from flightd.config.schema import load_config
from flightd.core.errors import InputError
from flightd.core.types import Phase
from flightd.ground.drone_names import drone_addresses
from flightd.ground.guards import own_hosts
from flightd.ground.pages import STATIC
from flightd.ground.server import Listening
from flightd.site.site_file import load_site
from tests.command import Command
from tests.web.live_flight import LiveFlight

ROOT = Path(__file__).parents[2]
MOST_BYTES = 322_000
"""Of all pages together, compressed.  Each is fetched when it is first shown, and so is German for who reads
it: see `MOST_OF_PAGE`."""
MOST_OF_PAGE = 200_000
"""Of all that one page needs in German, compressed: it is on the screen within a second on any link that can
carry its pictures."""
IMPORTED = re.compile(r'(?:\bfrom|\bimport)\s*\(?"(\.[^"]+)"')
PAGE = re.compile(r'styles: \[(?P<styles>[^]]*)\],\s*load: \(\) => import\("(?P<module>[^"]+)"\)')


@pytest.fixture(autouse=True)
def _own_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """People and audit of these stations are nobody else's."""
    monkeypatch.setenv("FLIGHTD_GROUND_STATE", str(tmp_path / "state"))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--listen", "0.0.0.0"], "--listen 0.0.0.0: reaches beyond this machine, and the station"),
        (["--login"], "--login: nobody could sign in; flightd ground people add NAME --role admin"),
        (["--tls-cert", "none.pem"], "--tls-cert, --tls-key: belong together"),
        (["--drone", "north"], "--drone north: expected NAME=HOST"),
        (["--drone", "north=south=10.0.0.7"], "--drone north=south=10.0.0.7: expected NAME=HOST"),
        (["--drone", "a=h", "--drone", "a=k"], "--drone: the same name twice"),
        (["--key", "none.key_secret"], "--key, --server-key: belong together"),
        (["--drone", "a=127.0.0.1:5571"], "--drone a=127.0.0.1:5571: a drone has two ports, one"),
        (["--listen", "8080"], "--listen 8080: is a port alone; give 127.0.0.1:8080"),
        (["--folder", "/etc/passwd"], "--folder /etc/passwd: is a file, no folder"),
        (["--listen", "0.0.0.0", "--foxglove", "127.0.0.1:0"], "--foxglove: everybody shall sign in, and"),
        (["--fleet", "--mqtt", "mqtt://h", "--mqtt-orders"], "--fleet: the fleet's manager flies the drones"),
        (["--fleet-charged", "80"], "--fleet-charged 80: there is no fleet whose drones could wait"),
        (["--evidence", "pictures"], "--evidence: there is no store whose pictures could lie there"),
        (["--mqtt-version", "9"], "--mqtt-version: there is no version '9'; give 2.1 or 3.0"),
        (["--mqtt-body", "round"], "--mqtt-body: 'round' is no size of a drone"),
        (["--foxglove", "0.0.0.0"], "--foxglove 0.0.0.0: reaches beyond this machine, and Foxglove"),
    ],
)  # fmt: skip
def test_wrong_input_is_one_clear_line(flightd: Command, words: list[str], said: str) -> None:
    code, out, error = flightd("ground", *words)
    assert (code, out) == (2, "")
    assert error.startswith(f"flightd: {said}")
    assert error.count("\n") == 1


def test_without_foxgloves_package_one_line_says_how_to_get_it(tmp_path: Path) -> None:
    (tmp_path / "foxglove.py").write_text("raise ModuleNotFoundError(\"No module named 'foxglove'\")\n")
    done = subprocess.run(
        [sys.executable, "-m", "flightd", "ground", "--foxglove", "127.0.0.1:0"],
        cwd=ROOT, capture_output=True, text=True, timeout=60, check=False,
        env=os.environ | {"PYTHONPATH": f"{tmp_path}{os.pathsep}{ROOT}"},
    )  # fmt: skip
    assert done.returncode != 0
    assert done.stderr.startswith(
        "flightd: flightd ground --foxglove needs what is not installed (extra foxglove)"
    )
    assert "-m pip install" in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_state_folder_that_cannot_be_written_is_named(flightd: Command, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    code, out, error = flightd("ground", "--state", tmp_path / "file" / "state", "--listen", "127.0.0.1:0")
    assert (code, out, error.count("\n")) == (2, "", 1)
    assert "audit.jsonl: cannot be written: Not a directory; be the user" in error


@contextmanager
def started(*words: str) -> Iterator[tuple[subprocess.Popen[str], IO[str]]]:
    """A station at a port of its own, and what it says."""
    process = subprocess.Popen(
        [sys.executable, "-m", "flightd", "ground", "--listen", "127.0.0.1:0", *words],
        cwd=ROOT, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stderr is not None
    with process.stderr:
        yield process, process.stderr


def test_it_serves_until_ctrl_c_and_ends_in_order() -> None:
    with started() as (process, stderr):
        assert "the ground station is at http://127.0.0.1:" in stderr.readline()
        process.send_signal(signal.SIGINT)
        assert process.wait(20) == 0
        assert stderr.read() == (
            "flightd: SIGINT: it ends in order; a second one ends it at once\n"
            "flightd: the ground station was ended by SIGINT\n"
        )


def test_a_second_ctrl_c_ends_it_at_once_while_it_waits_for_a_page() -> None:
    with started() as (process, stderr):
        where = re.search(r"127\.0\.0\.1:(\d+)", stderr.readline())
        assert where is not None
        with socket.create_connection(("127.0.0.1", int(where[1])), timeout=10.0) as page:
            page.sendall(b"POST /api/site/check HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 9\r\n\r\n")
            process.send_signal(signal.SIGINT)
            assert "it ends in order" in stderr.readline()
            process.send_signal(signal.SIGINT)
            assert process.wait(20) == 128 + signal.SIGINT
            assert stderr.read() == "flightd: ended at once by SIGINT\n"


def test_a_second_station_on_its_state_refuses_to_start_until_the_first_has_died(
    flightd: Command, tmp_path: Path
) -> None:
    words = ("--listen", "127.0.0.1:0")
    with started() as (process, stderr):
        assert "the ground station is at" in stderr.readline()
        code, out, error = flightd("ground", *words)
        assert (code, out, error.count("\n")) == (2, "", 1)
        assert f"--state {tmp_path / 'state'}: another station uses it (process {process.pid})" in error
        process.kill()
        process.wait(20)
    with started() as (again, stderr):
        assert "the ground station is at" in stderr.readline()
        again.kill()
        again.wait(20)


def test_killed_in_flight_it_is_a_lost_ground_and_nothing_else() -> None:
    config = load_config(ROOT / "configs" / "sim.toml").with_values(
        mission={"autostart": False, "start_countdown_s": 0.0}, ground={"lost_action": "land", "lost_s": 2.0}
    )
    with LiveFlight(load_site(ROOT / "configs" / "site-demo.toml"), config) as flight:
        with started("--drone", "demo=127.0.0.1:{}/{}".format(*flight.ports)) as (process, stderr):
            url = stderr.readline().split()[6]
            try:
                socket_url = url.replace("http", "ws") + "/live"
                with connect(
                    socket_url, origin=Origin(url), proxy=None, max_queue=None, close_timeout=0.3
                ) as page:
                    start_from(page)
                    passed_through(flight, Phase.FOLLOW)
                    process.kill()
            finally:
                process.kill()
                process.wait(20)
        assert passed_through(flight, Phase.ABORTED) <= {Phase.FOLLOW, Phase.HOVER, Phase.LAND, Phase.ABORTED}
        assert flight.quiet_s > 2.0


def start_from(page: ClientConnection) -> None:
    """Its person orders the start, again until the drone takes it."""
    while True:
        act = {"id": uuid.uuid4().hex, "command": "start"}
        page.send(json.dumps({"say": "act", "number": 1, "drone": "demo", "act": act}))
        while (said := json.loads(page.recv(20)))["topic"] != "answer":
            pass
        if said["value"]["status"] == 200:
            return


def passed_through(flight: LiveFlight, last: Phase) -> set[Phase]:
    """The phases from now until this one."""
    phases, end_s = {flight.phase}, time.monotonic() + 60.0
    while flight.phase is not last:
        assert time.monotonic() < end_s, flight.phase
        flight.wait_s(0.02)
        phases.add(flight.phase)
    return phases


@pytest.mark.parametrize(
    ("text", "host", "port"),
    [
        ("127.0.0.1", "127.0.0.1", 8080), ("localhost:9000", "127.0.0.1", 9000),
        ("127.0.0.7:0", "127.0.0.7", 0), ("::1", "::1", 8080), ("[::1]:81", "::1", 81),
    ],
)  # fmt: skip
def test_it_listens_on_this_machine(text: str, host: str, port: int) -> None:
    assert Listening.read(text) == Listening(host, port)


@pytest.mark.parametrize(
    "text",
    [
        "", ":80", "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:65536",
    ],
)  # fmt: skip
def test_what_is_no_address_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="--listen"):
        Listening.read(text)


def test_drones_are_named_with_host_and_ports() -> None:
    named = dict(drone_addresses(["a=drone-1", "b=127.0.0.1:6571/6572", "c=[fe80::1]", "d=::1"]))
    assert (named["a"].host, named["a"].status_port, named["a"].command_port) == ("drone-1", 5571, 5572)
    assert (named["b"].host, named["b"].status_port, named["b"].command_port) == ("127.0.0.1", 6571, 6572)
    assert (named["c"].host, named["d"].host) == ("fe80::1", "::1")
    assert dict(drone_addresses([]))["drone"].host == "127.0.0.1"


@pytest.mark.parametrize(
    "text", ["a", "=h", "a=", "a b=h", "a=h:0/1", "a=h:1/99999", "a=h/x", "a=u@h", "a=h:", "a=[::1]:5"]
)
def test_a_drone_that_is_not_named_so_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="--drone"):
        drone_addresses([text])


def test_a_server_key_of_no_drone_is_refused() -> None:
    with pytest.raises(InputError, match="there is no --drone b"):
        drone_addresses(["a=h"], Path("ann.key_secret"), ["b=drone-1.key"])


def test_only_names_of_this_machine_may_stand_in_a_request() -> None:
    for host in ("127.0.0.7:80", "127.0.0.7", "localhost", "LOCALHOST:80", "[::1]:80"):
        assert own_hosts("127.0.0.7", 80).take(host), host
    for host in ("127.0.0.1:8080", "localhost:8080", "[::1]:8080"):
        assert own_hosts("::1", 8080).take(host), host
    for host in (
        "",
        "localhost",
        "127.0.0.2:8080",
        "evil.example:8080",
        "localhost:80",
        "[::2]:8080",
        "a b:8080",
    ):
        assert not own_hosts("::1", 8080).take(host), host


def test_beyond_this_machine_addresses_and_the_certificates_names_may_stand_in_a_request() -> None:
    hosts = own_hosts("0.0.0.0", 443, True, ("*.depot.example", "station.example"), beyond=True)
    for host in ("10.0.0.7", "10.0.0.7:443", "[fe80::1]", "station.example", "north.depot.example:443"):
        assert hosts.take(host), host
    for host in ("evil.example", "depot.example", "a.b.depot.example", "10.0.0.7:80", "10.0.0"):
        assert not hosts.take(host), host


def test_the_page_is_small_whole_and_names_no_foreign_host() -> None:
    files = [path for path in STATIC.rglob("*") if path.is_file()]
    shipped = [path for path in files if not path.name.endswith(".LICENSE.txt")]
    packed = {path: len(gzip.compress(path.read_bytes())) for path in shipped}
    assert sum(packed.values()) < MOST_BYTES
    app = STATIC / "app"
    frame = {
        *_needed(app / "main.js"),
        STATIC / "index.html",
        STATIC / "style" / "base.css",
        STATIC / "style" / "frame.css",
    }
    for page in PAGE.finditer((app / "pages.js").read_text()):
        styles = {(STATIC / "style" / name).resolve() for name in re.findall('"([^"]+)"', page["styles"])}
        needed = frame | styles | _needed((app / page["module"]).resolve())
        assert sum(packed[path] for path in needed) < MOST_OF_PAGE, page["module"]
    own = [path for path in shipped if "vendor" not in path.parts]
    for path in own:
        text = path.read_text().replace("http://www.w3.org/2000/svg", "")
        assert "http://" not in text, path
        assert "https://" not in text, path
    assert {path.name for path in files if "vendor" in path.parts} >= {
        "htm.LICENSE.txt",
        "preact.LICENSE.txt",
        "uplot.LICENSE.txt",
    }


def _needed(module: Path) -> set[Path]:
    """A module of the pages with all that it imports, the other pages left out."""
    found, todo = set[Path](), [module]
    while todo:
        found.add(path := todo.pop())
        asked = [] if path.name == "pages.js" else IMPORTED.findall(path.read_text())
        todo += {(path.parent / one).resolve() for one in asked} - found
    return found
