from __future__ import annotations

import asyncio
import errno
import shutil
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

import pytest

from flightd.adapters.recorder import archive as archive_module
from flightd.adapters.recorder.archive import FlightArchive
from flightd.adapters.recorder.mcap_file import McapFile
from flightd.adapters.recorder.mcap_repair import is_whole
from flightd.app.run import room_kept
from flightd.core.errors import TransientError, UnavailableError
from flightd.replay.log import read_log
from flightd.runtime.within import Within
from tests.rigs.event_loops import real
from tests.rigs.waiting import until

STARTED = datetime(2026, 3, 1, 12, 0, 5, tzinfo=UTC)
MEGABYTE = 1 << 20


class Usage(NamedTuple):
    total: int
    used: int
    free: int


def _fly(archive: FlightArchive, size_bytes: int = MEGABYTE, started: datetime = STARTED) -> Path:
    log = archive.begin(started)
    log.write_bytes(b"x" * size_bytes)
    return log.parent


def test_each_flight_has_a_numbered_folder(tmp_path: Path) -> None:
    archive = FlightArchive(tmp_path / "flights", 100 * MEGABYTE)
    folders = [_fly(archive) for _ in range(3)]
    assert [folder.name for folder in folders] == [f"flight-{n:06d}-20260301T120005Z" for n in (1, 2, 3)]
    assert archive.flights() == folders


def test_a_clock_that_was_set_back_does_not_make_a_new_flight_the_oldest(tmp_path: Path) -> None:
    archive = FlightArchive(tmp_path, 5 * MEGABYTE // 2)
    old = _fly(archive)
    _fly(archive)
    after = _fly(archive, started=datetime(1970, 1, 1, tzinfo=UTC))
    assert archive.make_room() == [old]
    assert after in archive.flights()


def test_the_oldest_flights_go_first_and_only_as_many_as_needed(tmp_path: Path) -> None:
    archive = FlightArchive(tmp_path, 3 * MEGABYTE + 4096 * 40)
    folders = [_fly(archive) for _ in range(5)]
    assert archive.make_room() == [folders[1]]  # the first went when the fifth began
    assert archive.flights() == folders[2:]


def test_the_flight_in_progress_is_never_removed(tmp_path: Path) -> None:
    archive = FlightArchive(tmp_path, 0)
    _fly(archive)
    current = _fly(archive, 3 * MEGABYTE)
    archive.make_room()
    assert archive.flights() == [current]


def test_a_disk_without_room_for_a_folder_gets_some_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    archive = FlightArchive(tmp_path, 100 * MEGABYTE, reserve_bytes=MEGABYTE)
    first, second = _fly(archive), _fly(archive)
    mkdir = Path.mkdir

    def usage(path: Path) -> Usage:
        return Usage(0, 0, 0 if first.exists() else 2 * MEGABYTE)

    def make(path: Path, *, parents: bool) -> None:
        if not usage(path).free:
            raise OSError(errno.ENOSPC, "No space left on device")
        mkdir(path, parents=parents)

    monkeypatch.setattr(shutil, "disk_usage", usage)
    monkeypatch.setattr(Path, "mkdir", make)
    third = archive.begin(STARTED).parent
    assert archive.flights() == [second, third]
    assert third.name.startswith("flight-000003-")


def test_what_is_not_a_flight_is_never_removed(tmp_path: Path) -> None:
    names = ("precious", "flight-1", "flight-000001-20260301T120005Z.bak")
    for name in names:
        (tmp_path / name).mkdir()
        (tmp_path / name / "data").write_bytes(b"x" * MEGABYTE)
    archive = FlightArchive(tmp_path, 0)
    _fly(archive)
    archive.make_room()
    assert {"precious", "flight-1", "flight-000001-20260301T120005Z.bak"} < {
        p.name for p in tmp_path.iterdir()
    }


def test_a_short_disk_costs_old_flights_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    archive = FlightArchive(tmp_path, 100 * MEGABYTE, reserve_bytes=10 * MEGABYTE)
    folders = [_fly(archive) for _ in range(4)]

    def free(_: Path) -> Usage:
        return Usage(0, 0, (12 - len(archive.flights())) * MEGABYTE)

    monkeypatch.setattr(shutil, "disk_usage", free)
    assert archive.make_room() == folders[:2]


def _write_cut_off(log: Path) -> None:
    """As a log with one message is when its writer was killed."""
    file = McapFile.create(log.with_suffix(".whole"))
    file.add_channel(1, "/a", "A", "{}")
    file.add_message(1, 1, b"{}")
    file.flush()
    shutil.copyfile(log.with_suffix(".whole"), log)
    file.close()


def test_logs_that_were_cut_off_are_mended_at_the_next_start(tmp_path: Path) -> None:
    archive = FlightArchive(tmp_path, 100 * MEGABYTE)
    log = archive.begin(STARTED)
    _write_cut_off(log)
    (archive.begin(STARTED)).write_bytes(b"not a log")
    later = FlightArchive(tmp_path, 100 * MEGABYTE)
    assert read_log(log).damage
    assert later.mend() == [log]
    assert read_log(log).damage == ""
    assert len(read_log(log).entries) == 1
    assert later.mend() == []


def test_a_log_that_is_still_being_written_is_left_alone(tmp_path: Path) -> None:
    log = FlightArchive(tmp_path, 100 * MEGABYTE).begin(STARTED)
    file = McapFile.create(log)
    file.add_channel(1, "/a", "A", "{}")
    file.add_message(1, 1, b"{}")
    file.flush()
    assert FlightArchive(tmp_path, 100 * MEGABYTE).mend() == []
    file.add_message(1, 2, b"{}")
    file.close()
    assert len(read_log(log).entries) == 2


def test_beside_a_flight_it_mends_and_makes_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    broken = FlightArchive(tmp_path, 100 * MEGABYTE).begin(STARTED)
    _write_cut_off(broken)
    archive = FlightArchive(tmp_path, 5 * MEGABYTE)
    current = archive.begin(STARTED)

    async def fly() -> None:
        running = asyncio.ensure_future(archive.run())
        await until(lambda: is_whole(broken))
        for _ in range(7):  # the flight fills the disk
            with current.open("ab") as stream:
                stream.write(b"x" * MEGABYTE)
        await until(lambda: not broken.parent.exists())
        running.cancel()
        await asyncio.wait([running])

    monkeypatch.setattr(archive_module, "ROOM_S", 0.05)
    real(fly())
    assert archive.flights() == [current.parent]


def test_a_folder_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UnavailableError, match="cannot make the flight's folder"):
        FlightArchive(tmp_path / "file", MEGABYTE).begin(STARTED)


def test_trouble_with_the_archive_is_told_at_once_and_the_flight_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(archive_module, "ROOM_S", 0.01)
    archive = FlightArchive(tmp_path / "flights", 100 * MEGABYTE)
    _fly(archive)
    told: list[str] = []

    async def flight(failure: Exception) -> None:
        def refuse() -> None:
            raise failure

        monkeypatch.setattr(archive, "make_room", refuse)
        told.clear()
        heard = asyncio.Event()

        def hear(err: TransientError) -> None:
            told.append(str(err))
            heard.set()

        async with room_kept(archive, hear), Within(10.0):
            await heard.wait()

    real(flight(OSError(5, "Input/output error")))
    assert "cannot make room" in told[0]
    assert "Input/output error" in told[0]
    real(flight(ZeroDivisionError("a fault")))
    assert told[0] == "ZeroDivisionError: a fault"
    real(flight(UnavailableError("no folder")))
    assert "not looked after any more" in told[0]
