"""JSON has no NaN: a record has null in its place.  Which null was one, the declared types tell."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any, TypeAlias

import msgspec.inspect as declared

_Fill: TypeAlias = Callable[[Any], Any]
"""A JSON value -> the same with NaN where a number stood that was none; what it was given stays as it is."""


def with_nan(value: object, kind: type) -> object:
    """What was recorded of a `kind`, with NaN for null where a number is declared.  Where nothing may
    stand (`float | None`), and where no number is declared, null stays."""
    fill = _fill_of(kind)
    return value if fill is None else fill(value)


@cache
def _fill_of(kind: type) -> _Fill | None:
    return _fill(declared.type_info(kind))


def _fill(info: declared.Type) -> _Fill | None:
    """None: no number is declared in it."""
    fill: _Fill | None = None
    match info:
        case declared.FloatType():
            fill = _number
        case declared.DataclassType(fields=fields) | declared.StructType(fields=fields):
            fill = _fields({field.encode_name: _fill(field.type) for field in fields})
        case declared.DictType(value_type=item):
            fill = _values(_fill(item))
        case declared.CollectionType(item_type=item):
            fill = _items(_fill(item))
        case declared.TupleType(item_types=items):
            fill = _places([_fill(item) for item in items])
        case declared.UnionType(types=types):
            may_be_none = any(isinstance(kind, declared.NoneType) for kind in types)
            fill = _one_of([_fill(kind) for kind in types], may_be_none=may_be_none)
    return fill


def _number(value: Any) -> Any:
    return math.nan if value is None else value


def _fields(parts: dict[str, _Fill | None]) -> _Fill | None:
    numbers = tuple(name for name, part in parts.items() if part is _number)
    others = tuple((name, part) for name, part in parts.items() if part is not None and name not in numbers)
    if not numbers and not others:
        return None

    def fill(value: Any) -> Any:
        if not isinstance(value, dict):
            return value
        filled = value.copy()
        for name in numbers:
            if name in filled and filled[name] is None:
                filled[name] = math.nan
        for name, part in others:
            item = filled.get(name)
            if item is not None:
                filled[name] = part(item)
        return filled

    return fill


def _values(part: _Fill | None) -> _Fill | None:
    if part is None:
        return None
    return lambda value: (
        {key: part(item) for key, item in value.items()} if isinstance(value, dict) else value
    )


def _items(part: _Fill | None) -> _Fill | None:
    if part is None:
        return None
    return lambda value: [part(item) for item in value] if isinstance(value, list) else value


def _places(parts: list[_Fill | None]) -> _Fill | None:
    if not any(parts):
        return None

    def fill(value: Any) -> Any:
        if not isinstance(value, list) or len(value) != len(parts):
            return value
        return [item if part is None else part(item) for item, part in zip(value, parts, strict=True)]

    return fill


def _one_of(parts: list[_Fill | None], *, may_be_none: bool) -> _Fill | None:
    """JSON tells its alternatives apart by their form: each but the right one leaves it as it is."""
    fills = [part for part in parts if part is not None and not (may_be_none and part is _number)]
    if not fills:
        return None

    def fill(value: Any) -> Any:
        if value is None and may_be_none:
            return None
        for part in fills:
            value = part(value)
        return value

    return fill
