"""The tables of a store, made and brought up to date by numbered SQL files, one folder for each engine."""

from __future__ import annotations

import re
import uuid
from pathlib import Path

from flightd.core.errors import InputError
from flightd.ground.ground_store.engine import Engine, Session

_FOLDER = Path(__file__).parent / "migrations"
_NAME = re.compile(r"(?P<number>\d{4})_\w+\.sql")


def newest_version(kind: str) -> int:
    """What this flightd knows."""
    return len(_files(kind))


def brought_up(engine: Engine) -> str:
    """Bring the store up to date, all at once or not at all; returns the id that it was
    given when it was made.

    InputError for a store of a newer flightd."""
    files = _files(engine.kind)
    with engine.writing() as session:
        version = engine.version(session)
        if version > len(files):
            raise InputError(
                f"a store of version {version}, known here is {len(files)}",
                file=engine.shown,
                remedy="use the flightd that made it",
            )
        for number in range(version, len(files)):
            engine.script(session, files[number].read_text(encoding="utf-8"))
            engine.set_version(session, number + 1)
        return _own_id(session)


def _own_id(session: Session) -> str:
    found = session.rows("SELECT id FROM store")
    if found:
        return str(found[0][0])
    made = uuid.uuid4().hex
    session.run("INSERT INTO store VALUES (?)", made)
    return made


def _files(kind: str) -> list[Path]:
    """In the order of their numbers, from 1, none left out."""
    found = sorted(path for path in (_FOLDER / kind).iterdir() if _NAME.fullmatch(path.name))
    for number, path in enumerate(found, start=1):
        if int(path.name[:4]) != number:
            raise AssertionError(f"{path.name}: expected number {number:04}")
    return found
