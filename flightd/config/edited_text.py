"""A configuration's text with some keys changed: comments, order and everything else stay."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError

from flightd.config.remote_change import Value, proposed
from flightd.core.errors import InputError


def edited(text: str, changes: Mapping[str, Value]) -> str:
    """The text of a TOML file with these keys at their new values.  InputError where the file is written in a
    way that cannot be edited without changing more: what comes out is read back and compared."""
    wanted = proposed(tomllib.loads(text), changes)
    try:
        document = tomlkit.parse(text)
        for name, value in changes.items():
            _change(document, name.split("."), value)
        new = tomlkit.dumps(document)
        reads = tomllib.loads(new)
    except (TOMLKitError, tomllib.TOMLDecodeError, ValueError, KeyError, TypeError) as err:
        raise InputError(_too_odd(), remedy=_BY_HAND) from err
    if _without_empty(reads) != _without_empty(wanted):
        raise InputError(_too_odd(), remedy=_BY_HAND)
    return new


_BY_HAND = "change it by hand, on the drone"


def _too_odd() -> str:
    return "the file is written in a way that cannot be edited for you"


def _change(table: Any, parts: list[str], value: Value) -> None:
    *sections, key = parts
    for part in sections:
        if part not in table:
            if value is None:
                return
            table[part] = tomlkit.table()
        table = table[part]
    if value is None:
        if key in table:
            del table[key]
        return
    new = tomlkit.item(list(value) if isinstance(value, list | tuple) else value)
    if key in table and hasattr(table[key], "trivia"):
        old = table[key].trivia
        new.trivia.indent, new.trivia.comment_ws = old.indent, old.comment_ws
        new.trivia.comment, new.trivia.trail = old.comment, old.trail
    table[key] = new


def _without_empty(table: Mapping[str, Any]) -> dict[str, Any]:
    """A table that holds nothing says nothing."""
    inner = {key: _without_empty(value) if isinstance(value, dict) else value for key, value in table.items()}
    return {key: value for key, value in inner.items() if value != {}}
