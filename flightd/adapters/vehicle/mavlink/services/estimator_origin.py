"""The place on earth that ArduPilot's estimator ties its local frame to.

Its estimator fuses our motion without; GUIDED wants one.  Once it has one, arming compares the compass with
the earth's field there, and its failsafe for a lost position begins to work: so none is given but to GUIDED,
and it has to lie where the field is the hall's.  An origin that is set already stays.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.link.codec import Message
from flightd.adapters.vehicle.mavlink.link.connection import MavlinkLink
from flightd.adapters.vehicle.mavlink.services.commands import Commander

_AGAIN_S = 2.0


class Origin:
    """Sends the origin until the autopilot reports one, and again after it rebooted, while it is `wanted`."""

    def __init__(
        self,
        link: MavlinkLink,
        commander: Commander,
        system_id: int,
        place_deg: tuple[float, float],
        wanted: Callable[[], bool],
    ) -> None:
        """`place_deg` is latitude and longitude."""
        self._link, self._wanted = link, wanted
        self._commander = commander
        self._system_id = system_id
        self._place = round(place_deg[0] * 1e7), round(place_deg[1] * 1e7)
        self.is_set = self.is_ours = False

    def take(self, message: Message) -> None:
        """GPS_GLOBAL_ORIGIN says that there is one, and whether it is the one that is sent."""
        if message.get_type() == "GPS_GLOBAL_ORIGIN":
            self.is_set = True
            self.is_ours = (message.latitude, message.longitude) == self._place

    def forget(self) -> None:
        """The autopilot rebooted."""
        self.is_set = self.is_ours = False

    async def run(self) -> None:
        """Keep it set until cancelled; started when the autopilot is heard."""
        while True:
            if not self.is_set and self._wanted():
                self._link.send(
                    dialect.MAVLink_set_gps_global_origin_message(self._system_id, *self._place, 0, 0)
                )
                await self._commander.send(
                    dialect.MAV_CMD_REQUEST_MESSAGE, dialect.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN
                )
            await asyncio.sleep(_AGAIN_S)
