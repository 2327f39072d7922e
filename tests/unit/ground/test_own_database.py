"""A file of the station's own, opened by several at once."""

from __future__ import annotations

import sqlite3
import threading
from pathlib import Path
from typing import Any

import pytest

from flightd.ground.own_database import OwnDatabase


def _database(file: Path) -> OwnDatabase:
    return OwnDatabase(
        file=file,
        holds="the notes",
        application=0x666C7400,
        version=1,
        schema="CREATE TABLE note (text TEXT)",
    )


def _keep(file: Path, text: str) -> None:
    with _database(file).changed() as opened:
        opened.execute("INSERT INTO note VALUES (?)", (text,))


class _Interrupted(sqlite3.Connection):
    """Another thread keeps something in the same file once it was asked whose it is: it is done before the
    next question, or waits for the end of all of them."""

    other: threading.Thread
    other_has_begun: threading.Event

    def execute(self, question: str, *parameters: Any) -> sqlite3.Cursor:
        answer = super().execute(question, *parameters)
        if question == "PRAGMA application_id" and not self.other_has_begun.is_set():
            self.other.start()
            self.other_has_begun.wait(10)
            self.other.join(0.3)
        return answer


def test_a_file_that_another_makes_between_two_questions_is_no_stranger_s(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, connect = tmp_path / "notes.db", sqlite3.connect
    has_begun, failed = threading.Event(), []

    def keep_another() -> None:
        monkeypatch.setattr(sqlite3, "connect", connect)
        has_begun.set()
        try:
            _keep(file, "other")
        except Exception as err:  # noqa: BLE001 - told below, whatever it is
            failed.append(err)

    _Interrupted.other, _Interrupted.other_has_begun = threading.Thread(target=keep_another), has_begun
    monkeypatch.setattr(
        sqlite3, "connect", lambda *given, **named: connect(*given, factory=_Interrupted, **named)
    )
    _keep(file, "own")
    _Interrupted.other.join(10)
    assert not failed
    with _database(file).opened() as opened:
        assert {text for (text,) in opened.execute("SELECT text FROM note")} == {"own", "other"}
