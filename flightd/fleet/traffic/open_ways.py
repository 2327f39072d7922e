"""How far it is for a drone round all where nobody is planned."""

from __future__ import annotations

from collections.abc import Collection
from typing import Final, TypeAlias

from flightd.fleet.traffic.distances import Distances
from flightd.fleet.traffic.traffic_control import TrafficControl

_MOST: Final = 16
_Zones: TypeAlias = tuple[frozenset[int], ...]


class OpenWays:
    """By what is closed, and where others failed, roam or doubt, as each is now; who is in such a zone may
    leave it."""

    def __init__(self, control: TrafficControl) -> None:
        self._control = control
        self._known: dict[_Zones, Distances] = {}

    def ms(self, drone: str, start: int, goals: Collection[int]) -> int:
        """How long a drone needs at least from one vertex to the nearest of others; NEVER where no way
        leads there."""
        air = self._control.drones[drone].air
        zones = tuple(zone for zone in self._control.zones if zone.isdisjoint(air))
        round_them = self._known.get(zones)
        if round_them is None:
            if len(self._known) >= _MOST:
                self._known.pop(next(iter(self._known)))
            shut = frozenset().union(*zones)
            round_them = self._known[zones] = Distances(self._control.net, shut)
        return min(round_them.to(goal)[start] for goal in goals)
