"""Setpoints on the wire at their own rate, whatever the rest of the daemon does."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable

from flightd.core.types import AttitudeSetpoint
from flightd.ports import Clock, Vehicle
from flightd.runtime.bounded_series import Series
from flightd.runtime.within import Within

_FAILS_S = 0.3
"""An adapter that fails at each setpoint for so long is given up."""
_LOG = logging.getLogger(__name__)


class SetpointPump:
    """Sends each new setpoint at once and repeats the last one when none comes for `period_s`.

    A setpoint older than `stale_s` is not repeated: the loop that made it is dead, so level and hold
    go out instead (counted in `stale`).  With `set(None)` nothing goes out.  `on_sent` is told of each
    fresh setpoint and the time it was on the wire.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        clock: Clock,
        on_sent: Callable[[AttitudeSetpoint, int], None],
        period_s: float = 0.02,
        stale_s: float = 0.15,
    ) -> None:
        self._vehicle = vehicle
        self._clock = clock
        self._on_sent = on_sent
        self._period_s = period_s
        self._stale_ns = round(stale_s * 1e9)
        self._setpoint: AttitudeSetpoint | None = None
        self._fresh = asyncio.Event()
        self._last_ns: int | None = None
        self.stale = 0
        self._failures = 0
        self.failed = 0
        """Setpoints at which the adapter failed."""
        self.intervals_ms = Series()

    def set(self, setpoint: AttitudeSetpoint | None) -> None:
        """The setpoint to send from now on."""
        self._setpoint = setpoint
        if setpoint is None:
            self._last_ns = None
        else:
            self._fresh.set()

    def interval_quantiles_ms(self) -> dict[str, float]:
        """Between setpoints on the wire: p50, p99 and the longest."""
        shares = (("p50", 0.5), ("p99", 0.99), ("max", 1.0))
        return {name: round(self.intervals_ms.quantile(share), 2) for name, share in shares}

    async def run(self) -> None:
        while True:
            fresh = True
            try:
                # a little more than the period, so that a steady maker of setpoints sets the pace
                async with Within(self._period_s * 1.2):
                    await self._fresh.wait()
            except TimeoutError:
                fresh = False
            self._fresh.clear()
            if self._setpoint is not None:
                self._send(self._setpoint, fresh)

    def _send(self, setpoint: AttitudeSetpoint, fresh: bool) -> None:
        now_ns = self._clock.now_ns()
        if now_ns - setpoint.stamp_ns > self._stale_ns:
            setpoint = AttitudeSetpoint(now_ns)
            self.stale += 1
            fresh = False
        if not self._sent(setpoint):
            self._last_ns = None
            return
        if self._last_ns is not None:
            self.intervals_ms.add((now_ns - self._last_ns) * 1e-6)
        self._last_ns = now_ns
        if fresh:
            self._on_sent(setpoint, now_ns)

    def _sent(self, setpoint: AttitudeSetpoint) -> bool:
        """Whether it is on the wire.  What an adapter fails at with one setpoint is tried with the next; one
        that goes on failing ends the daemon, which hands the vehicle back to land: else heartbeats would
        go on, and nobody would know that it is not steered."""
        try:
            sent = self._vehicle.send(setpoint)
        except Exception:
            self.failed += 1
            self._failures += 1
            if self._failures * self._period_s > _FAILS_S:
                raise
            _LOG.exception("a setpoint was not sent")
            return False
        self._failures = 0
        return sent
