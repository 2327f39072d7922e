"""What the doctor finds against a flight on this computer, looked at again while the drone waits."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from flightd.core.errors import TransientError
from flightd.core.refusal import Refusal
from flightd.doctor.check import Check, CheckLevel, FailedChecks
from flightd.runtime.disk_threads import on_disk

PERIOD_S = 10.0
PATIENCE_S = 5.0
"""A disk that takes longer is none to record a flight on."""
_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class CheckHangs(Refusal):
    """The check has begun and does not end."""

    def __str__(self) -> str:
        return "the check of this computer does not end (see whether its disk answers)"


class ComputerCheck:
    """`look` is asked at once, and by `run` again while the drone waits on the ground.  What only deserves a
    look is logged once for as long as it is so."""

    def __init__(self, look: Callable[[], Sequence[Check]]) -> None:
        self._look = look
        self._warned: set[tuple[str, str]] = set()
        self._unfit: Refusal | None = None
        self._take(look())

    @property
    def unfit(self) -> Refusal | None:
        """What was found against a flight when it was looked last; None: nothing."""
        return self._unfit

    async def run(self, waits: Callable[[], bool]) -> None:
        """Look again every PERIOD_S beside the loop, until cancelled; only while it `waits`, and never twice
        at once."""
        while True:
            await asyncio.sleep(PERIOD_S)
            if not waits():
                continue
            looking = asyncio.ensure_future(on_disk(self._look))
            await asyncio.wait([looking], timeout=PATIENCE_S)
            if not looking.done() or isinstance(looking.exception(), TransientError):
                self._unfit = CheckHangs()
            self._take(await looking)

    def _take(self, checks: Sequence[Check]) -> None:
        warned = {(check.name, check.remedy) for check in checks if check.level is CheckLevel.WARNING}
        for check in checks:
            if check.level is CheckLevel.WARNING and (check.name, check.remedy) not in self._warned:
                _LOG.warning("%s: %s; %s", check.name, check.text, check.remedy)
        self._warned = warned
        failed = tuple(check for check in checks if check.level is CheckLevel.ERROR)
        if isinstance(self._unfit, FailedChecks) and _names(failed) == _names(self._unfit.checks):
            return  # a figure that moves is no news
        self._unfit = FailedChecks(failed) if failed else None


def _names(checks: Sequence[Check]) -> list[str]:
    return [check.name for check in checks]
