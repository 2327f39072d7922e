"""The tables of the inventory's file, and what makes a file of an earlier format one of today's."""

from __future__ import annotations

from typing import Final

from flightd.adapters.store.label_texts import TEXT_TABLES
from flightd.adapters.store.place_fills import CASE_COLUMNS, FILL_TABLES, LEAN_COLUMN
from flightd.adapters.store.undecided_codes import UNDECIDED_TABLES

VERSION: Final = 9
WITH_TEXTS: Final = 3
"""The first format with module sizes and printed text."""
WITH_FILLS: Final = 4
"""The first that says how full places are."""
WITH_AGAIN: Final = 6
"""The first that says which looks are second ones."""
WITH_DEPTHS: Final = 7
"""The first that says how many pallets stand behind one another."""
WITH_UNDECIDED: Final = 8
"""The first that has codes which stayed undecided."""
WITH_SITE: Final = 9
"""The first that says of which site it is."""
READABLE: Final = (2, 3, 4, 5, 6, 7, 8, VERSION)
"""Formats that are read as they are: what they lack is not known, and places are one pallet deep."""
APPLICATION: Final = 0x666C7464
"""`fltd`: SQLite's application id, so that another program's file is told apart."""
_SITE_TABLE: Final = (
    """CREATE TABLE site (
    only_one INTEGER PRIMARY KEY CHECK (only_one = 1),
    name TEXT NOT NULL
) STRICT""",
)
TAKEN_OVER: Final = {
    1: ("ALTER TABLE observation ADD COLUMN standing INTEGER NOT NULL DEFAULT 1",),
    2: ("ALTER TABLE code_read ADD COLUMN module_px REAL", *TEXT_TABLES),
    3: FILL_TABLES,
    4: LEAN_COLUMN,
    5: ("ALTER TABLE observation ADD COLUMN again INTEGER NOT NULL DEFAULT 0",),
    6: (*CASE_COLUMNS, "ALTER TABLE location ADD COLUMN pallets_deep INTEGER NOT NULL DEFAULT 1"),
    7: UNDECIDED_TABLES,
    8: _SITE_TABLE,
}
"""What makes a file of each earlier format one of the next."""
_LATER: Final = (*TEXT_TABLES, *FILL_TABLES, *LEAN_COLUMN, *CASE_COLUMNS, *UNDECIDED_TABLES, *_SITE_TABLE)
SCHEMA: Final = (
    """CREATE TABLE location (
    code TEXT PRIMARY KEY,
    node TEXT NOT NULL,
    pallets_deep INTEGER NOT NULL DEFAULT 1
) STRICT, WITHOUT ROWID""",
    """CREATE TABLE observation (
    id TEXT PRIMARY KEY,
    run TEXT NOT NULL,
    location TEXT NOT NULL REFERENCES location (code),
    utc_ns INTEGER NOT NULL,
    state TEXT NOT NULL CHECK (state IN ('read', 'several', 'empty', 'unreadable', 'occluded')),
    confidence REAL NOT NULL CHECK (confidence BETWEEN 0 AND 1),
    node TEXT, x_m REAL, y_m REAL, height_m REAL, yaw_rad REAL,
    evidence TEXT NOT NULL,
    standing INTEGER NOT NULL DEFAULT 1,
    again INTEGER NOT NULL DEFAULT 0
) STRICT, WITHOUT ROWID""",
    "CREATE INDEX newest ON observation (location, utc_ns, id)",
    """CREATE TABLE code_read (
    observation TEXT NOT NULL REFERENCES observation (id),
    number INTEGER NOT NULL,
    symbology TEXT NOT NULL,
    text TEXT NOT NULL,
    sure INTEGER NOT NULL,
    agreeing INTEGER NOT NULL,
    quality REAL NOT NULL,
    gs1 TEXT NOT NULL,
    module_px REAL,
    PRIMARY KEY (observation, number)
) STRICT, WITHOUT ROWID""",
    *_LATER,
)
"""Of a new file."""
