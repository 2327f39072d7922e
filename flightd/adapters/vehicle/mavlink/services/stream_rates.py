"""Telemetry rates: asked for, measured, asked for again when something changed them."""

from __future__ import annotations

import asyncio
from collections import Counter
from typing import Protocol

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.services.commands import Answer
from flightd.ports import Clock

_CHECK_S = 1.0
_PERIODS = 8
_WINDOW_MIN_NS = 2_000_000_000
_DENIED_PAUSE_NS = 30_000_000_000
_TOO_FEW, _TOO_MANY = 0.6, 1.6


class Sends(Protocol):
    """Whoever can send a command and tell how it was answered."""

    async def send(self, command: int, /, *params: float) -> Answer: ...


class StreamKeeper:
    """Keeps the wanted messages coming, `rates_hz` by message id.

    A ground station on the same link may overwrite rates and a rebooted autopilot forgets them, so
    what arrives is counted and a stream whose rate is off is asked for again.
    """

    def __init__(self, commander: Sends, clock: Clock, rates_hz: dict[int, float]) -> None:
        self._commander = commander
        self._clock = clock
        self._rates_hz = rates_hz
        self._counts: Counter[int] = Counter()
        self._since_ns: dict[int, int] = {}
        self._not_before_ns: dict[int, int] = {}
        self.requests = 0

    def count(self, message_id: int) -> None:
        """One message of that id arrived."""
        self._counts[message_id] += 1

    async def run(self) -> None:
        """Ask for what is missing until cancelled; started when the autopilot is heard."""
        while True:
            for message_id, rate_hz in self._rates_hz.items():
                if self._is_off(message_id, rate_hz, self._clock.now_ns()):
                    await self._ask(message_id, rate_hz)
            await asyncio.sleep(_CHECK_S)

    def _is_off(self, message_id: int, rate_hz: float, now_ns: int) -> bool:
        since_ns = self._since_ns.get(message_id)
        if since_ns is None:
            return True
        if now_ns < self._not_before_ns.get(message_id, 0):
            return False
        elapsed_ns = now_ns - since_ns
        if elapsed_ns < max(_WINDOW_MIN_NS, round(_PERIODS / rate_hz * 1e9)):
            return False
        expected = rate_hz * elapsed_ns * 1e-9
        counted = self._counts.pop(message_id, 0)
        self._since_ns[message_id] = now_ns
        return not _TOO_FEW * expected <= counted <= _TOO_MANY * expected

    async def _ask(self, message_id: int, rate_hz: float) -> None:
        self.requests += 1
        period_us = round(1e6 / rate_hz)
        answer = await self._commander.send(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, period_us)
        now_ns = self._clock.now_ns()
        self._since_ns[message_id] = now_ns
        self._counts.pop(message_id, None)
        if answer.result is not None and not answer.accepted:
            self._not_before_ns[message_id] = now_ns + _DENIED_PAUSE_NS
