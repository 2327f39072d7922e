"""The flights below a folder, as the station answers for them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from flightd.core.errors import InputError, RunError
from flightd.ground.bounded import Threads
from flightd.ground.flights.flight_index import FlightIndex
from flightd.ground.flights.flight_row import FlightRow
from flightd.ground.flights.flight_view import (
    FlightView,
    read_framed_picture,
    read_report,
    read_thumbnail,
    read_view,
)
from flightd.ground.flights.log_folder import FoundLog
from flightd.ground.flights.sized_cache import SizedCache
from flightd.ground.read_folders import ReadFolder
from flightd.ground.reading_process import ReadingProcess
from flightd.replay.playback.pictures import PicturePlace

_WITHIN_S = 180.0
_PLOTS_AT_ONCE, _MOST_PLOTS = 2, 32
_VIEWS_BYTES = 96 << 20
_REPORTS_BYTES = 48 << 20
_THUMBNAILS_BYTES = 8 << 20

_NEWEST_KEPT = 64
_SAME_START_S = 5.0
"""A log that does not say when it began is taken to have begun by when it was written."""

_Key = tuple[str, tuple[int, ...]]


@dataclass(frozen=True, slots=True)
class FlightPicture:
    """A picture as the page takes it, empty for who has it.  `stays`: its address holds no other, ever."""

    tag: str
    stays: bool
    content: bytes = b""


@dataclass(frozen=True, slots=True)
class _Seen:
    """A view, and the stamp of the log of which it was made."""

    stamp: str
    view: FlightView


@dataclass(frozen=True, slots=True)
class _Newest:
    key: _Key
    stamp: str
    started_s: float


class Flights:
    """`run` serves the list until cancelled, and ends the reading processes.  Errors as `ReadingProcess`
    raises them, InputError for a flight or a picture that there is not."""

    def __init__(
        self,
        root: Path | None,
        reading: Callable[[], ReadingProcess] = ReadingProcess,
        others: Sequence[ReadFolder] = (),
    ) -> None:
        self._listing, self._playing = reading(), reading()
        self.index = FlightIndex(root, self._listing, others) if root is not None else None
        self._plotting = Threads(_PLOTS_AT_ONCE, _MOST_PLOTS, "too many plots wait already")
        self._viewing = asyncio.Lock()
        self._views: SizedCache[_Key, FlightView] = SizedCache(_VIEWS_BYTES)
        self._newest: dict[str, _Newest] = {}
        self._reports: SizedCache[_Key, bytes] = SizedCache(_REPORTS_BYTES)
        self._thumbnails: SizedCache[_Key, bytes] = SizedCache(_THUMBNAILS_BYTES)

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
        """All but the curves of a flight, its stamp, and its row in the list where that was read."""
        log = await self._log(log_id)
        seen = await self._view(log)
        document = {"row": self._row(log), "stamp": seen.stamp, "flight": msgspec.Raw(seen.view.head)}
        return msgspec.json.encode(document)

    async def series(self, log_id: str, from_s: float, to_s: float, stretches: int) -> bytes:
        """Its curves between two times (`FlightView.series`)."""
        log = await self._log(log_id)
        seen = self._recorded(log) or await self._view(log)
        return await self._plotting.run(seen.view.series, from_s, to_s, stretches)

    async def picture(self, log_id: str, place: int, stamp: str = "", known: str = "") -> FlightPicture:
        """Its picture of that place in the flight, as the page takes it; without its content for who knows
        its tag.  RunError where the asker means the flight of another `stamp` ("": any)."""
        log = await self._log(log_id)
        recorded = self._recorded(log)
        seen = recorded or await self._view(log)
        if stamp not in {"", seen.stamp} and recorded is None:
            raise RunError("the flight was written anew; open it again")
        if not 0 <= place < len(seen.view.pictures):
            raise InputError("the flight has no such picture")
        tag = f'"{seen.stamp}-{place}"'
        if known == tag:
            return FlightPicture(tag, stays=stamp == seen.stamp)
        wanted, lens = seen.view.pictures[place], seen.view.lens
        content = await self._playing.run(
            read_framed_picture, _WITHIN_S, log.root, log.relative, wanted, lens
        )
        return FlightPicture(tag, stays=stamp == seen.stamp, content=content)

    async def thumbnail(self, log_id: str) -> bytes:
        """A small picture for the list; empty where the log holds none."""
        return await self._made(log_id, self._thumbnails, read_thumbnail)

    async def where(self, log_id: str) -> tuple[Path, str]:
        """The folder in which a flight lies, and its log below it."""
        log = await self._log(log_id)
        return log.root, log.relative

    def site_of(self, log_id: str) -> str:
        """The site of a flight in the list; "" where that is not known."""
        row = self.index.row(log_id) if self.index is not None else None
        return "" if row is None else row.site

    async def whereabouts(self, log_id: str, place: int) -> tuple[Path, str, PicturePlace]:
        """Where a picture of a flight lies: folder, log, place in the log."""
        log = await self._log(log_id)
        seen = self._recorded(log) or await self._view(log)
        if not 0 <= place < len(seen.view.pictures):
            raise InputError("the flight has no such picture")
        return log.root, log.relative, seen.view.pictures[place]

    async def report(self, log_id: str) -> bytes:
        """Its HTML report."""
        return await self._made(log_id, self._reports, read_report)

    async def _made(
        self, log_id: str, kept: SizedCache[_Key, bytes], read: Callable[[Path, str], bytes]
    ) -> bytes:
        """What is made of a log as it is now, and kept."""
        log = await self._log(log_id)
        key = (log.id, log.stamp)
        made = kept.get(key)
        if made is None:
            made = await self._listing.run(read, _WITHIN_S, log.root, log.relative)
            kept.put(key, made, len(made) + 1)  # one that is empty takes room, too
        return made

    async def _view(self, log: FoundLog) -> _Seen:
        key = (log.id, log.stamp)
        if (view := self._views.get(key)) is None:
            async with self._viewing:  # whoever waits for the same flight finds it then
                if (view := self._views.get(key)) is None:
                    row = self._row(log)
                    view = await self._playing.run(read_view, _WITHIN_S, log.root, log.relative)
                    self._views.put(key, view, view.size)
                    if row is not None:
                        self._newest[log.id] = _Newest(key, log.mark, row.started_s)
                        while len(self._newest) > _NEWEST_KEPT:
                            self._newest.pop(next(iter(self._newest)))
        return _Seen(log.mark, view)

    def _recorded(self, log: FoundLog) -> _Seen | None:
        """What was seen last of a log that is being recorded: it changes all the time, and to read all of it
        for each curve and picture takes longer than that.  None where that was another flight."""
        row, newest = self._row(log), self._newest.get(log.id)
        if row is None or newest is None or not row.running:
            return None
        if abs(newest.started_s - row.started_s) > _SAME_START_S:
            return None
        view = self._views.get(newest.key)
        return None if view is None else _Seen(newest.stamp, view)

    def _row(self, log: FoundLog) -> FlightRow | None:
        return self.index.row(log.id) if self.index is not None else None

    async def _log(self, log_id: str) -> FoundLog:
        log = await self.index.log(log_id) if self.index is not None else None
        if log is None:
            raise InputError("there is no such flight")
        return log
