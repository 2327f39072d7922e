"""What lights the shelf while it is looked at, as `front_camera.lamp` names it."""

from __future__ import annotations

import enum
import re
from dataclasses import dataclass


class LampKind(enum.StrEnum):
    """What switches it: the computer's own LED driver, or an output of the autopilot."""

    LED = "led"
    RELAY = "relay"
    ACTUATOR = "actuator"


SWITCHED_BY = {LampKind.RELAY: "ardupilot", LampKind.ACTUATOR: "px4"}
"""The `vehicle.kind` that has such an output."""
_NAME = re.compile(r"[A-Za-z0-9_:.-]{1,64}")
_NUMBERS = {LampKind.RELAY: range(16), LampKind.ACTUATOR: range(1, 7)}
"""MAV_CMD_DO_SET_RELAY counts from 0, MAV_CMD_DO_SET_ACTUATOR has six values from 1."""


@dataclass(frozen=True, slots=True)
class LampSwitch:
    """One lamp: the name of a LED, or the number of an output."""

    kind: LampKind
    name: str = ""
    number: int = 0


def lamp_switch(text: str) -> LampSwitch | None:
    """What `led:NAME`, `relay:N` or `actuator:N` says, None for an empty text.  ValueError for another."""
    if not text:
        return None
    kind, _, place = text.partition(":")
    if kind == LampKind.LED and _NAME.fullmatch(place) and place not in {".", ".."}:
        return LampSwitch(LampKind.LED, name=place)
    if kind in set(LampKind) and place.isascii() and place.isdecimal():
        known = _NUMBERS.get(LampKind(kind), range(0))
        if int(place) in known:
            return LampSwitch(LampKind(kind), number=int(place))
    raise ValueError(f"{text!r} is none of led:NAME, relay:0 to relay:15, actuator:1 to actuator:6")
