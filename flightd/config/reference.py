"""Every key of the configuration as a row of its reference: type, unit, range, default, what it means.

The rows are read off the sections themselves, so that the guide's page, the tests and the error messages
cannot say anything else than what is checked.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from pydantic import BaseModel

from flightd.config.keys import default_of, holds_many, range_of, section_of, type_of, unit_of, written
from flightd.config.schema import Config


class Row(NamedTuple):
    """One key.  `section` is its table in the file (`control.horizontal`), `range` the values that are
    taken ("" where any is), `default` as it is written in the file ("required" where it must be given,
    "" where it is left out)."""

    section: str
    key: str
    type: str
    unit: str
    range: str
    default: str
    description: str

    @property
    def name(self) -> str:
        """The key with its table, as in error messages."""
        return f"{self.section}.{self.key}"


class Table(NamedTuple):
    """One table of the file, with what its section says of itself; `repeated`: there may be several."""

    name: str
    description: str
    repeated: bool = False


def rows(model: type[BaseModel] = Config) -> list[Row]:
    """Every key of every table, expert tables included, in the order of the sections."""
    return [
        Row(
            section,
            key,
            type_of(field.annotation),
            unit_of(key, field),
            range_of(field),
            written(default),
            field.description or "",
        )
        for section, table, defaults, _ in _tables(model)
        for key, field in table.model_fields.items()
        if section_of(field) is None
        for default in (default_of(key, field, defaults),)
    ]


def tables(model: type[BaseModel] = Config) -> list[Table]:
    """Every table with its first paragraph of documentation."""
    return [
        Table(name, " ".join((table.__doc__ or "").strip().split("\n\n")[0].split()), repeated)
        for name, table, _, repeated in _tables(model)
    ]


def _tables(
    model: type[BaseModel], prefix: str = "", default: object = None
) -> Iterator[tuple[str, type[BaseModel], object, bool]]:
    """Name, section, defaults of each table and whether it may be repeated, parents first; the top level has
    no name."""
    for key, field in model.model_fields.items():
        section = section_of(field)
        if section is not None:
            name = f"{prefix}.{key}" if prefix else key
            inner = default_of(key, field, default)
            yield name, section, inner, holds_many(field)
            yield from _tables(section, name, inner)
