"""Expected stock that was dropped, into the book from which the station compares."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from flightd.core.errors import InputError
from flightd.ground.drop import Drop
from flightd.ground.expected_stock_book import ExpectedStock, ExpectedStockBook
from flightd.ground.read_folders import read_folders
from flightd.ground.stores import Stores
from flightd.ground.wms_exchange.exchange_file import ExpectedSection, StockNames
from flightd.ground.wms_exchange.heading import column
from flightd.ground.wms_exchange.inbox import Judged
from flightd.inventory.stock_columns import StockColumns
from flightd.inventory.stock_table import StockTable, read_table
from flightd.inventory.uploaded_stock import UploadedStock, uploaded_stock

_SHOWN = 3
_MOST_NAME = 200


class StockTaker:
    """A `Taker` of stock for `who`, as `asked` says."""

    def __init__(self, asked: ExpectedSection, who: str, file: Path, utc_ns: Callable[[], int]) -> None:
        """InputError where the station's folder has not the inventory; `file` is where that is said."""
        self._asked = asked
        self._who = who
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

    def dropped(self, inbox: str) -> Drop | None:
        return self._book.dropped(inbox)

    def moved(self, inbox: str) -> None:
        self._book.moved(inbox)

    def judged(self, name: str, data: bytes) -> Judged:
        table = read_table(data)
        columns = _columns(table, self._asked.columns)
        said = self._said(uploaded_stock(table, columns))

        def keep(drop: Drop) -> None:
            now = self._utc_ns()
            upload = ExpectedStock(name[:_MOST_NAME], self._who, now, now, columns)
            self._book.keep(self._asked.inventory, upload, data, drop)

        return Judged(said, keep)

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
    """By the names in the first row."""
    place = column(table, names.place, "expected.columns.place")
    code = column(table, names.code, "expected.columns.code")
    quantity = None if names.quantity is None else column(table, names.quantity, "expected.columns.quantity")
    return StockColumns(place, code, quantity).checked(table)


def _shown(lines: Sequence[str]) -> str:
    more = f" and {len(lines) - _SHOWN} more" if len(lines) > _SHOWN else ""
    return ", ".join(lines[:_SHOWN]) + more
