"""What is not critical restarts, and what fails in a tick ends no flight; this is the one place that decides
so."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from typing import TypeVar

from flightd.core.errors import FlightdError, TransientError

_T = TypeVar("_T")
_LOG = logging.getLogger(__name__)

_FIRST_WAIT_S = 0.1
_LONGEST_WAIT_S = 5.0
_BEGIN_ANEW_S = 1.0


async def restarted(part: Callable[[], Awaitable[None]], failed: Callable[[TransientError], None]) -> None:
    """Run `part` for ever: each TransientError, and each error that nobody foresaw, is told to `failed` and
    followed by a new start, after a wait that doubles up to 5 s.  Every other FlightdError is the
    caller's."""
    wait_s = _FIRST_WAIT_S
    loop = asyncio.get_running_loop()
    while True:
        started_s = loop.time()
        try:
            await part()
        except TransientError as err:
            failed(err)
        except FlightdError:
            raise
        except Exception as err:  # noqa: BLE001 - what is not critical ends no flight
            _LOG.exception("a part of the daemon failed and is started again")
            failed(TransientError(f"{type(err).__name__}: {err}"))
        if loop.time() - started_s > 2 * _LONGEST_WAIT_S:
            wait_s = _FIRST_WAIT_S
        await asyncio.sleep(wait_s)
        wait_s = min(2 * wait_s, _LONGEST_WAIT_S)


async def insisted(work: Callable[[], Awaitable[None]]) -> None:
    """Do `work` until it ends by itself: what it raises is logged, and it begins anew after a second."""
    while True:
        try:
            await work()
        except Exception:  # noqa: BLE001 - no flight ends for it
            _LOG.exception("what runs beside a link failed and begins anew")
            await asyncio.sleep(_BEGIN_ANEW_S)
        else:
            return


class FaultBarrier:
    """Between the control tick and what it calls: an error there costs that part its turn, never the flight.
    `failed` is told the part and its error, once for each kind of error."""

    def __init__(self, failed: Callable[[str, Exception], None]) -> None:
        self._failed = failed
        self._told: set[tuple[str, type[Exception]]] = set()

    def call(self, part: str, act: Callable[[], _T], otherwise: _T) -> _T:
        """What `act` returns, or `otherwise` where it raises."""
        try:
            return act()
        except Exception as err:  # noqa: BLE001 - a flight goes on whatever else fails
            kind = part, type(err)
            if kind not in self._told:
                self._told.add(kind)  # before it is told: that may fail, too
                self._failed(part, err)
            return otherwise
