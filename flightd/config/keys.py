"""What a key of a section takes: its type, unit, range and default, in words of the file's format."""

from __future__ import annotations

import enum
import math
import types
import typing
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, Union

from pydantic import BaseModel
from pydantic.fields import FieldInfo

_UNITS = {
    "_m": "m",
    "_mps": "m/s",
    "_mps2": "m/s^2",
    "_mps3": "m/s^3",
    "_deg": "deg",
    "_degps": "deg/s",
    "_degps2": "deg/s^2",
    "_rad": "rad",
    "_radps": "rad/s",
    "_s": "s",
    "_per_s": "1/s",
    "_px": "px",
    "_fps": "1/s",
    "_gb": "GB",
    "_wh": "Wh",
    "_w": "W",
    "_frac": "share",
    "_share": "share",
}
"""Unit by the last part of a key's name; a key without one of these names its unit itself, see `unit_of`."""


def unit_of(key: str, field: FieldInfo) -> str:
    """The unit that the field names (`json_schema_extra={"unit": ...}`) or that its name ends with."""
    extra = field.json_schema_extra
    if isinstance(extra, Mapping) and "unit" in extra:
        return str(extra["unit"])
    ends = [end for end in _UNITS if f"_{key}".endswith(end)]
    return _UNITS[max(ends, key=len)] if ends else ""


def range_of(field: FieldInfo) -> str:
    """The values that a field takes: its bounds, or its choices (a text's as it names them itself,
    `json_schema_extra={"values": ...}`); "" where there is nothing to say."""
    choices = choices_of(field.annotation) or _named_values(field)
    if choices:
        return ", ".join(choices)
    low = next((f"above {short(c.gt)}" for c in field.metadata if getattr(c, "gt", None) is not None), "")
    low = low or next((short(c.ge) for c in field.metadata if getattr(c, "ge", None) is not None), "")
    high = next((f"below {short(c.lt)}" for c in field.metadata if getattr(c, "lt", None) is not None), "")
    high = high or next((short(c.le) for c in field.metadata if getattr(c, "le", None) is not None), "")
    if low and high:
        return f"{low} to {high}"
    if low:
        return low if low.startswith("above") else f"from {low}"
    if high:
        return high if high.startswith("below") else f"up to {high}"
    longest = next((c.max_length for c in field.metadata if getattr(c, "max_length", None) is not None), None)
    return "" if longest is None else f"at most {longest} long"


def _named_values(field: FieldInfo) -> tuple[str, ...]:
    extra = field.json_schema_extra
    named = extra.get("values", ()) if isinstance(extra, Mapping) else ()
    return tuple(map(str, named)) if isinstance(named, list) else ()


def section_of(field: FieldInfo) -> type[BaseModel] | None:
    """The section that a field holds, once or any number of times, or may hold; None for a plain key."""
    kind = typing.get_args(field.annotation)[0] if holds_many(field) else _plain(field.annotation)
    return kind if isinstance(kind, type) and issubclass(kind, BaseModel) else None


def holds_many(field: FieldInfo) -> bool:
    """Whether a field is a list of any length: of sections, that is `[[section]]` in the file."""
    kind = field.annotation
    return typing.get_origin(kind) is tuple and typing.get_args(kind)[1:] == (Ellipsis,)


REQUIRED = object()


def default_of(key: str, field: FieldInfo, defaults: object) -> object:
    """The value that a key has when it is left out: that of the table's own default, if that has one."""
    if isinstance(defaults, BaseModel):
        return getattr(defaults, key)
    return REQUIRED if field.is_required() else field.get_default(call_default_factory=True)


def written(value: object) -> str:
    """A default as TOML writes it."""
    if value is REQUIRED or value is None:
        return "required" if value is REQUIRED else ""
    match value:
        case enum.Enum() | Path() | str():
            text = value.value if isinstance(value, enum.Enum) else value
            return f'"{text}"'
        case bool():
            return "true" if value else "false"
        case float() | int():
            return short(value)
        case list() | tuple():
            return f"[{', '.join(map(written, value))}]"
        case _:
            return str(value)


def short(value: float) -> str:
    """As short as six digits tell it."""
    return str(value) if isinstance(value, int) or math.isinf(value) else f"{value:.6g}"


def type_of(kind: Any) -> str:
    """A key's type in words of the file's format."""
    kind = _plain(kind)
    names = {bool: "true or false", int: "whole number", float: "number", str: "text", Path: "path"}
    if kind in names:
        return names[kind]
    if choices_of(kind):
        return "choice"
    if typing.get_origin(kind) is tuple:
        items = typing.get_args(kind)
        inner = type_of(items[0]).replace("whole number", "number")
        return f"list of {inner}" if items[-1] is Ellipsis else f"list of {len(items)} {inner}s"
    return getattr(kind, "__name__", str(kind))


def choices_of(kind: Any) -> tuple[str, ...]:
    """What an enum or a literal can be; empty for anything else."""
    kind = _plain(kind)
    if typing.get_origin(kind) is Literal:
        return tuple(map(str, typing.get_args(kind)))
    if isinstance(kind, type) and issubclass(kind, enum.Enum):
        return tuple(str(choice.value) for choice in kind)
    return ()


def _plain(kind: Any) -> Any:
    """The type without `Annotated` and `| None`."""
    if typing.get_origin(kind) is typing.Annotated:
        return _plain(typing.get_args(kind)[0])
    if typing.get_origin(kind) in {Union, types.UnionType}:
        kinds = [inner for inner in typing.get_args(kind) if inner is not type(None)]
        return _plain(kinds[0]) if len(kinds) == 1 else kind
    return kind
