"""Which nodes no drone of a fleet reaches with the battery that it has when it is ready to begin."""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

from flightd.fleet.traffic.motions import NEVER

BEYOND: Final = "no battery reaches it"
NO_WAY: Final = "there is no way there"
TRIES: Final = 4
"""Of a node, before it is told: a plan may take long only for whom it waits for."""
_FULLER: Final = 0.02
"""A drone with so much more charge than it had may try again."""


class Reach:
    """Drones are tried from their pads; `fails` says of which nodes they did not come home."""

    def __init__(self) -> None:
        self._tried: dict[str, dict[str, tuple[int, float]]] = {}
        """Of each node: how often each drone failed, and the most charge that it had."""
        self._told: dict[str, str] = {}
        """The drone that alone may go there, of each node that was told; empty: any."""

    def fails(self, node: str, drone: str, charge: float) -> None:
        """A drone that is ready would not come home from this node."""
        tried = self._tried.setdefault(node, {})
        tries, most = tried.get(drone, (0, charge))
        tried[drone] = tries + 1, max(most, charge)

    def why(self, node: str, way_ms: int, drones: Collection[str], alone: str) -> str:
        """Why none of these drones goes there, over at least so long a way; empty while one may.  It is
        `alone` the one that may, if one is named."""
        tried = self._tried.get(node, {})
        wanted = {alone} if alone else set(drones)
        if not all(tried.get(drone, (0, 0.0))[0] >= TRIES for drone in wanted):
            return ""
        self._told[node] = alone
        return NO_WAY if way_ms >= NEVER else BEYOND

    def regained(self, drone: str, charge: float) -> list[str]:
        """The nodes that were told, and that a drone which is ready may reach after all: it has more charge
        than it had, or had not tried."""
        found = [
            node
            for node, alone in self._told.items()
            if alone in {"", drone} and charge >= self._tried[node].get(drone, (0, -1.0))[1] + _FULLER
        ]
        for node in found:
            self.forget(node)
        return found

    def forget(self, node: str) -> None:
        """A drone goes there."""
        self._tried.pop(node, None)
        self._told.pop(node, None)
