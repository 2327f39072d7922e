"""A site file with its lines elsewhere: the numbers change, comments and order stay."""

from __future__ import annotations

from collections.abc import Mapping

import tomlkit
from tomlkit.items import Array, Item

from flightd.site.site import Aisle


def with_aisles(text: str, aisles: Mapping[str, Aisle]) -> str:
    """The text of a sound site file in which the aisles of those names begin at, and have the spacings of,
    those given."""
    document = tomlkit.parse(text)
    for table in document["aisle"]:  # a sound file has a list of tables here
        aisle = aisles.get(str(table["id"]))
        if aisle is not None:
            _change(table, "x_m", aisle.x_m)
            _change(table, "y_m", aisle.y_m)
            _spaced(table["spacing_m"], aisle.spacing_m)
    return tomlkit.dumps(document)


def _change(table: Item, key: str, value: float) -> None:
    if float(table[key]) != value:  # type: ignore[index]
        old = table[key]  # type: ignore[index]
        new = tomlkit.item(value)
        new.trivia.indent, new.trivia.comment_ws = old.trivia.indent, old.trivia.comment_ws
        new.trivia.comment, new.trivia.trail = old.trivia.comment, old.trivia.trail
        table[key] = new  # type: ignore[index]


def _spaced(old: Array, spacing_m: tuple[float, ...]) -> None:
    """In place, so that comments between the numbers stay."""
    for i, step_m in enumerate(spacing_m):
        if float(old[i]) != step_m:
            old[i] = step_m
