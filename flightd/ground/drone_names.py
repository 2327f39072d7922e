"""Which drones a ground station watches, as they are named on its command line."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from flightd.adapters.ground_link.client import Address
from flightd.core.errors import InputError

_NAME = re.compile(r"[A-Za-z0-9._-]{1,48}")
_PORTS = re.compile(r"(?P<host>.+?):(?P<status>\d{1,5})/(?P<command>\d{1,5})")
_ONE_PORT = re.compile(r"(?P<host>\[.*\]|[^:]*):(?P<port>\d*)")
_STATUS_PORT, _COMMAND_PORT = 5571, 5572


def drone_addresses(
    drones: Sequence[str], key: Path | None = None, server_keys: Sequence[str] = ()
) -> list[tuple[str, Address]]:
    """Names and addresses of `NAME=HOST` or `NAME=HOST:STATUS/COMMAND` (ports), this machine's own without
    any.  `server_keys` are `NAME=FILE`, or one `FILE` for all.  InputError naming what is wrong."""
    hosts = dict(_named("--drone", text, "NAME=HOST") for text in drones or ("drone=127.0.0.1",))
    if len(hosts) < len(drones):
        raise InputError("the same name twice; give each drone its own", key="--drone")
    files = _server_keys(server_keys, tuple(hosts))
    return [(name, _address(name, host, key, files.get(name))) for name, host in hosts.items()]


def _named(option: str, text: str, form: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals or not value:
        raise InputError(f"expected {form}", key=f"{option} {text}")
    if not _NAME.fullmatch(name):
        raise InputError(
            f"name {name!r}: use up to 48 letters, digits, dots, dashes and underscores",
            key=f"{option} {text}",
        )
    return name, value


def _server_keys(texts: Sequence[str], names: Sequence[str]) -> dict[str, Path]:
    files: dict[str, Path] = {}
    for text in texts:
        if "=" not in text:
            files |= dict.fromkeys(names, Path(text))
            continue
        name, file = _named("--server-key", text, "NAME=FILE")
        if name not in names:
            raise InputError(f"there is no --drone {name}", key=f"--server-key {text}")
        files[name] = Path(file)
    return files


def _address(name: str, text: str, key: Path | None, server_key: Path | None) -> Address:
    ports = _PORTS.fullmatch(text)
    host, status, command = text, _STATUS_PORT, _COMMAND_PORT
    if ports is not None:
        host, status, command = ports["host"], int(ports["status"]), int(ports["command"])
    elif one := _ONE_PORT.fullmatch(text):
        raise InputError(
            "a drone has two ports, one for its status and one for commands",
            key=f"--drone {name}={text}",
            remedy=f"give {name}={one['host'] or 'HOST'}:STATUS/COMMAND,"
            f" as in {name}={one['host'] or 'HOST'}:{_STATUS_PORT}/{_COMMAND_PORT}",
        )
    host = host.removeprefix("[").removesuffix("]")
    if not (0 < status < 65536 and 0 < command < 65536) or re.search(r"[\s/@=]", host):
        raise InputError("expected NAME=HOST or NAME=HOST:STATUS/COMMAND", key=f"--drone {name}={text}")
    return Address.with_keys(host, (status, command), key, server_key)
