"""Somebody beside the pad who puts a fresh battery into a drone that has come back for one."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable

from flightd.ports import Clock
from flightd.sim.plant.airframe import Airframe
from flightd.site.site import Site

_LOOKS_S = 0.5
_REACH_M = 0.5
_WORTH_FRAC = 0.9
"""A fuller battery is left where it is."""


class BatterySwapper:
    """Changes the battery of a drone that has flown and stands on a charge pad with its motors off."""

    def __init__(self, site: Site, airframe: Airframe, swap_s: float) -> None:
        self._pads = [site.pad_centre(pad) for pad in site.pads if pad.charge]
        self._airframe = airframe
        self._swap_s = swap_s
        self._flown = False
        self._since_ns: int | None = None

    async def run(self, clock: Clock, bring_up_to: Callable[[int], None]) -> None:
        """Watch until cancelled; `bring_up_to` steps the vehicle to the present."""
        while True:
            await asyncio.sleep(_LOOKS_S)
            now_ns = clock.now_ns()
            bring_up_to(now_ns)
            self.look(now_ns)

    def look(self, now_ns: int) -> None:
        """See what stands on the pad and act when the time of a swap has passed."""
        frame = self._airframe
        self._flown |= not frame.on_floor
        here = any(math.hypot(frame.x_m - x_m, frame.y_m - y_m) < _REACH_M for x_m, y_m in self._pads)
        still = frame.on_floor and frame.collective < 0.01
        if not (self._flown and here and still and frame.battery_frac < _WORTH_FRAC):
            self._since_ns = None
        elif self._since_ns is None:
            self._since_ns = now_ns
        elif (now_ns - self._since_ns) * 1e-9 >= self._swap_s:
            frame.battery_frac = 1.0
            self._flown = False
