"""The flights below a folder, as the station answers for them."""

from __future__ import annotations

import asyncio
from pathlib import Path

import msgspec

from flightd.core.errors import InputError
from flightd.ground.bounded import Threads
from flightd.ground.flights.flight_index import FlightIndex
from flightd.ground.flights.flight_view import FlightView, read_framed_picture, read_report, read_view
from flightd.ground.flights.log_folder import FoundLog
from flightd.ground.flights.sized_cache import SizedCache
from flightd.ground.reading_process import ReadingProcess

_WITHIN_S = 180.0
_PLOTS_AT_ONCE, _MOST_PLOTS = 2, 32
_VIEWS_BYTES = 96 << 20
_REPORTS_BYTES = 48 << 20

_Key = tuple[str, tuple[int, ...]]


class Flights:
    """`run` serves the list until cancelled, and ends the reading processes.  Errors as `ReadingProcess`
    raises them, InputError for a flight or a picture that there is not."""

    def __init__(self, root: Path | None) -> None:
        self.root = root
        self._listing, self._playing = ReadingProcess(), ReadingProcess()
        self.index = FlightIndex(root, self._listing) if root is not None else None
        self._plotting = Threads(_PLOTS_AT_ONCE, _MOST_PLOTS, "too many plots wait already")
        self._viewing = asyncio.Lock()
        self._views: SizedCache[_Key, FlightView] = SizedCache(_VIEWS_BYTES)
        self._reports: SizedCache[_Key, bytes] = SizedCache(_REPORTS_BYTES)

    async def run(self) -> None:
        try:
            if self.index is not None:
                await self.index.run()
            else:
                await asyncio.Event().wait()
        finally:
            self._listing.close()
            self._playing.close()

    async def head(self, log_id: str) -> bytes:
        """All but the curves of a flight, and its row in the list where that was read."""
        log, view = await self._view(log_id)
        row = self.index.row(log.id) if self.index is not None else None
        return msgspec.json.encode({"row": row, "flight": msgspec.Raw(view.head)})

    async def series(self, log_id: str, from_s: float, to_s: float, stretches: int) -> bytes:
        """Its curves between two times (`FlightView.series`)."""
        _, view = await self._view(log_id)
        return await self._plotting.run(view.series, from_s, to_s, stretches)

    async def picture(self, log_id: str, place: int) -> bytes:
        """Its picture of that place in the flight, as the page takes it."""
        log, view = await self._view(log_id)
        if not 0 <= place < len(view.pictures):
            raise InputError("the flight has no such picture")
        root, wanted = self._root(), view.pictures[place]
        return await self._playing.run(read_framed_picture, _WITHIN_S, root, log.relative, wanted, view.lens)

    async def report(self, log_id: str) -> bytes:
        """Its HTML report."""
        log = await self._log(log_id)
        key = (log.id, log.stamp)
        page = self._reports.get(key)
        if page is None:
            page = await self._listing.run(read_report, _WITHIN_S, self._root(), log.relative)
            self._reports.put(key, page, len(page))
        return page

    async def _view(self, log_id: str) -> tuple[FoundLog, FlightView]:
        log = await self._log(log_id)
        key = (log.id, log.stamp)
        if (view := self._views.get(key)) is None:
            async with self._viewing:  # whoever waits for the same flight finds it then
                if (view := self._views.get(key)) is None:
                    view = await self._playing.run(read_view, _WITHIN_S, self._root(), log.relative)
                    self._views.put(key, view, view.size)
        return log, view

    async def _log(self, log_id: str) -> FoundLog:
        log = await self.index.log(log_id) if self.index is not None else None
        if log is None:
            raise InputError("there is no such flight")
        return log

    def _root(self) -> Path:
        if self.root is None:
            raise InputError("there is no folder of flights")
        return self.root
