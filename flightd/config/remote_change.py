"""What a ground station may change of a drone's configuration, and what the configuration then is.

Pure: the same rules hold on the drone, which decides, and on a station, which tells a person beforehand.  The
way by which the ground reaches the drone, whom the drone talks to, what it writes where and what starts a
flight or keeps people out of the aisles are changed on the drone itself: nobody can lock himself out, or make
the drone run or send something, by a message.
"""

from __future__ import annotations

import copy
import difflib
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path, PurePosixPath
from typing import Any, TypeAlias

from flightd.config.reference import Row, rows
from flightd.config.schema import Config, parse_config
from flightd.core.errors import InputError

Value: TypeAlias = bool | int | float | str | Sequence[bool | int | float | str] | None
"""A key's value as JSON has it; None: leave the key out, so that its default holds."""

MOST_CHANGES = 64
MOST_CHARACTERS = 200
"""Of a text that is given, and so many items of a list."""

_ON_THE_DRONE = "is changed on the drone itself"
_FIXED_SECTIONS = {
    "metrics": "where the drone listens",
    "interlock": "what keeps people out of the aisles",
}
_FIXED_KEYS = {
    "ground.listen": "the way to the ground",
    "ground.status_port": "the way to the ground",
    "ground.command_port": "the way to the ground",
    "vehicle.kind": "the way to the vehicle",
    "vehicle.url": "the way to the vehicle",
    "vehicle.system_id": "the way to the vehicle",
    "vehicle.own_system_id": "the way to the vehicle",
    "camera.url": "the way to the camera",
    "front_camera.url": "the way to the camera",
    "mission.autostart": "what starts a flight by itself",
    "mission.resume": "what starts a flight by itself",
    **{
        f"{camera}.{size}_px": "how much memory its pictures take"
        for camera in ("camera", "front_camera")
        for size in ("width", "height")
    },
    "vision.workers": "how many processes it runs",
    "scan.workers": "how many processes it runs",
}
_FILES_BESIDE = frozenset({"mission.site"})
"""Files that may be chosen anew among those in the configuration's own folder."""
_NAMES = frozenset({"vision.profile"})
"""Names that may stand for files: without any folder."""


@cache
def known_keys() -> Mapping[str, Row]:
    """Every key by its name."""
    return {row.name: row for row in rows()}


def fixed_because(row: Row) -> str:
    """Why a ground station cannot change a key; empty where it can."""
    if row.section.partition(".")[0] in _FIXED_SECTIONS:
        return f"{_FIXED_SECTIONS[row.section.partition('.')[0]]} {_ON_THE_DRONE}"
    if row.name in _FIXED_KEYS:
        return f"{_FIXED_KEYS[row.name]} {_ON_THE_DRONE}"
    if row.type == "path" and row.name not in _FILES_BESIDE:
        return f"which file it uses {_ON_THE_DRONE}"
    return ""


def proposed(table: Mapping[str, Any], changes: Mapping[str, Value]) -> dict[str, Any]:
    """The configuration's table with these changes, itself unchanged.  InputError, with the key, for a change
    that no ground station may make."""
    if not changes:
        raise InputError("nothing is changed")
    if len(changes) > MOST_CHANGES:
        raise InputError(f"{len(changes)} keys at once", remedy=f"change {MOST_CHANGES} at most")
    keys = known_keys()
    for name, value in changes.items():
        if name not in keys:
            raise _unknown(name, keys)
        if why := fixed_because(keys[name]):
            raise InputError(why, key=name)
        _check_value(name, value)
    changed = copy.deepcopy(dict(table))
    for name, value in changes.items():
        _put(changed, name.split("."), value)
    return changed


def checked(table: Mapping[str, Any], changes: Mapping[str, Value], path: Path) -> Config:
    """The configuration of the file `path` with these changes.  InputError as `proposed`, or in the words of
    the configuration itself."""
    return parse_config(proposed(table, changes), path)


def differences(before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Value]:
    """The changes that lead from one table to another, key by key."""
    old, new = _flat(before), _flat(after)
    return {name: new.get(name) for name in sorted({*old, *new}) if _differ(old.get(name), new.get(name))}


def value_in(table: Mapping[str, Any], name: str) -> Any:
    """A key's value in a table; None where it is left out."""
    return _flat(table).get(name)


def _unknown(name: str, keys: Mapping[str, Row]) -> InputError:
    short = name[:MOST_CHARACTERS]
    near = difflib.get_close_matches(short, keys, n=1)
    remedy = f"did you mean {near[0]}?" if near else ""
    return InputError("unknown key", key=short if short.isprintable() else repr(short), remedy=remedy)


def _check_value(name: str, value: Value) -> None:
    items = value if isinstance(value, list | tuple) else [value]
    if len(items) > MOST_CHARACTERS:
        raise InputError(f"{len(items)} items; {MOST_CHARACTERS} at most are taken", key=name)
    for item in items:
        if isinstance(item, str) and (len(item) > MOST_CHARACTERS or not item.isprintable()):
            raise InputError(f"up to {MOST_CHARACTERS} printable characters are taken", key=name)
        if not isinstance(item, bool | int | float | str | None):
            raise InputError("a value, or a list of values, is taken", key=name)
        if isinstance(item, int) and abs(item) >= 2**63:
            raise InputError("too large a number", key=name)
    if name in _FILES_BESIDE and isinstance(value, str) and not _is_beside(value):
        raise InputError(f"a file in the configuration's own folder is taken, not {value}", key=name)
    if name in _NAMES and isinstance(value, str) and (not value or PurePosixPath(value).name != value):
        raise InputError(f"a name without a folder is taken, not {value}", key=name)


def _is_beside(text: str) -> bool:
    path = PurePosixPath(text)
    return path.name == text and not text.startswith(".") and "\\" not in text


def _put(table: dict[str, Any], parts: Sequence[str], value: Value) -> None:
    """Set or leave out a key; a table that a file has as something else is left to the check."""
    *sections, key = parts
    for part in sections:
        inner = table.setdefault(part, {})
        if not isinstance(inner, dict):
            raise InputError("expected a table", key=".".join(sections))
        table = inner
    if value is None:
        table.pop(key, None)
    else:
        table[key] = list(value) if isinstance(value, list | tuple) else value


def _flat(table: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in table.items():
        name = f"{prefix}.{key}" if prefix else str(key)
        found |= _flat(value, name) if isinstance(value, Mapping) else {name: value}
    return found


def _differ(one: Any, other: Any) -> bool:
    return bool(one != other or isinstance(one, bool) is not isinstance(other, bool))
