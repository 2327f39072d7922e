"""What is wrong with a value of a configuration, in one line: the key, what was expected, what to do."""

from __future__ import annotations

import difflib
import typing

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from flightd.config.keys import choices_of, range_of, section_of, short, type_of, unit_of, written

_BOUNDS = {"greater_than", "greater_than_equal", "less_than", "less_than_equal", "finite_number"}
_LISTS = {"tuple_type", "list_type"}
_TABLES = {"model_type", "model_attributes_type", "dict_type"}
_WRONG_KINDS = {
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "float_type": "a number",
    "float_parsing": "a number",
    "string_type": 'text in quotes, "..."',
    "path_type": 'a path in quotes, "..."',
}
_EXAMPLES = {"text": '"A2"', "path": '"file"', "number": "0.0", "whole number": "0"}


def complaint(error: ErrorDetails, model: type[BaseModel]) -> str:
    """One mistake that validating a `model` found, as `section.key: what was expected`."""
    loc = error["loc"]
    if loc and isinstance(loc[-1], int) and error["type"] == "missing":
        loc = loc[:-1]  # a list that is too short is wrong as a whole
    place, field = _place(loc, model)
    return f"{place or '(top level)'}: {_remedy(error, field, model)}"


def _remedy(error: ErrorDetails, field: FieldInfo | None, model: type[BaseModel]) -> str:
    kind, loc = error["type"], error["loc"]
    if kind == "extra_forbidden":
        return f"unknown key; {_nearest(loc, model)}"
    if kind in _TABLES:
        return f"expected a table, [{'.'.join(map(str, loc)) or 'mission'}]"
    if field is not None and (expected := _expected(error, field)):
        return expected
    return "is missing; add it" if kind == "missing" else _plain(error["msg"])


def _expected(error: ErrorDetails, field: FieldInfo) -> str:
    """What a key takes in place of what was given; empty where the error itself says it best."""
    kind, key, given = error["type"], error["loc"][-1], error["input"]
    choices, is_item = choices_of(field.annotation), isinstance(key, int)
    unit = unit_of(str(key), field)
    if kind == "too_long" or (kind == "missing" and is_item):
        return f"expected a {type_of(field.annotation)}" if _is_list(field) else ""
    if kind in _BOUNDS and not is_item:
        shown = short(given) if isinstance(given, int | float) else given
        return f"{shown} is outside {range_of(field)}{_with(unit)}"
    if choices:
        return f"expected one of {', '.join(map(written, choices))}"
    if kind in _LISTS:
        return f"expected a list, e.g. {_example(field, given)}"
    wanted = _WRONG_KINDS.get(kind, "")
    in_unit = f" in {unit}" if unit and wanted.endswith("number") else ""
    return f"expected {wanted}{in_unit}" if wanted else ""


def _with(unit: str) -> str:
    """A unit after a number: its sign, or in words in brackets."""
    in_words = len(unit) > 3 and unit.replace(" ", "").isalpha()
    return f" ({unit})" if in_words else f" {unit}".rstrip()


def _is_list(field: FieldInfo) -> bool:
    return type_of(field.annotation).startswith("list")


def _place(loc: tuple[int | str, ...], model: type[BaseModel]) -> tuple[str, FieldInfo | None]:
    """The key as a person finds it in the file (`mission.nodes[0]`), and its field."""
    place, field, section = "", None, model
    for part in loc:
        if isinstance(part, int):
            place += f"[{part}]"
            continue
        place = f"{place}.{part}" if place else part
        field = section.model_fields.get(part)
        section = (section_of(field) if field is not None else None) or section
    return place, field


def _nearest(loc: tuple[int | str, ...], model: type[BaseModel]) -> str:
    """What may have been meant by a key that its section does not know."""
    section = model
    for part in loc[:-1]:
        field = section.model_fields.get(str(part))
        section = (section_of(field) if field is not None else None) or section
    near = difflib.get_close_matches(str(loc[-1]), section.model_fields, n=1)
    return f"did you mean {near[0]}?" if near else "take it out or correct its spelling"


def _example(field: FieldInfo, given: object) -> str:
    """A list such as the field takes, made of what was given if that fits."""
    items = typing.get_args(field.annotation)
    kind = type_of(items[0]) if items else "text"
    if isinstance(given, str) and kind in {"text", "path"}:
        return written([given])
    count = 1 if not items or items[-1] is Ellipsis else len(items)
    return f"[{', '.join([_EXAMPLES.get(kind, '...')] * count)}]"


def _plain(message: str) -> str:
    message = message.removeprefix("Value error, ")
    return message[:1].lower() + message[1:]
