"""The list of flights: kept up to date while somebody asks for it, read bit by bit, newest first."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeVar

import msgspec

from flightd.core.errors import FlightdError, TransientError
from flightd.ground.flights.flight_row import FlightRow, read_rows, unreadable
from flightd.ground.flights.log_folder import FoundLog, FoundLogs, find_logs
from flightd.ground.read_folders import ReadFolder
from flightd.ground.reading_process import NotStartedError
from flightd.ground.shown_text import shown
from flightd.runtime.within import Within

_LOG = logging.getLogger(__name__)
_FRESH_S = 3.0
"""The folder is looked through again at most this often."""
_AT_ONCE = 12
"""So many logs are read before the list is told anew."""
_WITHIN_S = 60.0

T = TypeVar("T")


class Reader(Protocol):
    """Runs functions outside the loop (`ReadingProcess`)."""

    async def run(self, function: Callable[..., T], within_s: float, *args: Any) -> T: ...


@dataclass(frozen=True, slots=True)
class _Told:
    """What a version of the list says."""

    rows: tuple[FlightRow, ...] = ()
    cut: bool = False
    trouble: str = ""
    looked: bool = False


class FlightIndex:
    """`run` keeps it going; `listing` is what is known now, as JSON."""

    def __init__(self, root: Path, reader: Reader, others: Sequence[ReadFolder] = ()) -> None:
        self._root = root
        self._others = tuple(others)
        self._reader = reader
        self._found: dict[str, FoundLog] = {}
        self._rows: dict[str, tuple[tuple[int, ...], FlightRow]] = {}
        self._cut = False
        self._trouble = ""
        self._unread = 0
        self._looked = False
        self._looked_s = 0.0
        self._looks = 0
        self._version = 0
        self._newest = _Told()
        self._told: tuple[int, msgspec.Raw] = (-1, msgspec.Raw())
        self._asked = asyncio.Event()
        self._changed = asyncio.Condition()

    async def run(self) -> None:
        """Look again whenever somebody asked, until cancelled."""
        while True:
            await self._asked.wait()
            self._asked.clear()
            try:
                await self._look()
                self._trouble = ""
            except FlightdError as err:
                self._trouble = str(err)
            except Exception as err:  # noqa: BLE001 - its end would be the station's
                _LOG.exception("the list of flights failed")
                self._trouble = f"the list of flights failed: {type(err).__name__}: {err}"
            self._looks += 1
            self._looked, self._looked_s = True, asyncio.get_running_loop().time()
            await self._tell()
            await asyncio.sleep(_FRESH_S)

    def listing(self, known: int = -1) -> bytes:
        """JSON: `version`, `rows` (None where the asker knows this version), how many are `unread` yet.

        Asking makes it look again, soon."""
        self._asked.set()
        if known == self._version:
            return msgspec.json.encode({"version": self._version, "unread": self._unread, "rows": None})
        if self._told[0] != self._version:
            self._told = (self._version, msgspec.Raw(msgspec.json.encode(self._newest.rows)))
        return msgspec.json.encode(
            {
                "version": self._version,
                "looked": self._newest.looked,
                "unread": self._unread,
                "cut": self._newest.cut,
                "trouble": self._newest.trouble,
                "rows": self._told[1],
            }
        )

    async def log(self, log_id: str) -> FoundLog | None:
        """The log of that id; None where there is none.  Looks through the folder where it does not know
        it, and again soon where it does."""
        self._asked.set()
        if log_id not in self._found and not self._is_fresh():
            looks = self._looks
            with contextlib.suppress(TimeoutError):
                async with Within(_WITHIN_S), self._changed:
                    await self._changed.wait_for(lambda: log_id in self._found or self._looks > looks)
        return self._found.get(log_id)

    def row(self, log_id: str) -> FlightRow | None:
        """The row of a flight, None while it was not read."""
        return self._rows[log_id][1] if log_id in self._rows else None

    async def _look(self) -> None:
        found: FoundLogs = await self._reader.run(find_logs, _WITHIN_S, self._root, self._others)
        self._found = {log.id: log for log in found.logs}
        self._cut = found.cut
        self._looks += 1
        self._rows = {key: row for key, row in self._rows.items() if key in self._found}
        unread = [log for log in found.logs if self._is_unread(log)]
        self._unread = len(unread)
        await self._tell()
        while unread:
            batch, unread = tuple(unread[:_AT_ONCE]), unread[_AT_ONCE:]
            for log, row in zip(batch, await self._read(batch), strict=True):
                self._rows[log.id] = (log.stamp, row)
            self._unread = len(unread)
            await self._tell()

    def _is_fresh(self) -> bool:
        """The folder was looked through a moment ago."""
        return self._looked and asyncio.get_running_loop().time() - self._looked_s < _FRESH_S

    async def _read(self, logs: tuple[FoundLog, ...]) -> tuple[FlightRow, ...]:
        """A row for each; where they cannot be read together, one by one, so that a log that costs the
        reader its life costs no other its row."""
        try:
            return await self._reader.run(read_rows, _WITHIN_S, logs)
        except NotStartedError:
            raise  # no log's fault
        except TransientError as err:
            if len(logs) == 1:
                return (unreadable(logs[0], err.what),)
        return tuple([row for log in logs for row in await self._read((log,))])

    def _is_unread(self, log: FoundLog) -> bool:
        known = self._rows.get(log.id)
        return known is None or known[0] != log.stamp or known[1].running

    async def _tell(self) -> None:
        """A version of its own for what is new; who waits for a log looks in any case."""
        rows = tuple(self._rows[log_id][1] for log_id in self._found if log_id in self._rows)
        newest = _Told(rows, self._cut, shown(self._trouble), self._looked)
        if newest != self._newest:
            self._newest = newest
            self._version += 1
        async with self._changed:
            self._changed.notify_all()
