"""A telemetry radio between autopilot and companion: late, jittery, lossy, out of order."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RadioParams:
    """One direction.  A datagram is lost with probability `loss`, else it arrives after `delay_s` plus an
    exponential `jitter_s` (so later ones overtake it, unless it is a line that keeps them `in_order`), and
    twice with probability `doubled`."""

    loss: float = 0.0
    delay_s: float = 0.0
    jitter_s: float = 0.0
    doubled: float = 0.0
    in_order: bool = False

    def __post_init__(self) -> None:
        if not (0.0 <= self.loss <= 1.0 and 0.0 <= self.doubled <= 1.0):
            raise ValueError(f"probabilities outside 0..1: {self}")
        if self.delay_s < 0.0 or self.jitter_s < 0.0:
            raise ValueError(f"a radio cannot deliver before it was sent: {self}")


PERFECT = RadioParams()
"""Nothing is lost, nothing is late."""


class Radio:
    """Carries calls instead of bytes: `carry(deliver)` calls it when, and as often as, it arrives."""

    def __init__(self, params: RadioParams, seed: int) -> None:
        self.params = params
        self._rng = random.Random(seed)
        self._newest_s = 0.0

    def carry(self, deliver: Callable[[], None]) -> None:
        p, rng = self.params, self._rng
        if p == PERFECT:
            deliver()
            return
        if rng.random() < p.loss:
            return
        for _ in range(2 if rng.random() < p.doubled else 1):
            loop = asyncio.get_running_loop()
            due_s = loop.time() + p.delay_s + (rng.expovariate(1.0 / p.jitter_s) if p.jitter_s else 0.0)
            if p.in_order:
                due_s = max(due_s, self._newest_s)
            self._newest_s = due_s
            loop.call_at(due_s, deliver)
