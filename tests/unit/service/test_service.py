"""What surrounds the daemon: the mark of a restart, the unit file, the install script."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import socket
import subprocess
import sys
from contextlib import ExitStack
from datetime import UTC, datetime
from pathlib import Path

import pytest

from flightd.adapters.recorder.archive import FlightArchive
from flightd.app.armed_mark import ArmedMark
from flightd.app.counting.flight_count import FlightCount
from flightd.app.service import note_start, was_started_before
from flightd.config.schema import load_config
from flightd.ground.ground_store.open_store import opened_store
from tests.command import Command
from tests.web.stock_rig import RACKS, counted_store, flown_log

SYSTEMD = Path(__file__).parents[3] / "systemd"
UNIT = SYSTEMD / "flightd.service"
GROUND_UNIT = SYSTEMD / "flightd-ground.service"
DELIVER_UNIT = SYSTEMD / "flightd-deliver.service"
UNITS = pytest.mark.parametrize("unit", [UNIT, GROUND_UNIT, DELIVER_UNIT], ids=lambda unit: unit.stem)


def tool(name: str) -> str:
    found = shutil.which(name)
    if found is None:
        pytest.skip(f"{name} is not installed here")
    return found


def test_a_restart_is_told_from_a_start_by_what_systemd_keeps(tmp_path: Path) -> None:
    environment = {"RUNTIME_DIRECTORY": f"{tmp_path}:/elsewhere"}
    assert not was_started_before(environment)
    note_start(environment)
    assert was_started_before(environment)


def test_without_systemd_every_start_is_the_first(tmp_path: Path) -> None:
    note_start({})
    assert not was_started_before({})
    unwritable = {"RUNTIME_DIRECTORY": str(tmp_path / "gone")}
    note_start(unwritable)
    assert not was_started_before(unwritable)


def test_the_units_mark_is_the_daemons() -> None:
    text = UNIT.read_text()
    assert "RuntimeDirectory=flightd\n" in text
    assert "RuntimeDirectoryPreserve=restart\n" in text
    assert "test -e /run/flightd/started ||" in text


def test_the_quick_doctor_needs_neither_camera_nor_vehicle(flightd: Command, tmp_path: Path) -> None:
    found = json.loads(
        flightd("doctor", "--quick", "--config", SYSTEMD.parent / "configs" / "sim.toml", "--json").stdout
    )
    assert "config" in {check["name"] for check in found["checks"]}
    assert {"camera", "vehicle"}.isdisjoint(check["name"] for check in found["checks"])
    broken = tmp_path / "flightd.toml"
    broken.write_text("[mission]\nsite = 1\n")
    refused = flightd("doctor", "--quick", "--config", broken)
    assert (refused.returncode, len(refused.stderr.splitlines())) == (2, 1)
    assert "mission.site" in refused.stderr


@UNITS
def test_systemd_finds_nothing_wrong_with_the_unit(tmp_path: Path, unit: Path) -> None:
    analyze = tool("systemd-analyze")
    program = tmp_path / "flightd"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    copy = tmp_path / unit.name  # verify wants the program to exist
    copy.write_text(unit.read_text().replace("ExecStart=/opt/flightd/bin/flightd", f"ExecStart={program}"))
    for timer in SYSTEMD.glob(f"{unit.stem}.timer"):
        shutil.copy(timer, tmp_path)
    files = [str(copy), *map(str, tmp_path.glob("*.timer"))]
    result = subprocess.run([analyze, "verify", *files], capture_output=True, text=True, check=False)
    assert (result.returncode, result.stdout + result.stderr) == (0, "")


@UNITS
def test_the_services_exposure_is_low(unit: Path) -> None:
    analyze = tool("systemd-analyze")
    result = subprocess.run(
        [analyze, "security", "--offline=true", "--no-pager", str(unit)],
        capture_output=True,
        text=True,
        check=False,
    )
    found = re.search(r"exposure level for flightd(?:-ground|-deliver)?\.service: ([\d.]+)", result.stdout)
    if found is None:
        pytest.skip(f"this systemd-analyze cannot rate a file: {result.stderr.strip()}")
    assert float(found[1]) <= 2.5


def settings(unit: Path) -> set[str]:
    """The lines of a unit that set something."""
    return {line for line in unit.read_text().splitlines() if line[:1] not in {"", "#", "["}}


def test_a_daemon_that_dies_takes_no_child_with_it() -> None:
    assert "KillMode=process" in settings(UNIT), "its writer finishes the log, see test_orphans"


@pytest.mark.parametrize("unit", [UNIT, GROUND_UNIT], ids=lambda unit: unit.stem)
def test_what_gives_way_to_the_flight_may_do_so(unit: Path) -> None:
    allowed = allowed_calls(unit)
    assert {"getpriority", "setpriority", "prlimit64", "execve"} <= allowed, "what the code calls"
    assert {"sched_setscheduler", "mount", "reboot", "adjtimex"}.isdisjoint(allowed), "the rest stays"


def allowed_calls(unit: Path) -> set[str]:
    """The system calls that the unit's filter lets through, its lines taken one after the other."""
    analyze, allowed = tool("systemd-analyze"), set[str]()
    for line in unit.read_text().splitlines():
        key, _, names = line.partition("=")
        if key != "SystemCallFilter":
            continue
        calls = {call for name in names.lstrip("~").split() for call in members(analyze, name)}
        allowed = allowed - calls if names.startswith("~") else allowed | calls
    return allowed


def members(analyze: str, name: str) -> set[str]:
    """A call, or those of a set and of the sets in it."""
    if not name.startswith("@"):
        return {name}
    listed = subprocess.run([analyze, "syscall-filter", name], capture_output=True, text=True, check=True)
    lines = (line.strip() for line in listed.stdout.splitlines()[1:])
    return {call for line in lines if line and not line.startswith("#") for call in members(analyze, line)}


@pytest.mark.parametrize(
    ("unit", "user"), [(GROUND_UNIT, "flightd-ground"), (DELIVER_UNIT, "flightd")], ids=["ground", "deliver"]
)
def test_what_runs_beside_the_daemon_is_shut_in_as_it_is(unit: Path, user: str) -> None:
    shutting = re.compile(
        r"(Protect|Private|Restrict|NoNew|Memory(Deny)|Lock|System|Capability|Ambient|Keyring|RemoveIPC|IPA|Device)"
    )
    needed_by_the_drone = {line for line in settings(UNIT) if line.startswith("DeviceAllow=")} | {
        "RestrictAddressFamilies=AF_UNIX AF_INET AF_INET6 AF_NETLINK",
        "SystemCallFilter=setpriority",
    }
    daemons = {line for line in settings(UNIT) if shutting.match(line)} - needed_by_the_drone
    assert len(daemons) > 25
    assert daemons <= settings(unit)
    assert f"User={user}" in settings(unit)
    assert f"u {user} -" in (SYSTEMD / "flightd.sysusers").read_text()


def test_a_delivery_yields_to_everything_and_waits_for_its_file() -> None:
    found = settings(DELIVER_UNIT)
    assert {"CPUSchedulingPolicy=idle", "IOSchedulingClass=idle", "Nice=19", "CPUWeight=1"} <= found
    assert "ConditionPathExists=/etc/flightd/deliver.env" in found
    assert "EnvironmentFile=/etc/flightd/deliver.env" in found
    assert "WantedBy=timers.target" in settings(DELIVER_UNIT.with_suffix(".timer"))


@pytest.mark.parametrize("unit", [GROUND_UNIT, DELIVER_UNIT], ids=lambda unit: unit.stem)
def test_who_copies_inventories_copies_them_to_the_disk(unit: Path) -> None:
    assert any(line.endswith(" TMPDIR=/var/tmp") for line in settings(unit))


def test_the_units_words_deliver_and_prune_but_not_while_the_daemon_is_armed(tmp_path: Path) -> None:
    daemons_folder(tmp_path / "drone")
    mark = mark_of(tmp_path)
    program = tmp_path / "program"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m flightd "$@"\n')
    program.chmod(0o755)
    places = {
        "/opt/flightd/bin/flightd": program,
        "/run/flightd/armed": mark,
        "/var/lib/flightd": tmp_path / "drone",
    }

    def run(exit_code: int = 0, **more: str) -> list[str]:
        environment = {**os.environ, "FLIGHTD_STORE": str(tmp_path / "counts.db"), **more}
        (line,) = (line for line in DELIVER_UNIT.read_text().splitlines() if line.startswith("ExecStart="))
        for name, path in places.items():
            line = line.replace(name, str(path))
        ended = subprocess.run(
            shlex.split(line.partition("=")[2]), capture_output=True, text=True, check=False,
            env=environment, cwd=SYSTEMD.parent,
        )  # fmt: skip
        assert ended.returncode == exit_code, ended.stderr
        return ended.stdout.splitlines()

    mark.touch()
    assert run()[-1] == f"{mark}: a flight is on, what is left is for later"
    mark.unlink()
    (line,) = run()
    assert line.startswith("10 looks delivered")
    with opened_store(str(tmp_path / "counts.db")) as store:
        assert [site["site"] for site in store.sites()] == [RACKS.name]
    counted = str(tmp_path / "drone" / "inventory")
    broken = tmp_path / "drone" / "broken" / "inventory.db"
    broken.parent.mkdir()
    broken.write_bytes(b"no database at all, but long enough " * 50)
    line, pruned = run(exit_code=1, FLIGHTD_PRUNE=counted)
    assert line.startswith("0 looks delivered")
    assert pruned.startswith("1 looks and 0 pictures taken away")
    broken.unlink()
    assert len(run(FLIGHTD_PRUNE=counted)) == 2
    assert len(run(exit_code=2, FLIGHTD_PRUNE=str(tmp_path))) == 1, "there is no inventory"


def daemons_folder(folder: Path) -> None:
    """/var/lib/flightd after a flight that counted, as the daemon leaves it."""
    config = load_config(SYSTEMD.parent / "configs" / "sim.toml")
    camera = config.front_camera.model_copy(update={"url": "udp://127.0.0.1:1"})
    with ExitStack() as flight:
        counting = config.model_copy(update={"front_camera": camera})
        assert FlightCount(counting, RACKS, folder / "inventory", flight, run="1").scans
    counted_store(folder / "inventory")
    flown_log(FlightArchive(folder / "flights", 1 << 30).begin(datetime(2026, 11, 29, tzinfo=UTC)), RACKS)


def mark_of(folder: Path) -> Path:
    """The daemon's own mark, where /run/flightd is that folder."""
    found = ArmedMark.of_environment({"RUNTIME_DIRECTORY": "/run/flightd"})
    assert found is not None
    assert str(found.file) == "/run/flightd/armed", "the unit's"
    return folder / found.file.name


def test_the_units_words_start_a_ground_station(tmp_path: Path) -> None:
    line = next(line for line in settings(GROUND_UNIT) if line.startswith("ExecStart="))
    words = line.replace("$OPTIONS", "--listen 127.0.0.1:0").split()[1:]
    assert words[words.index("--flights") + 1] == "/var/lib/flightd", "the daemon's"
    for folder in ("state", "flights"):
        (tmp_path / folder).mkdir()
    words = [word.replace("/var/lib/flightd-ground", str(tmp_path)) for word in words]
    address = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(address)
        manager.settimeout(30)
        process = subprocess.Popen(
            [sys.executable, "-m", "flightd", *words], cwd=SYSTEMD.parent, stderr=subprocess.DEVNULL,
            env={**os.environ, "NOTIFY_SOCKET": address},
        )  # fmt: skip
        try:
            assert manager.recv(1000).decode().startswith("READY=1\nSTATUS=at http://127.0.0.1:")
        finally:
            process.terminate()
            assert process.wait(20) == 0


@pytest.mark.parametrize("file", sorted(SYSTEMD.glob("flightd*.*")), ids=lambda file: file.name)
def test_the_install_script_installs_every_unit_and_takes_it_away(file: Path) -> None:
    text = (SYSTEMD / "install.sh").read_text()
    (variable,) = re.findall(rf'"\$source/systemd/{re.escape(file.name)}" "\$root\$(\w+)"', text)
    removed = next(line for line in text.splitlines() if line.strip().startswith('rm -f "$root$unit"'))
    assert f'"$root${variable}"' in removed
    assert f"enable {file.name}" not in text


def test_the_install_script_is_sound() -> None:
    script = SYSTEMD / "install.sh"
    result = subprocess.run([tool("shellcheck"), script], capture_output=True, text=True, check=False)
    assert (result.returncode, result.stdout) == (0, "")


@pytest.mark.parametrize("words", [["--sideways"], ["--root"], ["--root", "/nonexistent"], ["--extras"]])
def test_the_install_script_refuses_what_it_does_not_know(words: list[str]) -> None:
    result = subprocess.run([SYSTEMD / "install.sh", *words], capture_output=True, text=True, check=False)
    assert result.returncode == 2
    assert result.stderr.splitlines()[-1].startswith("install.sh: ")


@pytest.mark.parametrize("extras", ["nosuch", "ardrone,nosuch", "dev", "*"])
def test_the_install_script_refuses_an_extra_that_is_not_there(extras: str, tmp_path: Path) -> None:
    command = [str(SYSTEMD / "install.sh"), "--extras", extras, "--root", str(tmp_path)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (result.returncode, result.stdout) == (2, "")
    (line,) = result.stderr.splitlines()
    assert line.startswith(f"install.sh: --extras {extras.rpartition(',')[2]}: unknown; choose among ")
    for known in ("ardrone", "ground", "mavsdk", "xlsx"):
        assert known in line
    assert not any(tmp_path.iterdir())


def test_every_rule_for_udev_compares_before_it_sets() -> None:
    lines = [
        line for line in (SYSTEMD / "99-flightd.rules").read_text().splitlines() if line[:1] not in {"", "#"}
    ]
    term = re.compile(r'[A-Z_]+(\{\w+\})?(==|!=|=|\+=)"[^"]*"')
    for line in lines:
        terms = [part.strip() for part in line.split(", ")]
        assert all(term.fullmatch(part) for part in terms), line
        kinds = ["==" in part for part in terms]
        assert kinds == sorted(kinds, reverse=True)
