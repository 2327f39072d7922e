"""Which flights are listed, what is told of each, and that nothing leads out of the folder."""

from __future__ import annotations

import os
import shutil
from datetime import UTC, datetime
from pathlib import Path

import pytest

from flightd.adapters.recorder.recorder import McapRecorder, wait_for_disk
from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.errors import InputError
from flightd.core.inventory import LocationState, PlannedLocation
from flightd.ground.flights import log_folder
from flightd.ground.flights.flight_row import FlightRow, read_rows
from flightd.ground.flights.flight_view import read_report, read_view
from flightd.ground.flights.log_folder import FoundLogs, find_logs, log_id, path_of
from flightd.ground.flights.sized_cache import SizedCache
from flightd.ground.read_folders import read_folders
from flightd.ground.stores import Stores
from tests.replay.synthetic_flight import write_flight
from tests.web.stock_rig import look


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_flight(tmp_path_factory.mktemp("flown"))


def copied(flown: Path, folder: Path, name: str = "flight.mcap") -> Path:
    """The flight's folder as it was left, elsewhere."""
    shutil.copytree(flown.parent, folder, dirs_exist_ok=True)
    log = folder / "flight.mcap"
    return log.rename(folder / name)


def row_of(root: Path) -> FlightRow:
    (row,) = read_rows(find_logs(root).logs)
    return row


def test_flights_of_further_folders_are_named_by_them_and_one_that_is_not_there_is_passed_over(
    flown: Path, tmp_path: Path
) -> None:
    root, others = tmp_path / "root", [tmp_path / "a" / "drone", tmp_path / "b" / "drone", tmp_path / "gone"]
    for folder in (root, *others[:2]):
        copied(flown, folder / "one")
    (root / "inventory.db").touch()
    (others[1] / "inventory.db").touch()
    named = read_folders(others)
    found = find_logs(root, named)
    assert len({log.id for log in found.logs}) == 3
    rows = {row.path: row for row in read_rows(found.logs)}
    assert set(rows) == {
        "one/flight.mcap", "drone:one/flight.mcap", "drone-2:one/flight.mcap"
    }  # fmt: skip
    assert {row.site for row in rows.values()} == {"demo"}
    stores = Stores(root, named)
    assert {name for name, _ in stores.names()} >= {".", "drone-2:."}
    assert stores.folder("drone-2:.") == others[1]


def test_a_flight_is_listed_with_what_its_judge_said(flown: Path, tmp_path: Path) -> None:
    copied(flown, tmp_path / "deep" / "er")
    row = row_of(tmp_path)
    assert (row.path, row.site, row.drone) == ("deep/er/flight.mcap", "demo", "ardupilot")
    assert (row.outcome, row.trouble, row.running) == ("completed", "", False)
    assert (row.nodes_visited, row.nodes_planned, row.codes_read, row.landed_error_m) == (12, 12, 36, 0.061)
    assert (row.cross_track_rms_m, row.hover_error_p95_m) == (0.0214, 0.0543)


def test_without_a_summary_the_log_itself_tells_how_it_ended(flown: Path, tmp_path: Path) -> None:
    copied(flown, tmp_path)
    (tmp_path / "summary.json").unlink()
    row = row_of(tmp_path)
    assert (row.outcome, row.verdict, row.cross_track_rms_m) == ("completed", "", None)
    assert row.duration_s == pytest.approx(100, abs=60)


def cut(log: Path, age_s: float) -> None:
    log.write_bytes(log.read_bytes()[: log.stat().st_size // 2])
    written_s = log.stat().st_mtime - age_s
    os.utime(log, (written_s, written_s))


def test_a_broken_and_a_running_log_are_told_apart(flown: Path, tmp_path: Path) -> None:
    for name, age_s in (("old", 600.0), ("new", 1.0)):
        log = copied(flown, tmp_path / name)
        (log.parent / "summary.json").unlink()
        cut(log, age_s)
    rows = {row.path: row for row in read_rows(find_logs(tmp_path).logs)}
    old, new = rows["old/flight.mcap"], rows["new/flight.mcap"]
    assert (old.running, new.running) == (False, True)
    assert (old.outcome, new.outcome) == ("unfinished", "flying")
    assert "cut off" in old.trouble
    assert "being recorded" in new.trouble


@pytest.mark.parametrize(
    ("content", "told"), [(b"", "empty"), (b"<html>", "not a flight log"), (b"\x89MCAP0\r\n", "cut off")]
)
def test_what_is_no_flight_is_told_in_one_line(content: bytes, told: str, tmp_path: Path) -> None:
    (tmp_path / "odd.mcap").write_bytes(content)
    os.utime(tmp_path / "odd.mcap", (1e9, 1e9))
    row = row_of(tmp_path)
    assert told in row.trouble
    assert "\n" not in row.trouble
    assert str(tmp_path) not in row.trouble
    assert row.outcome == ""


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", '{"mission": 7, "faults": "x", "nodes_visited": true, "cross_track_rms_m": "NaN"}'],
)
def test_a_summary_of_nonsense_does_not_hide_the_flight(text: str, flown: Path, tmp_path: Path) -> None:
    copied(flown, tmp_path)
    (tmp_path / "summary.json").write_text(text)
    row = row_of(tmp_path)
    assert (row.outcome, row.faults, row.cross_track_rms_m) == ("completed", (), None)


def test_the_truth_is_no_flight_and_links_are_not_followed(flown: Path, tmp_path: Path) -> None:
    root, outside = tmp_path / "root", tmp_path / "outside"
    root.mkdir()
    copied(flown, outside)
    (root / "linked").symlink_to(outside, target_is_directory=True)
    (root / "linked.mcap").symlink_to(outside / "flight.mcap")
    os.mkfifo(root / "pipe.mcap")
    shutil.copy(outside / "truth.mcap", root / "truth.mcap")
    (root / "loop").symlink_to(root, target_is_directory=True)
    assert find_logs(root).logs == ()


@pytest.mark.parametrize(
    "relative",
    [
        "../outside/flight.mcap",
        "linked/flight.mcap",
        "linked.mcap",
        "/etc/passwd",
        "",
        "a\0b",
        "..",
        "gone.mcap",
    ],
)
def test_no_path_leads_out_of_the_folder(relative: str, flown: Path, tmp_path: Path) -> None:
    root, outside = tmp_path / "root", tmp_path / "outside"
    root.mkdir()
    copied(flown, outside)
    (root / "linked").symlink_to(outside, target_is_directory=True)
    (root / "linked.mcap").symlink_to(outside / "flight.mcap")
    with pytest.raises(InputError):
        path_of(root, relative)


def test_a_log_that_became_a_link_since_it_was_found_is_refused(flown: Path, tmp_path: Path) -> None:
    log = copied(flown, tmp_path / "root")
    (found,) = find_logs(tmp_path / "root").logs
    log.rename(tmp_path / "elsewhere.mcap")
    log.symlink_to(tmp_path / "elsewhere.mcap")
    with pytest.raises(InputError, match="does not lie in the folder"):
        read_view(tmp_path / "root", found.relative)


@pytest.mark.parametrize("name", ["summary.json", "truth.mcap"])
def test_what_lies_beside_a_log_as_a_link_is_not_read(name: str, flown: Path, tmp_path: Path) -> None:
    log = copied(flown, tmp_path / "root")
    secret = tmp_path / name
    log.with_name(name).rename(secret)
    log.with_name(name).symlink_to(secret)
    row = row_of(tmp_path / "root")
    assert (row.cross_track_rms_m is None) == (name == "summary.json")
    view = read_view(tmp_path / "root", row.path)
    assert ("true_height_m" in view.columns) == (name != "truth.mcap")
    with pytest.raises(InputError, match=f"{name} beside the log is a link"):
        read_report(tmp_path / "root", row.path)


@pytest.mark.parametrize("state", ["closed", "being written", "cut off"])
def test_a_report_changes_nothing_in_the_folder_of_an_inventory(
    state: str, flown: Path, tmp_path: Path
) -> None:
    log = copied(flown, tmp_path / "root")
    with SqliteStore(tmp_path / "written") as store:
        store.plan([PlannedLocation("AL-01-1-1", "A1")])
        store.commit(look("AL-01-1-1", LocationState.EMPTY))
        if state != "closed":
            shutil.copytree(store.folder, log.parent, dirs_exist_ok=True)
    if state == "closed":
        shutil.copytree(tmp_path / "written", log.parent, dirs_exist_ok=True)
    if state == "cut off":
        (log.parent / "inventory.db-shm").unlink()
    before = {file.name: file.read_bytes() for file in log.parent.glob("inventory.db*")}
    changed_ns = log.parent.stat().st_mtime_ns
    assert b"AL-01-1-1" in read_report(tmp_path / "root", "flight.mcap")
    assert {file.name: file.read_bytes() for file in log.parent.glob("inventory.db*")} == before
    assert log.parent.stat().st_mtime_ns == changed_ns


@pytest.mark.parametrize(
    "name", ["ä ö.mcap", "a%2f..%2fb.mcap", "<b>.mcap", "-rf.mcap", "back\\slash.mcap", "line\nbreak.mcap"]
)
def test_odd_names_are_listed_and_found(name: str, flown: Path, tmp_path: Path) -> None:
    copied(flown, tmp_path, name)
    (found,) = find_logs(tmp_path).logs
    assert path_of(tmp_path, found.relative).name == name
    assert row_of(tmp_path).outcome == "completed"


def test_a_name_that_is_no_text_is_listed_and_found(flown: Path, tmp_path: Path) -> None:
    name = os.fsdecode(b"\xff\xfe.mcap")
    try:
        copied(flown, tmp_path, name)
    except OSError:
        pytest.skip("this file system takes no such names")
    row = row_of(tmp_path)
    assert row.path.encode().decode() == row.path
    assert row.path.endswith(".mcap")
    assert path_of(tmp_path, find_logs(tmp_path).logs[0].relative).is_file()


def test_an_id_is_the_same_as_long_as_the_log_lies_there() -> None:
    assert log_id("a/flight.mcap") == log_id("a/flight.mcap") != log_id("b/flight.mcap")
    assert log_id("a/flight.mcap").isalnum()


def test_a_stamp_changes_with_the_log_and_with_what_is_told_of_it(flown: Path, tmp_path: Path) -> None:
    log = copied(flown, tmp_path)
    stamps = [find_logs(tmp_path).logs[0].stamp]
    os.utime(log.with_name("summary.json"), (1e9, 1e9))
    stamps.append(find_logs(tmp_path).logs[0].stamp)
    cut(log, 0.0)
    stamps.append(find_logs(tmp_path).logs[0].stamp)
    assert len(set(stamps)) == 3


def test_a_folder_without_an_end_is_cut(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for number in range(30):
        (tmp_path / f"{number}.mcap").write_bytes(b"")
    monkeypatch.setattr(log_folder, "MOST_LOGS", 10)
    found = find_logs(tmp_path)
    assert (len(found.logs), found.cut) == (10, True)
    monkeypatch.setattr(log_folder, "MOST_LOGS", 100)
    assert not find_logs(tmp_path).cut
    monkeypatch.setattr(log_folder, "MOST_ENTRIES", 20)
    assert find_logs(tmp_path).cut


def test_folders_too_deep_to_be_looked_at_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a" / "b" / "c").mkdir(parents=True)
    (tmp_path / "a" / "b" / "c" / "flight.mcap").write_bytes(b"")
    monkeypatch.setattr(log_folder, "DEEPEST", 2)
    assert find_logs(tmp_path) == FoundLogs((), cut=True)
    monkeypatch.setattr(log_folder, "DEEPEST", 3)
    assert len(find_logs(tmp_path).logs) == 1
    assert not find_logs(tmp_path).cut


def test_a_folder_that_is_gone_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be looked at"):
        find_logs(tmp_path / "gone")


def test_the_cache_keeps_what_was_used_last_and_never_more_than_it_may() -> None:
    cache: SizedCache[str, str] = SizedCache(10)
    cache.put("a", "A", 4)
    cache.put("b", "B", 4)
    assert cache.get("a") == "A"
    cache.put("c", "C", 4)
    assert (cache.get("b"), cache.get("a"), cache.bytes) == (None, "A", 8)
    cache.put("huge", "H", 11)
    cache.put("a", "A2", 1)
    assert (cache.get("huge"), cache.get("a"), cache.bytes, len(cache)) == (None, "A2", 5, 2)


def test_the_date_is_what_the_log_says_else_when_it_was_written(flown: Path, tmp_path: Path) -> None:
    said = tmp_path / "said" / "flight.mcap"
    said.parent.mkdir()
    with McapRecorder(said, when_full=wait_for_disk, metadata={"started": "2026-03-04 05:06:07 UTC"}):
        pass
    silent = copied(flown, tmp_path / "silent")
    os.utime(silent, (1_700_000_000,) * 2)
    rows = {row.path: row for row in read_rows(find_logs(tmp_path).logs)}
    assert rows["said/flight.mcap"].started_s == datetime(2026, 3, 4, 5, 6, 7, tzinfo=UTC).timestamp()
    assert rows["said/flight.mcap"].trouble == "holds no flight"
    lasted_s = 1_700_000_000 - rows["silent/flight.mcap"].started_s
    assert 60 < lasted_s < 120, "the flight's length before it was written last"
