"""Real time for tests on a busy machine: what the machine pauses does not count."""

from __future__ import annotations

import asyncio
import math
import selectors
import time
from collections.abc import Coroutine
from typing import Any, TypeVar

from flightd.runtime.event_loops import PacedSelector
from tests.rigs.event_loops import run_in

_T = TypeVar("_T")

_PAUSE_S = 0.02

_HURRY = 2.0
"""How many times as fast as the machine's clock our side of a link and the vehicle live."""


def patient(main: Coroutine[Any, Any, _T]) -> _T:
    """What `main` returns, run by the clock of the machine, on which a library's threads live."""
    return run_in(lambda: PatientLoop(_HURRY), main)


class PatientLoop(asyncio.SelectorEventLoop):
    """Time runs `factor` times as fast as the machine's while this loop does its work, and stands still
    while the machine does another's: no step of it takes longer than its own timer and 20 ms.

    What a test says of rates and delays then holds under any load.  Threads beside the loop see the pauses.
    """

    def __init__(self, factor: float = 1.0) -> None:
        self._factor = factor
        self._now_s = self._real_s = time.monotonic()
        super().__init__(PacedSelector(self._patient_wait))

    def time(self) -> float:
        return self._now_s + self._passed(_PAUSE_S)

    def _passed(self, most_s: float) -> float:
        """Time since the last step, no more than `most_s` of the machine's."""
        return min(time.monotonic() - self._real_s, most_s) * self._factor

    def _step(self, most_s: float) -> None:
        self._now_s += self._passed(most_s)
        self._real_s = time.monotonic()

    def _patient_wait(self, real: selectors.BaseSelector, timeout: float | None) -> list[Any]:
        self._step(_PAUSE_S)
        wait_s = None if timeout is None else timeout / self._factor
        events = real.select(wait_s)
        self._step(math.inf if wait_s is None else wait_s + _PAUSE_S)
        return events
