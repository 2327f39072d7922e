"""The tables of a site file: their keys with ranges, the site that they make, and what is wrong with them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Final, cast

from pydantic import AfterValidator, Field, ValidationError
from pydantic_core import ErrorDetails

from flightd.config.section import Section
from flightd.core.markers import MarkerDictionary
from flightd.core.paint import NAMED_PAINTS, checked_paint
from flightd.site.layout import LayoutError, lay_out
from flightd.site.site import Aisle, Marker, Pad, PadSign, Rack, Side, Site
from flightd.site.ways import KeepOut, OneWay

_Metres = Annotated[float, Field(gt=0, le=1000, allow_inf_nan=False)]
_Coordinate = Annotated[float, Field(ge=-10_000, le=10_000, allow_inf_nan=False)]


_PadOffset = Annotated[float, Field(ge=-0.5, le=0.5, allow_inf_nan=False)]


class _SiteTable(Section):
    name: str = Field(min_length=1, max_length=80)
    line_width_m: float = Field(0.075, ge=0.05, le=0.10)
    line_colour: Annotated[str, AfterValidator(checked_paint)] = Field(
        "yellow", json_schema_extra={"values": [*NAMED_PAINTS, "#rrggbb"]}
    )
    ceiling_m: float | None = Field(None, gt=0, le=1000, allow_inf_nan=False)
    interlock: bool = False
    unattended_start: bool = False


class _AisleTable(Section):
    id: str = Field(pattern=r"^[A-Z]{1,3}$")
    x_m: _Coordinate
    y_m: _Coordinate
    spacing_m: tuple[_Metres, ...] = Field(min_length=1, max_length=1000)
    cross_half_m: _Metres = 0.5
    overrun_m: float = Field(0.4, ge=0, le=10)
    shelves: tuple[Side, ...] = (Side.LEFT, Side.RIGHT)
    shelf_distance_m: _Metres = 1.2
    shelf_height_m: _Metres = 3.0
    one_way: OneWay | None = None


class _CrossTable(Section):
    nodes: tuple[str, str]
    one_way: bool = False


class _BlockedTable(Section):
    nodes: tuple[str, str]


class _KeepOutTable(Section):
    x0_m: _Coordinate
    y0_m: _Coordinate
    x1_m: _Coordinate
    y1_m: _Coordinate
    from_m: float = Field(0.0, ge=0, le=100)
    to_m: float | None = Field(None, gt=0, le=100, allow_inf_nan=False)

    def area(self) -> KeepOut:
        to_m = math.inf if self.to_m is None else self.to_m
        return KeepOut(self.x0_m, self.y0_m, self.x1_m, self.y1_m, self.from_m, to_m)


class _RackTable(Section):
    aisles: tuple[str, ...] | None = Field(None, min_length=1)
    sides: tuple[Side, ...] = Field((Side.LEFT, Side.RIGHT), min_length=1)
    bay_width_m: float = Field(ge=0.2, le=50)
    levels_m: tuple[Annotated[float, Field(ge=0, le=100, allow_inf_nan=False)], ...] = Field(
        min_length=1, max_length=100
    )
    positions: int = Field(1, ge=1, le=100)
    pattern: str = Field("{aisle}{side}-{bay:02}-{level}-{position}", min_length=1, max_length=100)
    deck_below_label_m: float | None = Field(None, ge=0, le=10)
    pallets_deep: int = Field(1, ge=1, le=50)


class _PadTable(Section):
    id: str = Field(min_length=1, max_length=40)
    node: str
    size_m: float = Field(0.5, ge=0.2, le=3)
    start: bool = True
    charge: bool = True
    offset_m: tuple[_PadOffset, _PadOffset] = (0.0, 0.0)
    sign: PadSign = PadSign.MAT
    shared: bool = False


class _MarkerTable(Section):
    id: int = Field(ge=0, le=10_000)
    dictionary: MarkerDictionary
    x_m: _Coordinate
    y_m: _Coordinate
    size_m: float = Field(0.2, ge=0.03, le=2)
    yaw_deg: float = Field(0.0, ge=-180, le=180)

    def marker(self) -> Marker:
        turned = math.radians(round(self.yaw_deg, 9))
        return Marker(self.id, self.dictionary, self.x_m, self.y_m, self.size_m, turned)


class SiteFile(Section):
    """The whole file, as it is written."""

    site: _SiteTable
    aisle: tuple[_AisleTable, ...] = Field(min_length=1)
    cross: tuple[_CrossTable, ...] = ()
    blocked: tuple[_BlockedTable, ...] = ()
    keep_out: tuple[_KeepOutTable, ...] = ()
    rack: tuple[_RackTable, ...] = ()
    pad: tuple[_PadTable, ...] = Field(min_length=1)
    marker: tuple[_MarkerTable, ...] = Field((), max_length=1000)


_TABLES: Final[Mapping[str, type[Section]]] = {
    "site": _SiteTable,
    "aisle": _AisleTable,
    "cross": _CrossTable,
    "blocked": _BlockedTable,
    "keep_out": _KeepOutTable,
    "rack": _RackTable,
    "pad": _PadTable,
    "marker": _MarkerTable,
}
LISTS: Final = tuple(name for name in _TABLES if name != "site")
"""The tables that a file may have several of, in the order in which they are written."""
_KEY: Final = re.compile(r"(?P<table>\w+)(\[(?P<index>\d+)\])?( \((?P<id>[^)]*)\))?(\.(?P<field>\w+))?")


@dataclass(frozen=True, slots=True)
class SiteMistake:
    """What is wrong, in the words of the file, and where: `table` (empty: nowhere in particular), which one
    (None: none in particular) and its `field` (empty: the whole)."""

    key: str
    problem: str
    table: str = ""
    index: int | None = None
    field: str = ""

    def __str__(self) -> str:
        return f"{self.key}: {self.problem}"


class SiteTablesError(ValueError):
    """The tables make no site; `mistakes` says why, at least once, the most helpful first."""

    def __init__(self, mistakes: Sequence[SiteMistake]) -> None:
        super().__init__(str(mistakes[0]))
        self.mistakes = tuple(mistakes)


def known_keys(table: str) -> tuple[str, ...]:
    """The keys of a table, in the order in which they are written."""
    return tuple(_TABLES[table].model_fields)


def site_of(tables: Mapping[str, Any]) -> Site:
    """The site that the tables of a file make.  SiteTablesError where they make none."""
    try:
        file = SiteFile.model_validate(tables)
    except ValidationError as err:
        raise SiteTablesError(_mistakes(err, tables)) from None
    try:
        return lay_out(
            file.site.name,
            [Aisle(**dict(aisle)) for aisle in file.aisle],
            [cross.nodes for cross in file.cross],
            [Pad(**dict(pad)) for pad in file.pad],
            line_width_m=file.site.line_width_m,
            line_colour=file.site.line_colour,
            ceiling_m=file.site.ceiling_m,
            interlock=file.site.interlock,
            unattended_start=file.site.unattended_start,
            racks=[_rack(rack, file.aisle) for rack in file.rack],
            one_way_crosses=[cross.nodes for cross in file.cross if cross.one_way],
            blocked=[blocked.nodes for blocked in file.blocked],
            keep_outs=[area.area() for area in file.keep_out],
            markers=[marker.marker() for marker in file.marker],
        )
    except LayoutError as err:
        raise SiteTablesError([_located(err.key, err.problem, tables)]) from None


def _rack(table: _RackTable, aisles: tuple[_AisleTable, ...]) -> Rack:
    told = table.aisles
    if told is None:
        told = tuple(aisle.id for aisle in aisles if set(table.sides) <= set(aisle.shelves))
    return Rack(
        told,
        table.bay_width_m,
        table.levels_m,
        table.positions,
        table.sides,
        table.pattern,
        table.deck_below_label_m,
        table.pallets_deep,
    )


def _located(key: str, problem: str, tables: Mapping[str, Any]) -> SiteMistake:
    found = _KEY.match(key)
    if found is None or found["table"] not in _TABLES:
        return SiteMistake(key, problem)
    table, index = found["table"], found["index"]
    if index is None and found["id"] is not None:
        ids = [str(row.get("id")) for row in tables[table]]
        index = ids.index(found["id"]) if found["id"] in ids else None
    return SiteMistake(key, problem, table, None if index is None else int(index), found["field"] or "")


def _mistakes(err: ValidationError, tables: Mapping[str, Any]) -> list[SiteMistake]:
    # a misspelt key also leaves one missing: the misspelling is what helps
    found = sorted(err.errors(), key=lambda mistake: mistake["type"] != "extra_forbidden")
    return [
        _located(_key(one["loc"], tables), _problem(one, _key(one["loc"], tables)), tables) for one in found
    ]


def _problem(mistake: ErrorDetails, key: str) -> str:
    """What is wrong and what to do."""
    match mistake["type"]:
        case "missing":
            return "missing; add it"
        case "extra_forbidden":
            return f"unknown key; known here: {', '.join(_fields(mistake['loc']))}"
        case "string_pattern_mismatch" if key.endswith(".id"):
            return f"{mistake['input']!r}: an aisle's id is one to three capital letters"
        case _:
            given = mistake["input"]
            shown = f" (it is {given!r})" if isinstance(given, str | int | float | bool) else ""
            return f"{mistake['msg'].removeprefix('Value error, ')}{shown}"


def _key(location: tuple[int | str, ...], tables: Mapping[str, Any]) -> str:
    """`aisle[1] (B).spacing_m[0]`: the place as a person finds it in the file."""
    key = ""
    here: Any = tables
    for part in location:
        if isinstance(part, int):
            key += f"[{part}]"
            here = here[part] if isinstance(here, list) and part < len(here) else None
            if isinstance(here, dict) and isinstance(here.get("id"), str):
                key += f" ({here['id']})"
        else:
            key += f".{part}" if key else part
            here = here.get(part) if isinstance(here, dict) else None
    return key


def _fields(location: tuple[int | str, ...]) -> list[str]:
    table = _TABLES[cast("str", location[0])] if len(location) > 1 else SiteFile
    return list(table.model_fields)
