"""Gives the autopilot the key of a signed link: SETUP_SIGNING, in the clear and never acknowledged.

Hence only over a link that nobody else can hear, and believed only when the autopilot's own messages come
signed with that key.  An autopilot need not sign on USB, so silence there proves nothing.
"""

from __future__ import annotations

import asyncio
import ipaddress
import re

from flightd.adapters.vehicle.mavlink.examination import Examination
from flightd.adapters.vehicle.mavlink.link.endpoint import Endpoint, EndpointKind, parse_endpoint
from flightd.adapters.vehicle.mavlink.link.signing import Signing
from flightd.core.errors import InputError, RunError, UnavailableError
from flightd.ports import Clock

_SETTLE_S = 0.5
_CONFIRM_S = 4.0


def refuse_overheard(url: str) -> Endpoint:
    """The endpoint, if it is a serial line or this machine's own; InputError for anything on a network."""
    endpoint = parse_endpoint(url)
    if endpoint.kind is EndpointKind.SERIAL or _is_this_machine(endpoint.host):
        return endpoint
    raise InputError(f"{url}: the key goes out in the clear: use a cable, e.g. serial:///dev/ttyACM0:115200")


async def give_key(
    url: str, key: bytes, clock: Clock, unix_time_s: float, system_id: int = 1, patience_s: float = 5.0
) -> bool:
    """Send the key, then listen; True when the autopilot was heard to sign with it.

    InputError for a link that others can hear; UnavailableError when no autopilot is heard on it, RunError
    when it is armed.
    """
    refuse_overheard(url)
    examination = Examination(url, clock, system_id)
    async with examination.connected(patience_s):
        if examination.armed:
            raise RunError(f"{url}: the vehicle is armed, it takes no key now: disarm it")
        examination.send_key(key, unix_time_s)
        await asyncio.sleep(_SETTLE_S)
    confirming = Examination(url, clock, system_id, Signing(key, clock, unix_time_s + _SETTLE_S))
    try:
        async with confirming.connected(_CONFIRM_S):
            return True
    except UnavailableError:
        return False


def _is_this_machine(host: str) -> bool:
    if re.fullmatch(r"[\d.]+|.*:.*", host):
        try:
            return ipaddress.ip_address(host).is_loopback
        except ValueError:
            return False
    return host == "localhost"
