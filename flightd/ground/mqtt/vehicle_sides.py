"""The vehicle sides of a station's drones, as its pages and its hub see whoever manages them."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

from flightd.ground.hub import Hub
from flightd.ground.messages import LinkPicture, PictureKey
from flightd.ground.mqtt.managed_drone import ManagedDrone

_LOG = logging.getLogger(__name__)
_AGAIN_S: Final = 5.0


class VehicleSides:
    """A viewer of the hub (`hub.Viewer`) that wants no pictures, and the manager of its drones
    (`manager_routes.Managers`); where it `takes_orders` for them, else it only looks on."""

    def __init__(self, drones: Mapping[str, ManagedDrone], *, takes_orders: bool = True) -> None:
        self._drones = drones
        self._takes_orders = takes_orders

    def follow(self, hub: Hub) -> None:
        """Tell the pages from now on who flies each drone."""
        for name, drone in self._drones.items() if self._takes_orders else ():
            drone.on_taken = partial(_tell_page, hub, name)
            _tell_page(hub, name, False)

    def hand_over(self, name: str, *, to_manager: bool) -> bool:
        """As `Managers`."""
        drone = self._drones.get(name)
        if drone is None or not self._takes_orders:
            return False
        drone.taken_by_person(not to_manager)
        return True

    def flies(self, name: str) -> bool:
        """As `Managers`."""
        return self._takes_orders and name in self._drones and not self._drones[name].is_taken

    def attach(self, wake: Callable[[], object] | None) -> None:
        """No pictures are wanted here."""

    def tell(self, drone: str, topic: str, value: Any) -> None:
        """As `hub.Viewer`."""
        if drone in self._drones:
            self._drones[drone].tell(topic, value)

    def show(self, key: PictureKey, picture: LinkPicture) -> None:
        """No pictures are wanted here."""

    def has_use_for(self, key: PictureKey) -> bool:  # noqa: ARG002 - as the protocol has it
        """No pictures are wanted here."""
        return False


async def kept_on(name: str, drone: ManagedDrone, hub: Hub) -> None:
    """Step a drone until cancelled: an error about one ends neither the others' flights nor the station."""
    while True:
        try:
            await drone.run(hub.drones[name])
        except Exception:  # noqa: BLE001 - it is as one that nobody commands
            _LOG.error("%s: what stepped it failed, and begins anew", name, exc_info=True)
            drone.is_automatic = False
        await asyncio.sleep(_AGAIN_S)


def _tell_page(hub: Hub, name: str, taken: bool) -> None:
    hub.tell(name, "manager", {"flies": not taken})
