"""Keys that stood elsewhere once, and where they stand now.

A file with such a key is refused with the name of the new one.  The configuration that a flight log keeps
is carried over, so that recordings made before still replay, with the values that they were flown with.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

_PUSHED = ("push_mps2", "off_m", "push_s", "brake_s")
_UNSEEN = ("search_s", "search_climb_m", "search_land_s", "blind_land_s", "blind_m")
_LOOPS = {"horizontal": "mps2", "yaw": "radps", "height": "mps"}

MOVED: dict[str, str] = {
    **{f"hazards.{key}": f"hazards.expert.{key}" for key in (*_PUSHED, *_UNSEEN)},
    **{
        f"control.{key}": f"control.expert.{key}"
        for key in ("max_tilt_rate_degps", "max_jerk_mps3", "max_yaw_accel_degps2")
    },
    **{
        f"control.{loop}.{limit}": f"control.expert.{loop}_{limit}_{unit}"
        for loop, unit in _LOOPS.items()
        for limit in ("integral_limit", "output_limit")
    },
}
"""The new name of each key that moved."""


BEFORE: dict[str, Any] = {"mission.autostart_countdown_s": 0.0}
"""What a recording that was made before a key existed was flown with, where today's default is another."""


def moved_keys(document: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """The keys of a configuration that stand where they no longer belong, each with its new name."""
    return ((old, new) for old, new in MOVED.items() if _holder(document, old) is not None)


def migrated(document: dict[str, Any]) -> dict[str, Any]:
    """The configuration of an older recording with each key where it stands today; the document itself is
    left as it is."""
    document = copy.deepcopy(document)
    for old, new in list(moved_keys(document)):
        holder = _holder(document, old)
        value = holder.pop(old.rpartition(".")[2]) if holder is not None else None
        _put(document, new, value)
    for name, value in BEFORE.items():
        if name.split(".")[0] in document and _holder(document, name) is None:
            _put(document, name, value)
    return document


def _put(document: dict[str, Any], name: str, value: Any) -> None:
    """Give the key of that full name a value."""
    *tables, key = name.split(".")
    place = document
    for table in tables:
        place = place.setdefault(table, {})
    place[key] = value


def _holder(document: dict[str, Any], name: str) -> dict[str, Any] | None:
    """The table that holds the key of that full name; None where it is not given."""
    *tables, key = name.split(".")
    place: Any = document
    for table in tables:
        place = place.get(table) if isinstance(place, dict) else None
    return place if isinstance(place, dict) and key in place else None
