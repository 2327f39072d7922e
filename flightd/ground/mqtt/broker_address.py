"""Where an MQTT broker is, as it is given on the command line."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final
from urllib.parse import SplitResult, unquote, urlsplit

from flightd.core.errors import InputError
from flightd.fleet.vda5050.codec import Version
from flightd.fleet.vehicle.drone_factsheet import Measures

OPTION: Final = "--mqtt"
_PORTS: Final = {"mqtt": 1883, "mqtts": 8883}
_BODY: Final = re.compile(r"(\d+(?:\.\d+)?)x(\d+(?:\.\d+)?)x(\d+(?:\.\d+)?)")
_MAX_SPEED_MPS: Final = 3.0
"""No configuration lets a drone fly faster along its lines."""
_VERSIONS: Final = {"2.1": Version.V2_1, "3.0": Version.V3_0}


@dataclass(frozen=True, slots=True)
class BrokerAddress:
    """`interface` is the first level of all topics, None: as the version of VDA 5050 suggests."""

    host: str
    port: int
    tls: bool
    user: str | None = None
    password: str | None = None
    interface: str | None = None

    @property
    def shown(self) -> str:
        """Without what is secret."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{'mqtts' if self.tls else 'mqtt'}://{host}:{self.port}"


def read_broker(text: str) -> BrokerAddress:
    """mqtt[s]://[USER[:PASSWORD]@]HOST[:PORT][/INTERFACE].  InputError, without the password, for another."""
    try:
        url = urlsplit(text)
        port = url.port
    except ValueError:
        raise InputError("is no URL of a broker", key=OPTION, remedy=_example()) from None
    interface = url.path.strip("/")
    is_url = url.scheme in _PORTS and bool(url.hostname) and not set(text) & {"?", "#"}
    if not is_url or not url.hostname or not _is_host(url.hostname) or not _is_level(interface):
        raise InputError(f"{_shown(url)!r} is no URL of a broker", key=OPTION, remedy=_example())
    return BrokerAddress(
        host=url.hostname,
        port=port or _PORTS[url.scheme],
        tls=url.scheme == "mqtts",
        user=None if url.username is None else unquote(url.username),
        password=None if url.password is None else unquote(url.password),
        interface=interface or None,
    )


def read_version(text: str) -> Version:
    """2.1 or 3.0.  InputError for another."""
    if text not in _VERSIONS:
        raise InputError(
            f"there is no version {text!r}", key=f"{OPTION}-version", remedy=f"give {' or '.join(_VERSIONS)}"
        )
    return _VERSIONS[text]


def read_body(text: str) -> Measures:
    """A drone of this size, LxWxH in metres, that flies as fast as any may.  InputError for another text."""
    found = _BODY.fullmatch(text)
    sizes = [float(part) for part in found.groups()] if found is not None else []
    if not sizes or not all(0.05 <= size <= 5.0 for size in sizes):
        raise InputError(
            f"{text!r} is no size of a drone", key=f"{OPTION}-body", remedy="give metres, as 0.6x0.6x0.3"
        )
    return Measures(_MAX_SPEED_MPS, 1.0, 1.0, *sizes)


def _is_host(name: str) -> bool:
    """One that a resolver takes: it fails over empty and overlong labels."""
    try:
        name.encode("idna")
    except UnicodeError:
        return False
    return True


def _is_level(text: str) -> bool:
    return len(text) <= 64 and not set(text) & set("/+#$\0")


def _shown(url: SplitResult) -> str:
    return f"{url.scheme}://{url.netloc.rpartition('@')[2]}{url.path}"


def _example() -> str:
    return "give mqtt://HOST, or mqtts://USER:PASSWORD@HOST:PORT"
