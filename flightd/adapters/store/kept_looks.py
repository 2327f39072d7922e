"""Looks out of the inventory's file: some of them with all that is known, or all of them without it."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from flightd.adapters.store.label_texts import found_texts, kept_texts
from flightd.adapters.store.place_fills import kept_fills
from flightd.adapters.store.schema import WITH_AGAIN, WITH_FILLS, WITH_TEXTS, WITH_UNDECIDED
from flightd.adapters.store.undecided_codes import kept_undecided
from flightd.core.inventory import (
    CountPose,
    LocationState,
    Observation,
    PlaceFill,
    Standing,
    UndecidedCode,
)
from flightd.core.label_values import LabelValue
from flightd.core.types import CodeRead

NEWEST_CONFIRMED: Final = (
    f"SELECT (SELECT id FROM observation WHERE location = code AND standing = {Standing.CONFIRMED:d}"  # noqa: S608
    " ORDER BY utc_ns DESC, id DESC LIMIT 1) FROM location"
)
"""The ids of the looks by which the locations stand, NULL for one without."""


@dataclass(frozen=True, slots=True)
class KeptLook:
    """What can be said of a look without its reads."""

    id: str
    run: str
    evidence: str
    standing: Standing
    texts: tuple[LabelValue, ...]


def ids_and_texts(db: sqlite3.Connection, version: int) -> sqlite3.Cursor:
    """The rows of `kept_look`, oldest first."""
    found, beside = "'[]'", ""
    if version >= WITH_TEXTS:
        found, beside = "coalesce(found, '[]')", " LEFT JOIN text_search ON observation = id"
    return db.execute(
        f"SELECT id, run, evidence, standing, {found} FROM observation{beside} ORDER BY utc_ns, id"  # noqa: S608
    )


def kept_look(row: tuple[Any, ...]) -> KeptLook:
    """TypeError or ValueError for a row of another program."""
    look, run, evidence, standing, found = row
    return KeptLook(look, run, evidence, Standing(standing), found_texts(found))


def kept_looks(
    db: sqlite3.Connection, version: int, where: str = "TRUE", values: Sequence[object] = ()
) -> list[tuple[Observation, Standing]]:
    """The looks `where` that is so of their rows, with their standing, oldest first.  TypeError or ValueError
    for rows of another program."""
    of = f"observation IN (SELECT id FROM observation WHERE {where})"  # noqa: S608
    reads: dict[str, list[CodeRead]] = {}
    module = "module_px" if version >= WITH_TEXTS else "NULL"
    for seen, symbology, text, sure, agreeing, quality, gs1, module_px in db.execute(
        f"SELECT observation, symbology, text, sure, agreeing, quality, gs1, {module} FROM code_read "  # noqa: S608
        f"WHERE {of} ORDER BY observation, number",
        values,
    ):
        read = CodeRead(
            symbology, text, (), bool(sure), agreeing, quality, elements(gs1), module_px=module_px
        )
        reads.setdefault(seen, []).append(read)
    texts = kept_texts(db, of, values) if version >= WITH_TEXTS else {}
    fills = kept_fills(db, of, values) if version >= WITH_FILLS else {}
    undecided = kept_undecided(db, of, values) if version >= WITH_UNDECIDED else {}
    again = "again" if version >= WITH_AGAIN else "0"
    rows = db.execute(
        f"SELECT id, run, location, utc_ns, state, confidence, evidence, {again}, node, x_m, y_m, height_m, "  # noqa: S608
        f"yaw_rad, standing FROM observation WHERE {where} ORDER BY utc_ns, id",
        values,
    )
    return [
        (
            _observation(
                row[:-1],
                tuple(reads.get(row[0], ())),
                texts.get(row[0], ()),
                fills.get(row[0]),
                undecided.get(row[0], ()),
            ),
            Standing(row[-1]),
        )
        for row in rows
    ]


def elements(gs1: str) -> tuple[tuple[str, str], ...]:
    """ValueError, TypeError for what are no GS1 elements."""
    found = tuple((ai, value) for ai, value in json.loads(gs1))
    for ai, value in found:
        f"{ai}{value}".encode()  # half a character is no text
        if not (isinstance(ai, str) and isinstance(value, str)):
            raise TypeError("GS1 elements that are no text")
    return found


def _observation(
    row: tuple[Any, ...],
    reads: tuple[CodeRead, ...],
    texts: tuple[LabelValue, ...],
    fill: PlaceFill | None,
    undecided: tuple[UndecidedCode, ...],
) -> Observation:
    _, run, location, utc_ns, state, confidence, evidence, again, node, *place = row
    pose = None if node is None else CountPose(node, *place)
    seen = LocationState(state)
    looked = run, location, utc_ns, seen, confidence, reads, pose, evidence, texts, fill
    return Observation(*looked, again=bool(again), undecided=undecided)
