"""Expected stock out of a drop folder, into the book from which the station compares.

A file is claimed by moving it to `taking/`, so that one of the same name that comes meanwhile is another;
it ends in `done/` or `refused/`, with a line about it beside it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path, PurePosixPath

from flightd.core.errors import InputError
from flightd.ground.expected_stock_book import Drop, ExpectedStock, ExpectedStockBook
from flightd.ground.read_folders import read_folders
from flightd.ground.shared_folder import SharedFolder, Stamp
from flightd.ground.stores import Stores
from flightd.ground.wms_exchange.exchange_file import ExpectedSection, StockNames
from flightd.inventory.stock_columns import StockColumns
from flightd.inventory.stock_table import MOST_BYTES, StockTable, read_table
from flightd.inventory.uploaded_stock import UploadedStock, uploaded_stock

_TAKING, _DONE, _REFUSED = "taking", "done", "refused"
_SHOWN = 3
_MOST_NAME = 200


@dataclass(frozen=True, slots=True)
class TakenFile:
    """What became of a file, in a line for whoever dropped it."""

    name: str
    taken: bool
    said: str


class Inbox:
    """Takes the files of `folder` for `who`, as `asked` says."""

    def __init__(
        self, folder: SharedFolder, asked: ExpectedSection, who: str, file: Path, utc_ns: Callable[[], int]
    ) -> None:
        """InputError where the station's folder has not the inventory; `file` is where that is said."""
        self._folder = folder
        self._asked = asked
        self._who = who
        self._id = f"{asked.inbox}/{asked.pattern}"
        self._utc_ns = utc_ns
        stores = Stores(asked.folder, read_folders(asked.flights))
        try:
            records = stores.view(asked.inventory).records
        except InputError as err:
            there = _shown([name for name, _ in stores.names()])
            raise InputError(
                f"{asked.folder}: {err.what}",
                file=file,
                key="expected.inventory",
                remedy=f"choose among {there}" if there else "is it the station's folder?",
            ) from None
        self._places = {record.code.casefold() for record in records}
        self._book = ExpectedStockBook(asked.folder)

    def take(self, sleep: Callable[[float], None]) -> Iterator[TakenFile]:
        """What was begun before, then what is new, oldest first; what is written still stays."""
        for name in sorted(self._listed(_TAKING)):
            yield self._finish(name)
        self._book.moved(self._id)
        before = self._listed()
        if not before:
            return
        sleep(self._asked.settle_s)
        whole = {name: stamp for name, stamp in self._listed().items() if before.get(name) == stamp}
        for name in sorted(whole, key=lambda name: (whole[name][1], name)):
            self._folder.move(name, f"{_TAKING}/{name}")
            yield self._finish(name)

    def _listed(self, below: str = "") -> dict[str, Stamp]:
        pattern = self._asked.pattern.casefold()
        return {
            name: stamp
            for name, stamp in self._folder.listed(below).items()
            if fnmatchcase(name.casefold(), pattern)
        }

    def _finish(self, name: str) -> TakenFile:
        """A claimed file, wherever it was cut before."""
        data = self._folder.read(f"{_TAKING}/{name}", MOST_BYTES + 1)
        digest = hashlib.sha256(data).hexdigest()
        known = self._book.dropped(self._id)
        if known is not None and (known.name, known.sha256) == (name, digest):
            taken = TakenFile(name, True, known.said)
        else:
            taken = self._judged(name, data, digest)
        path = PurePosixPath(name)
        to = f"{_DONE if taken.taken else _REFUSED}/{path.stem}-{digest[:8]}{path.suffix}"
        self._folder.write(f"{to}.txt", f"{taken.said}\n".encode())
        self._folder.move(f"{_TAKING}/{name}", to)
        return taken

    def _judged(self, name: str, data: bytes, digest: str) -> TakenFile:
        """Keep it, if it is of use."""
        try:
            table = read_table(data)
            columns = _columns(table, self._asked.columns)
            said = self._said(uploaded_stock(table, columns))
        except InputError as err:
            return TakenFile(name, False, str(err))
        now = self._utc_ns()
        upload = ExpectedStock(name[:_MOST_NAME], self._who, now, now, columns)
        drop = Drop(self._id, name, digest, said)
        self._book.keep(self._asked.inventory, upload, data, drop)
        return TakenFile(name, True, said)

    def _said(self, stock: UploadedStock) -> str:
        if not stock.expected:
            first = stock.problems[0] if stock.problems else "it has none but the heading"
            raise InputError(f"no row can be used: {first}", remedy="correct the file, and drop it again")
        unknown = [place for place in stock.expected if place.casefold() not in self._places]
        if self._places and len(unknown) == len(stock.expected):
            raise InputError(
                f"the inventory knows none of its places, of which the first is {unknown[0]}",
                remedy="correct expected.columns.place, or drop the stock of this site",
            )
        parts = [f"{stock.rows} rows"]
        if stock.problems:
            parts.append(f"{len(stock.problems)} left out: {_shown(stock.problems)}")
        if unknown:
            parts.append(f"{len(unknown)} places that the inventory does not know: {_shown(unknown)}")
        return "; ".join(parts)


def _columns(table: StockTable, names: StockNames) -> StockColumns:
    """By the names in the first row.  InputError where one is not there, or is there twice."""
    heading = [cell.casefold() for cell in table.rows[0]]

    def column(key: str, name: str) -> int:
        found = heading.count(name.strip().casefold())
        if found != 1:
            there = f"has {found} columns" if found else "has no column"
            raise InputError(
                f"the first line {there} {name!r} (it says {', '.join(table.rows[0])})",
                remedy=f"correct expected.columns.{key}, or the file",
            )
        return heading.index(name.strip().casefold())

    quantity = None if names.quantity is None else column("quantity", names.quantity)
    return StockColumns(column("place", names.place), column("code", names.code), quantity).checked(table)


def _shown(lines: Sequence[str]) -> str:
    more = f" and {len(lines) - _SHOWN} more" if len(lines) > _SHOWN else ""
    return ", ".join(lines[:_SHOWN]) + more
