"""Expected stock that people uploaded, the newest of each store: kept in the station's own file until it is
removed or replaced, or newer uploads need its room."""

from __future__ import annotations

import sqlite3
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flightd.ground.decision_book import station_file
from flightd.ground.drop import Drop
from flightd.inventory.stock_columns import StockColumns

MOST_UPLOADS = 20
MOST_BYTES = 64_000_000
"""All uploads together; the oldest go first."""
_TABLE = """CREATE TABLE IF NOT EXISTS expected_stock (
    store TEXT PRIMARY KEY,
    name TEXT NOT NULL,
    who TEXT NOT NULL,
    utc_ns INTEGER NOT NULL,
    changed_ns INTEGER NOT NULL,
    place INTEGER NOT NULL,
    code INTEGER NOT NULL,
    quantity INTEGER,
    heading INTEGER NOT NULL,
    data BLOB NOT NULL
) STRICT"""
"""Made with the first upload: files from before it are kept as they are."""
_DROP_TABLE = """CREATE TABLE IF NOT EXISTS expected_stock_drop (
    inbox TEXT PRIMARY KEY,
    name TEXT NOT NULL,
    sha256 TEXT NOT NULL,
    said TEXT NOT NULL
) STRICT"""
_ONE = """SELECT name, who, utc_ns, changed_ns, place, code, quantity, heading FROM expected_stock
WHERE store = ?"""


@dataclass(frozen=True, slots=True)
class ExpectedStock:
    """An upload without its content: the file's `name`, who sent it at `utc_ns`, which of its `columns` is
    what; `changed_ns` (UTC) is another whenever content or columns are."""

    name: str
    who: str
    utc_ns: int
    changed_ns: int
    columns: StockColumns


class ExpectedStockBook:
    """In the station's file in `folder`.  Safe from any thread; errors as of `OwnDatabase`."""

    def __init__(self, folder: Path) -> None:
        self._database = station_file(folder)

    def keep(self, store: str, upload: ExpectedStock, data: bytes, drop: Drop | None = None) -> None:
        """Keep an upload in place of the store's one before; the oldest of other stores make room for it.
        That it came by a `drop` is noted in the same transaction, until `moved`."""
        columns = upload.columns
        with self._database.changed() as book:
            book.execute(_TABLE)
            book.execute(
                "INSERT OR REPLACE INTO expected_stock VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                (
                    store, upload.name, upload.who, upload.utc_ns, upload.changed_ns, columns.place,
                    columns.code, columns.quantity, columns.heading, data,
                ),
            )  # fmt: skip
            _make_room(book)
            if drop is not None:
                book.execute(_DROP_TABLE)
                row = (drop.inbox, drop.name, drop.sha256, drop.said)
                book.execute("INSERT OR REPLACE INTO expected_stock_drop VALUES (?, ?, ?, ?)", row)

    def dropped(self, inbox: str) -> Drop | None:
        """What is noted of a file that may lie in the inbox still."""
        question = "SELECT inbox, name, sha256, said FROM expected_stock_drop WHERE inbox = ?"
        row = self._read("expected_stock_drop", question, inbox)
        return None if row is None else Drop(*row)

    def moved(self, inbox: str) -> None:
        """That file lies there no more: one of the same name and content is another from now on."""
        if self.dropped(inbox) is not None:
            with self._database.changed() as book:
                book.execute("DELETE FROM expected_stock_drop WHERE inbox = ?", (inbox,))

    def choose(self, store: str, columns: StockColumns, changed_ns: int) -> None:
        """The store's upload has other columns from now on; nothing where there is none any more."""
        with self._database.changed() as book:
            book.execute(_TABLE)
            book.execute(
                "UPDATE expected_stock SET place = ?, code = ?, quantity = ?, heading = ?, changed_ns = ? "
                "WHERE store = ?",
                (columns.place, columns.code, columns.quantity, columns.heading, changed_ns, store),
            )

    def remove(self, store: str) -> None:
        """Forget the store's upload, if there is one."""
        with self._database.changed() as book:
            book.execute(_TABLE)
            book.execute("DELETE FROM expected_stock WHERE store = ?", (store,))

    def kept(self, store: str) -> ExpectedStock | None:
        """The store's upload, None where there is none."""
        row = self._read("expected_stock", _ONE, store)
        if row is None:
            return None
        name, who, utc_ns, changed_ns, place, code, quantity, heading = row
        return ExpectedStock(
            name, who, utc_ns, changed_ns, StockColumns(place, code, quantity, heading=bool(heading))
        )

    def inventories(self) -> tuple[str, ...]:
        """The stores of which an upload is kept, that of the newest first."""
        if self._read("expected_stock", "SELECT 1 FROM expected_stock") is None:
            return ()
        with self._database.opened() as book:
            found = book.execute("SELECT store FROM expected_stock ORDER BY utc_ns DESC, store").fetchall()
        return tuple(store for (store,) in found)

    def data(self, store: str) -> bytes | None:
        """What was uploaded, byte by byte; None where nothing is kept any more."""
        row = self._read("expected_stock", "SELECT data FROM expected_stock WHERE store = ?", store)
        return None if row is None else bytes(row[0])

    def _read(self, table: str, question: str, *values: str) -> tuple[Any, ...] | None:
        if not self._database.is_there:
            return None
        with self._database.opened() as book:
            if not book.execute("SELECT 1 FROM sqlite_schema WHERE name = ?", (table,)).fetchone():
                return None
            row: tuple[Any, ...] | None = book.execute(question, values).fetchone()
            return row


def _make_room(book: sqlite3.Connection) -> None:
    newest_first = "SELECT store, length(data) FROM expected_stock ORDER BY utc_ns DESC, rowid DESC"
    count = size = 0
    for store, length in book.execute(newest_first).fetchall():
        count, size = count + 1, size + length
        if count > MOST_UPLOADS or size > MOST_BYTES:
            book.execute("DELETE FROM expected_stock WHERE store = ?", (store,))
