"""Messages of VDA 5050 as JSON of either version, and back."""

from __future__ import annotations

import enum
import re
from collections.abc import Mapping
from typing import Any, Final, TypeVar

import msgspec

from flightd.core.errors import InputError
from flightd.fleet.vda5050 import version_2_1, version_3_0
from flightd.fleet.vda5050.factsheet import Factsheet
from flightd.fleet.vda5050.order import InstantActions, Order
from flightd.fleet.vda5050.parts import Header
from flightd.fleet.vda5050.renaming import Table
from flightd.fleet.vda5050.state import Connection, State, Visualization

_M = TypeVar("_M", bound=Header)
MOST_BYTES: Final = 4_000_000
"""Of one message."""
_AT: Final = re.compile(r" - at `\$\.?(?P<path>.*)`$")
_NOTHING: Final = Table()


class Version(enum.Enum):
    """A version of the protocol; the value is what its messages say."""

    V2_1 = "2.1.0"
    V3_0 = "3.0.0"

    @property
    def topic(self) -> str:
        """How topics say it."""
        return f"v{self.value[0]}"


TOPICS: Final[Mapping[type[Header], str]] = {
    Order: "order",
    InstantActions: "instantActions",
    Connection: "connection",
    State: "state",
    Visualization: "visualization",
    Factsheet: "factsheet",
}
"""What the last level of a message's topic is called."""


class MalformedError(InputError):
    """A message that is none of its kind.  `key` is the path to what is wrong, `told` what could be read of
    what it is about: headerId, orderId, orderUpdateId."""

    def __init__(self, what: str, *, key: str = "", told: Mapping[str, str]) -> None:
        super().__init__(what, key=key)
        self.told = told


def encoded(message: Header, version: Version) -> bytes:
    """The JSON of a message; its header says `version`."""
    plain = msgspec.to_builtins(message)
    plain["version"] = version.value
    return msgspec.json.encode(_tables(version).get(type(message), _NOTHING).written(plain))


def decoded(kind: type[_M], data: bytes, version: Version) -> _M:
    """A message of this kind.  MalformedError naming what is wrong with it."""
    if len(data) > MOST_BYTES:
        raise MalformedError(f"more than {MOST_BYTES // 10**6} MB", told={})
    try:
        plain = msgspec.json.decode(data)
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError) as err:
        raise MalformedError(f"no JSON: {err}", told={}) from None
    table = _tables(version).get(kind, _NOTHING)
    try:
        return msgspec.convert(table.read(plain), kind)
    except msgspec.ValidationError as err:
        what, at = str(err), _AT.search(str(err))
        key = wire_path(kind, at["path"], version) if at else ""
        raise MalformedError(what[: at.start()] if at else what, key=key, told=_told(plain)) from None
    except (ValueError, OverflowError) as err:
        raise MalformedError(str(err), told=_told(plain)) from None


def wire_path(kind: type[Header], path: str, version: Version) -> str:
    """A path into a message by the model's names, as it is in this version."""
    table = _tables(version).get(kind, _NOTHING)
    return re.sub(r"\w+", lambda found: table.wire_name(found[0]), path)


def _tables(version: Version) -> Mapping[type[Header], Table]:
    return version_2_1.TABLES if version is Version.V2_1 else version_3_0.TABLES


def _told(plain: Any) -> dict[str, str]:
    keys = ("headerId", "orderId", "orderUpdateId")
    return {key: str(plain[key])[:200] for key in keys if isinstance(plain, dict) and key in plain}
