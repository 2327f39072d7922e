"""A store that is only read: it shows what a writer has committed, and nothing beside it changes."""

from __future__ import annotations

import shutil
import sqlite3
from dataclasses import replace
from pathlib import Path

import pytest

from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.errors import InputError, UnavailableError
from flightd.core.inventory import LocationState, Observation, PlaceFill, PlannedLocation, Standing

EMPTY = Observation("monday", "A-1", 5, LocationState.EMPTY, 0.9)


def files(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir() if path.name != "evidence"}


def test_it_shows_what_a_writer_commits_meanwhile(tmp_path: Path) -> None:
    with SqliteStore(tmp_path) as writer:
        writer.plan([PlannedLocation("A-1", "N1")])
        with SqliteStore(tmp_path, read_only=True) as reader:
            assert [record.state for record in reader.locations()] == [LocationState.NOT_VISITED]
        writer.commit(EMPTY, confirmed=False)
        before = files(tmp_path)
        with SqliteStore(tmp_path, read_only=True) as reader:
            assert reader.looks("A-1") == [(EMPTY, Standing.PENDING)]
            writer.settle("monday", ["A-1"], confirmed=False)
            assert reader.looks() == [(EMPTY, Standing.WITHDRAWN)]
        assert files(tmp_path) == before


def test_it_leaves_no_file_beside_a_store_that_nobody_writes(tmp_path: Path) -> None:
    with SqliteStore(tmp_path) as writer:
        writer.commit(EMPTY)
    before = files(tmp_path)
    assert before == {"inventory.db"}
    with SqliteStore(tmp_path, read_only=True) as reader:
        assert reader.history("A-1") == [EMPTY]
        with pytest.raises(UnavailableError, match="cannot be written: attempt to write a readonly"):
            reader.commit(EMPTY)
    assert files(tmp_path) == before


def test_what_a_writer_that_was_killed_left_in_its_log_is_read(tmp_path: Path) -> None:
    killed = tmp_path / "killed"
    with SqliteStore(tmp_path / "flown") as writer:
        writer.commit(EMPTY)
        shutil.copytree(tmp_path / "flown", killed)
    assert files(killed) == {"inventory.db", "inventory.db-wal", "inventory.db-shm"}
    index = (killed / "inventory.db-shm").read_bytes()
    for left in (index, bytes(len(index))):
        (killed / "inventory.db-shm").write_bytes(left)
        with SqliteStore(killed, read_only=True) as reader:
            assert reader.history("A-1") == [EMPTY]
        assert (killed / "inventory.db-shm").read_bytes() == left


def test_a_log_without_its_index_is_left_to_a_writer(tmp_path: Path) -> None:
    with SqliteStore(tmp_path) as writer:
        writer.commit(EMPTY)
        (tmp_path / "inventory.db-shm").unlink()
        with pytest.raises(UnavailableError, match="was cut off; flightd inventory show"):
            SqliteStore(tmp_path, read_only=True)
        assert "inventory.db-shm" not in files(tmp_path)


@pytest.mark.parametrize("version", [2, 3, 4, 5, 6, 7, 8])
def test_a_store_of_a_format_before_is_read_as_it_is(tmp_path: Path, version: int) -> None:
    seen = replace(EMPTY, fill=PlaceFill(0.0)) if version >= 4 else EMPTY
    with SqliteStore(tmp_path) as writer:
        writer.commit(seen)
    with sqlite3.connect(tmp_path / "inventory.db") as older:
        older.execute("DROP TABLE site")
        if version < 8:
            older.execute("DROP TABLE undecided_code")
        if version < 7:
            older.execute("ALTER TABLE location DROP COLUMN pallets_deep")
            for column in ("case_columns", "case_rows", "lean_m")[: 2 if version >= 5 else 3]:
                older.execute(f"ALTER TABLE place_fill DROP COLUMN {column}")
        if version < 6:
            older.execute("ALTER TABLE observation DROP COLUMN again")
        if version < 4:
            older.execute("DROP TABLE place_fill")
        if version == 2:
            older.execute("ALTER TABLE code_read DROP COLUMN module_px")
            older.execute("DROP TABLE text_search")
        older.execute(f"PRAGMA user_version = {version}")
    older.close()
    with SqliteStore(tmp_path, read_only=True) as store:
        assert [record.observation for record in store.locations()] == [seen]
        assert store.site == ""


def test_what_is_no_store_of_today_is_refused_and_not_made_one(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"holds no inventory\.db"):
        SqliteStore(tmp_path / "none", read_only=True)
    assert not (tmp_path / "none").exists()
    file = tmp_path / "inventory.db"
    file.write_bytes(b"no database at all" * 100)
    with pytest.raises(InputError, match="no inventory, or a damaged one"):
        SqliteStore(tmp_path, read_only=True)
    file.unlink()
    with SqliteStore(tmp_path):
        pass
    with sqlite3.connect(file) as changed:
        changed.execute("PRAGMA user_version = 1")
    changed.close()
    with pytest.raises(UnavailableError, match="format 1, known here is 9; open it once with flightd inven"):
        SqliteStore(tmp_path, read_only=True)
    with sqlite3.connect(file) as changed:
        changed.execute("PRAGMA application_id = 7")
    changed.close()
    with pytest.raises(InputError, match="no inventory; choose another folder"):
        SqliteStore(tmp_path, read_only=True)
