"""The address of a vehicle, as the configuration writes it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum

from flightd.core.errors import InputError


class EndpointKind(StrEnum):
    UDP_IN = "udpin"
    UDP_OUT = "udpout"
    TCP = "tcp"
    SERIAL = "serial"


@dataclass(frozen=True, slots=True)
class Endpoint:
    """Where to listen (udpin) or whom to call (udpout, tcp), or which serial device at which baud rate."""

    kind: EndpointKind
    host: str = ""
    port: int = 0
    device: str = ""
    baud: int = 0

    def __str__(self) -> str:
        if self.kind is EndpointKind.SERIAL:
            return f"serial://{self.device}:{self.baud}"
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.kind}://{host}:{self.port}"


_FORMS = "udpin://0.0.0.0:14550, udpout://HOST:PORT, tcp://HOST:PORT or serial:///dev/ttyAMA0:921600"
_URL = re.compile(r"(?P<kind>[a-z]+):(?://)?(?P<place>[^\s:]+|\[[^\s\]]+\]):(?P<number>\d+)")


def parse_endpoint(url: str) -> Endpoint:
    """Read `udpin://H:P`, `udpout://H:P`, `tcp://H:P` (also `tcp:H:P`), `serial:///dev/X:BAUD`.

    InputError names what is wrong and the forms that are understood.
    """
    match = _URL.fullmatch(url.strip())
    if match is None:
        raise InputError(f"vehicle.url {url!r} is no address: use {_FORMS}")
    try:
        kind = EndpointKind(match["kind"])
    except ValueError:
        raise InputError(f"vehicle.url {url!r}: {match['kind']!r} is unknown: use {_FORMS}") from None
    place, number = match["place"], int(match["number"])
    if kind is EndpointKind.SERIAL:
        if not place.startswith("/"):
            raise InputError(f"vehicle.url {url!r}: {place!r} is not the path of a device: use {_FORMS}")
        return Endpoint(kind, device=place, baud=number)
    if not 0 < number < 65536:
        raise InputError(f"vehicle.url {url!r}: port {number} is outside 1..65535")
    return Endpoint(kind, host=place.strip("[]"), port=number)
