"""Configuring the drone: one acknowledged CONFIG at a time, own profiles, and reading back what took.

The drone acknowledges any CONFIG, wrong ones too, by a state bit that has to be cleared before the next;
only reading everything back over TCP tells what it believes.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Mapping
from typing import Protocol

from flightd.adapters.vehicle.ardrone import at
from flightd.adapters.vehicle.ardrone.at import AtCommand
from flightd.adapters.vehicle.ardrone.navdata import DroneState, Navdata, Option
from flightd.adapters.vehicle.ardrone.refusal import KeepsValue
from flightd.adapters.vehicle.ardrone.settings import ArDroneSettings
from flightd.runtime.within import Within

_log = logging.getLogger(__name__)

_SAFETY_KEYS = (
    "general:com_watchdog",
    "control:outdoor",
    "control:flying_mode",
    "control:control_level",
    "control:altitude_max",
)
"""Those that land it when this computer is silent, bound its height and say how it takes setpoints; by its
other limits setpoints are scaled."""
COM_WATCHDOG_S = 2
"""Nobody heard for so long: it lands by itself.  As shipped; another program may have left more."""

ACK_TIMEOUT_S = 1.0
_REPEAT_S = 0.1
_PROFILE_SETTLE_S = 0.5
_READ_TIMEOUT_S = 1.0
_READ_ATTEMPTS = 3
_MAX_TEXT_BYTES = 64 * 1024

OPTIONS = (Option.DEMO, Option.TIME, Option.RAW_MEASURES, Option.ALTITUDE)


class ConfigLink(Protocol):
    """What the handshake needs of the link."""

    def send(self, *commands: AtCommand) -> None:
        """One datagram with these commands."""
        ...

    async def packet(self) -> Navdata:
        """The next navdata packet to arrive."""
        ...


def wanted_values(settings: ArDroneSettings) -> dict[str, str]:
    """Every key this program sets, in the order in which they have to be written."""
    return {
        "general:com_watchdog": str(COM_WATCHDOG_S),
        "control:outdoor": "FALSE",  # selects a triple of limits: before the limits
        "control:flying_mode": "0",
        "control:control_level": "0",
        "detect:detect_type": "3",
        "control:euler_angle_max": f"{settings.tilt_max_rad:.6f}",
        "control:control_vz_max": f"{settings.climb_max_mps * 1000:.0f}",
        "control:control_yaw": f"{settings.yaw_rate_max_radps:.6f}",
        "control:altitude_max": f"{settings.height_max_m * 1000:.0f}",
        "general:navdata_options": str(sum(1 << option for option in OPTIONS)),
        "video:video_codec": str(0x81),
        "video:bitrate_ctrl_mode": "0",
        "video:bitrate": str(settings.video_bitrate_kbps),
        "video:max_bitrate": str(settings.video_bitrate_kbps),
        "video:video_channel": str(int(settings.camera)),
    }


def parse_text(data: bytes) -> dict[str, str]:
    """`section:key = value` lines, up to the closing NUL; other lines are passed over."""
    values: dict[str, str] = {}
    for line in data.split(b"\0", 1)[0].decode("ascii", "replace").splitlines():
        key, equals, value = line.partition("=")
        if equals and ":" in key:
            values[key.strip()] = value.strip()
    return values


def kept(settings: ArDroneSettings, found: Mapping[str, str]) -> KeepsValue | None:
    """What of its configuration, as `found`, the drone must not be flown with; None where there is nothing,
    or nothing was told."""
    wanted = {key: value for key, value in wanted_values(settings).items() if key in _SAFETY_KEYS}
    wrong = differing(wanted, found) if found else {}
    return next((KeepsValue(key, found.get(key, ""), value) for key, value in wrong.items()), None)


def same_value(left: str, right: str) -> bool:
    """Equal as text, or as numbers to the precision in which the drone prints floats."""
    if left == right:
        return True
    try:
        a, b = float(left), float(right)
    except ValueError:
        return False
    return abs(a - b) <= 1e-5 * max(1.0, abs(a))


class Configurator:
    """Brings the drone's configuration to `settings` and says what is in force."""

    def __init__(self, link: ConfigLink, settings: ArDroneSettings) -> None:
        self._link = link
        self._settings = settings
        self._lock = asyncio.Lock()
        self._own_profiles = False

    async def configure(self) -> dict[str, str]:
        """Leave bootstrap, take our profiles, write what differs, read back.

        Returns the values in force as the drone tells them; empty when its configuration port does not
        answer (everything was then written blind).  Raises `TimeoutError` when navdata stops.
        """
        settings = self._settings
        self._own_profiles = False
        await self.write("general:navdata_demo", "FALSE" if settings.full_navdata else "TRUE")
        profiles = {
            "custom:session_id": settings.session,
            "custom:application_id": settings.application,
            "custom:profile_id": settings.user,
        }
        options = "general:navdata_options"
        await self.write(options, wanted_values(settings)[options])  # telemetry first, the rest takes seconds
        found = await self.read()
        if any(found.get(key) != value for key, value in profiles.items()):
            for key, value in profiles.items():
                await self.write(key, value)
                await asyncio.sleep(_PROFILE_SETTLE_S)
            found = await self.read()
        self._own_profiles = True
        wanted = wanted_values(settings)
        for _ in range(2):
            missing = differing(wanted, found)
            for key in missing:
                await self.write(key, wanted[key])
            if not missing:
                break
            found = await self.read()
        for key, value in differing(wanted, found).items():
            if found:
                _log.warning("%s", KeepsValue(key, found.get(key, ""), value))
        return found

    async def write(self, key: str, value: str) -> bool:
        """One CONFIG with its handshake; False when the drone did not acknowledge (it may still have
        taken it: some firmware leaves the bit standing)."""
        async with self._lock:
            clear = at.ctrl(at.CTRL_CLEAR_ACK)
            fresh = await self._until(False, clear)
            group = [at.config(key, value)]
            if self._own_profiles:
                settings = self._settings
                group.insert(0, at.config_ids(settings.session, settings.user, settings.application))
            if not fresh:
                self._link.send(*group)
                return False
            acknowledged = await self._until(True, *group)
            await self._until(False, clear)
            return acknowledged

    async def read(self) -> dict[str, str]:
        """All values in force, or nothing when the configuration port stays silent."""
        async with self._lock:
            for _ in range(_READ_ATTEMPTS):
                await self._until(False, at.ctrl(at.CTRL_CLEAR_ACK))
                with contextlib.suppress(OSError, TimeoutError):
                    if values := parse_text(await self._fetch()):
                        await self._until(True)  # a packet from before the dump may still be under way
                        await self._until(False, at.ctrl(at.CTRL_CLEAR_ACK))
                        return values
            return {}

    async def _fetch(self) -> bytes:
        """Raises `OSError` or `TimeoutError` when the port does not deliver."""
        async with Within(_READ_TIMEOUT_S):
            reader, writer = await asyncio.open_connection(
                self._settings.host, self._settings.control_port, limit=_MAX_TEXT_BYTES
            )
            try:
                self._link.send(at.ctrl(at.CTRL_SEND_CONFIG))
                with contextlib.suppress(asyncio.IncompleteReadError, asyncio.LimitOverrunError):
                    return await reader.readuntil(b"\0")
                return b""
            finally:
                writer.close()

    async def _until(self, acknowledged: bool, *commands: AtCommand) -> bool:
        """Repeat `commands` until a packet shows the acknowledge bit as wanted; False when none did in
        time.  A bit that is clear already is left alone.  Raises `TimeoutError` when no packet came."""
        heard = False
        with contextlib.suppress(TimeoutError):
            async with Within(ACK_TIMEOUT_S):
                if not acknowledged:
                    newest = await self._link.packet()
                    heard = True
                    if not _acknowledged(newest):
                        return True
                while True:
                    self._link.send(*commands)
                    with contextlib.suppress(TimeoutError):
                        async with Within(_REPEAT_S):
                            while _acknowledged(await self._link.packet()) != acknowledged:
                                heard = True
                            return True
        if not heard:
            raise TimeoutError("the drone sends no navdata")
        return False


def _acknowledged(packet: Navdata) -> bool:
    return bool(packet.state & DroneState.COMMAND_ACK)


def differing(wanted: Mapping[str, str], found: Mapping[str, str]) -> dict[str, str]:
    """The wanted values which `found` does not hold."""
    return {key: value for key, value in wanted.items() if not same_value(found.get(key, ""), value)}
