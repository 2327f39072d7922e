"""What becomes of a battery on a charge pad: somebody puts in a fresh one, or contacts fill it."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from dataclasses import dataclass

from flightd.ports import Clock
from flightd.sim.plant.airframe import Airframe
from flightd.site.site import Site

_LOOKS_S = 0.5
_REACH_M = 0.5
_MET_M = 0.15
"""The pad's contacts are met by a drone that stands so near its middle."""
_WORTH_FRAC = 0.9
"""A fuller battery is left where it is."""


@dataclass(frozen=True, slots=True)
class PadService:
    """`swap_s`: the time in which somebody changes the battery of a drone that has flown; `contact_s`: that
    in which contacts fill an empty one.  0: nobody does, there are none."""

    swap_s: float = 0.0
    contact_s: float = 0.0


class ChargePads:
    """Serves a drone that stands on a charge pad with its motors off."""

    def __init__(self, site: Site, airframe: Airframe, service: PadService) -> None:
        self._pads = [site.pad_centre(pad) for pad in site.pads if pad.charge]
        self._airframe = airframe
        self._service = service
        self._flown = False
        self._since_ns: int | None = None
        self._looked_ns: int | None = None

    async def run(self, clock: Clock, bring_up_to: Callable[[int], None]) -> None:
        """Watch until cancelled; `bring_up_to` steps the vehicle to the present."""
        while True:
            await asyncio.sleep(_LOOKS_S)
            now_ns = clock.now_ns()
            bring_up_to(now_ns)
            self.look(now_ns)

    def look(self, now_ns: int) -> None:
        """See what stands on the pad; fill its battery, or change it when the time of a swap has passed."""
        frame, service = self._airframe, self._service
        since_s = 0.0 if self._looked_ns is None else (now_ns - self._looked_ns) * 1e-9
        self._looked_ns = now_ns
        self._flown |= not frame.on_floor
        off_m = min((math.hypot(frame.x_m - x, frame.y_m - y) for x, y in self._pads), default=math.inf)
        still = frame.on_floor and frame.collective < 0.01
        if service.contact_s and still and off_m < _MET_M:
            frame.battery_frac = min(frame.battery_frac + since_s / service.contact_s, 1.0)
        if service.swap_s:
            self._swap(now_ns, waits=still and self._flown and off_m < _REACH_M)

    def _swap(self, now_ns: int, *, waits: bool) -> None:
        frame = self._airframe
        if not (waits and frame.battery_frac < _WORTH_FRAC):
            self._since_ns = None
        elif self._since_ns is None:
            self._since_ns = now_ns
        elif (now_ns - self._since_ns) * 1e-9 >= self._service.swap_s:
            frame.battery_frac = 1.0
            self._flown = False
