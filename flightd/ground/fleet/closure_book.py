"""What people have closed to the station's drones: kept until people open it, whatever becomes of the
station."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from flightd.adapters.ground_link.messages.floor import FloorStatus
from flightd.core.errors import FlightdError, InputError, UnavailableError
from flightd.fleet.traffic.closures import Closure
from flightd.ground.fleet.closed_ways import everywhere, on_map, places_of
from flightd.ground.fleet.fleet_memory import FleetMemory, KeptClosure
from flightd.ground.fleet.station_traffic import Aside

_LOG = logging.getLogger(__name__)


class ClosureBook:
    """`recall` what is kept before anything else."""

    def __init__(
        self, memory: FleetMemory | None, aside: Aside, utc_s: Callable[[], float] = time.time
    ) -> None:
        self._memory = memory
        self._aside = aside
        self._utc_s = utc_s
        self._closed: dict[str, KeptClosure] = {}
        self._changes = asyncio.Lock()
        self._is_recalled = False
        self._mapped: tuple[FloorStatus, tuple[KeptClosure, ...], tuple[Closure, ...]] | None = None

    def on(self, floor: FloorStatus) -> tuple[Closure, ...]:
        """All that is closed now, as this map calls it.  What is not there is closed everywhere: it may have
        been closed by the map before while this one was begun."""
        kept, mapped = tuple(self._closed.values()), self._mapped
        if mapped is None or mapped[0] is not floor or mapped[1] != kept:  # traffic asks at every step
            mapped = self._mapped = floor, kept, tuple(_on_map_or_everywhere(floor, one) for one in kept)
        return mapped[2]

    def check(self, floor: FloorStatus) -> None:
        """InputError where not all that is closed is on this map."""
        for one in self._closed.values():
            on_map(floor, one.closure, one.places)

    async def recall(self) -> None:
        """Read what is kept, once.  UnavailableError or InputError where that cannot be read: then nobody
        knows what is closed."""
        async with self._changes:
            if not self._is_recalled and self._memory is not None:
                kept = await self._aside(self._memory.closures)
                self._closed = {one.closure.name: one for one in kept}
            self._is_recalled = True

    async def close(self, closure: Closure, floor: FloorStatus, by: str) -> None:
        """From now on, by that map.  UnavailableError where it is closed and cannot be written down; errors
        as of `recall`."""
        await self.recall()
        async with self._changes:
            self._closed[closure.name] = KeptClosure(closure, by, self._utc_s(), places_of(floor, closure))
            await self._keep()

    async def open(self, name: str) -> None:
        """InputError where nothing is closed by that name, UnavailableError where it is open and cannot be
        written down; errors as of `recall`."""
        await self.recall()
        async with self._changes:
            if self._closed.pop(name, None) is None:
                raise InputError(f"nothing is closed that is called {name}")
            await self._keep()

    async def _keep(self) -> None:
        if self._memory is None:
            return
        try:
            await self._aside(partial(self._memory.keep_closures, tuple(self._closed.values())))
        except FlightdError as err:
            raise UnavailableError(f"it holds until the station ends, for it is not kept: {err}") from err

    def document(
        self, inside: Mapping[str, Sequence[str]], flown: Mapping[str, Closure]
    ) -> list[dict[str, Any]]:
        """As JSON has it, with the drones that may be `inside` each; None where that is not known.  `flown`
        are the closures that traffic keeps, by the names of its map."""
        return [
            {
                "name": one.closure.name,
                "ways": flown.get(one.closure.name, one.closure).ways,
                "why": flown.get(one.closure.name, one.closure).why,
                "by": one.by,
                "utc_s": round(one.utc_s, 1),
                "inside": inside.get(one.closure.name),
            }
            for one in self._closed.values()
        ]


def _on_map_or_everywhere(floor: FloorStatus, one: KeptClosure) -> Closure:
    try:
        return on_map(floor, one.closure, one.places)
    except InputError as err:
        _LOG.warning("nobody flies: %s", err)
        return everywhere(floor, one.closure, err.what)
