"""What people decided is kept in the station's own file: added to, never changed, told apart by store."""

from __future__ import annotations

import sqlite3
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from flightd.core.errors import InputError, UnavailableError
from flightd.ground import decision_book
from flightd.ground.decision_book import FILE, Decided, Decision, DecisionBook


def decision(number: int, what: Decided = Decided.LOOKING) -> Decision:
    return Decision(f"decision-{number}", "A-1", 10 + number, 5, what, "Ann", "<i>note</i>")


def test_nothing_is_made_before_somebody_decides(tmp_path: Path) -> None:
    assert DecisionBook(tmp_path).decisions("monday") == []
    assert list(tmp_path.iterdir()) == []


def test_what_was_decided_is_told_in_order_by_whoever_opens_it_next(tmp_path: Path) -> None:
    first, second = decision(1), decision(2, Decided.FINE)
    DecisionBook(tmp_path).add("monday", second)
    DecisionBook(tmp_path).add("monday", first)
    DecisionBook(tmp_path).add("tuesday", decision(3))
    assert DecisionBook(tmp_path).decisions("monday") == [first, second]
    assert DecisionBook(tmp_path).decisions("none") == []


def test_the_same_decision_again_changes_nothing(tmp_path: Path) -> None:
    book = DecisionBook(tmp_path)
    book.add("monday", decision(1))
    book.add("monday", decision(1, Decided.FINE))
    assert book.decisions("monday") == [decision(1)]


def test_many_decide_at_once_and_none_is_lost(tmp_path: Path) -> None:
    book = DecisionBook(tmp_path)
    with ThreadPoolExecutor(8) as people:
        list(people.map(lambda number: book.add("monday", decision(number)), range(40)))
    assert len(book.decisions("monday")) == 40


def test_another_programs_file_is_left_alone(tmp_path: Path) -> None:
    file = tmp_path / FILE
    file.write_bytes(b"no database at all" * 100)
    with pytest.raises(InputError, match="not the decisions of a ground station"):
        DecisionBook(tmp_path).add("monday", decision(1))
    file.unlink()
    other = sqlite3.connect(file)
    other.execute("CREATE TABLE theirs (x)")
    other.close()
    with pytest.raises(InputError, match="not the decisions of a ground station, or of another version"):
        DecisionBook(tmp_path).decisions("monday")


def test_a_disk_that_refuses_is_named(tmp_path: Path) -> None:
    (tmp_path / FILE).mkdir()
    with pytest.raises(UnavailableError, match=r"ground\.db: unable to open"):
        DecisionBook(tmp_path).add("monday", decision(1))


def test_a_book_is_made_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a power cut between two statements leaves."""
    whole = decision_book.SCHEMA
    monkeypatch.setattr(decision_book, "SCHEMA", whole.replace("CREATE INDEX", "CREATE NOTHING"))
    with pytest.raises(UnavailableError):
        DecisionBook(tmp_path).add("monday", decision(1))
    monkeypatch.setattr(decision_book, "SCHEMA", whole)
    DecisionBook(tmp_path).add("monday", decision(1))
    assert DecisionBook(tmp_path).decisions("monday") == [decision(1)]


def test_stations_that_make_the_same_book_at_once_lose_nothing(tmp_path: Path) -> None:
    with ThreadPoolExecutor(8) as stations:
        list(stations.map(lambda n: DecisionBook(tmp_path).add("monday", decision(n)), range(16)))
    assert len(DecisionBook(tmp_path).decisions("monday")) == 16
