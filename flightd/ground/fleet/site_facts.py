"""What the ground store and the books know of a site's places: by that a fleet's work has its value."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from flightd.core.errors import InputError, UnavailableError
from flightd.core.inventory import LocationRecord, LocationState, Observation
from flightd.core.types import CodeRead
from flightd.fleet.traffic.valued_work import PlaceFacts
from flightd.ground.expected_stock_book import ExpectedStockBook
from flightd.ground.ground_store.store import GroundStore
from flightd.ground.read_folders import ReadFolder
from flightd.ground.reading_process import ReadingProcess
from flightd.ground.site_stock import site_stock
from flightd.ground.stores import Stores
from flightd.inventory.comparison import ComparisonOutcome, compare_stock
from flightd.inventory.stock_columns import StockColumns
from flightd.inventory.stock_table import read_table
from flightd.inventory.uploaded_stock import uploaded_stock

_COMPARE_S: Final = 60.0
_CALM: Final = frozenset({ComparisonOutcome.MATCH, ComparisonOutcome.UNCOUNTED})


class SiteFacts:
    """By the `store`, and the newest expected stock that is kept in `folder` for an inventory of the site;
    that is read in `reading`."""

    def __init__(
        self,
        store: GroundStore | None,
        folder: Path | None,
        others: Sequence[ReadFolder],
        reading: ReadingProcess,
        utc_ns: Callable[[], int],
    ) -> None:
        self._store = store
        self._book = None if folder is None else ExpectedStockBook(folder)
        self._inventories = Stores(folder, others)
        self._reading = reading
        self._utc_ns = utc_ns

    async def of(self, site: str) -> tuple[PlaceFacts, ...]:
        """Every place that is known.  InputError where there is no store, or for books that cannot be
        read."""
        if self._store is None:
            raise InputError(
                "how old counts are is in the ground store, and there is none", remedy="give --store FILE"
            )
        rows, asked = await asyncio.to_thread(_known, self._store, site)
        books = await asyncio.to_thread(self._books, site)
        wrong: frozenset[str] = frozenset()
        if books is not None:
            wrong = await self._reading.run(contradicted_places, _COMPARE_S, rows, *books)
        return tuple(self._facts(row, row["location"] in wrong, row["location"] in asked) for row in rows)

    def _books(self, site: str) -> tuple[bytes, StockColumns] | None:
        if self._book is None:
            return None
        for inventory in self._book.inventories():
            upload, data = self._book.kept(inventory), self._book.data(inventory)
            if upload is not None and data is not None and self._is_of(inventory, site):
                return data, upload.columns
        return None

    def _is_of(self, inventory: str, site: str) -> bool:
        try:
            return self._inventories.site_name(inventory) == site
        except (InputError, UnavailableError):
            return False  # it was put away since, or cannot be read now

    def _facts(self, row: Mapping[str, Any], contradicted: bool, asked: bool) -> PlaceFacts:
        ns = row["utc_ns"] if LocationState(row["state"]).is_counted else None
        age_s = None if ns is None else max(self._utc_ns() - ns, 0) / 1e9
        return PlaceFacts(row["node"], age_s, contradicted, asked)


def _known(store: GroundStore, site: str) -> tuple[list[dict[str, Any]], frozenset[str]]:
    """Every place, and those of which a question is open."""
    rows = list(site_stock(store, site))
    return rows, store.open_places(site) if rows else frozenset()


def contradicted_places(
    rows: Sequence[Mapping[str, Any]], data: bytes, columns: StockColumns
) -> frozenset[str]:
    """The places at which a count, as `GroundStore.stock` has it, is not what the uploaded table says, both
    ends of a moved code among them.  InputError for what is no table."""
    expected = uploaded_stock(read_table(data), columns).expected
    lines = compare_stock([_record(row) for row in rows], expected)
    wrong = [line for line in lines if line.outcome not in _CALM]
    return frozenset(place for line in wrong for place in (line.location, line.found_at) if place)


def _record(row: Mapping[str, Any]) -> LocationRecord:
    state = LocationState(row["state"])
    if row["utc_ns"] is None or state is LocationState.NOT_VISITED:
        return LocationRecord(row["location"], row["node"], None)
    reads = tuple(CodeRead("", text, (), True, 1, 1.0) for text in row["texts"])
    seen = Observation(
        row["run"] or "", row["location"], row["utc_ns"], state, row["confidence"] or 0.0, reads
    )
    return LocationRecord(row["location"], row["node"], seen)
