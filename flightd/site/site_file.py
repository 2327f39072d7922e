"""Site files: the warehouse map as TOML, read with every mistake named, and written back.

    [site]
    name = "demo"                # any text
    line_width_m = 0.075         # 0.05..0.10
    line_colour = "yellow"       # yellow, white, red, blue, green, black, orange, or a tone: "#e0521a"
    ceiling_m = 6.0

    [[aisle]]                    # one straight line along x
    id = "A"                     # its nodes are A1, A2, …
    x_m = 0.0                    # first node
    y_m = 0.0
    spacing_m = [1.5, 1.8]       # to each next node: n distances, n + 1 nodes
    cross_half_m = 0.5           # painted half-length of each node's own cross line
    overrun_m = 0.4              # how far the line runs past its end nodes
    shelves = ["left", "right"]  # seen along +x
    shelf_distance_m = 1.2       # from the line to the shelf front
    shelf_height_m = 3.0
    one_way = "+x"               # or "-x": flown in this direction only; left out: both

    [[cross]]                    # a painted line between two aisles, at right angles to both
    nodes = ["A1", "B1"]
    one_way = false              # true: flown from the first node to the second only

    [[blocked]]                  # a line that is not flown at all, for as long as it stands here
    nodes = ["A2", "A3"]

    [[keep_out]]                 # nothing flies within 0.3 m of this rectangle of the floor
    x0_m = 4.0
    y0_m = -0.5
    x1_m = 5.0
    y1_m = 0.5
    from_m = 0.0                 # heights, both may be left out: from the floor to the ceiling
    to_m = 2.5

    [[rack]]                     # divides shelf fronts into bays, levels and places; may be left out
    aisles = ["A"]               # left out: every aisle with a shelf on these sides
    sides = ["left", "right"]
    bay_width_m = 1.35           # as many bays as fit stand in the middle of each front
    levels_m = [0.3, 1.5]        # heights of the labels, from the floor up
    deck_below_label_m = 0.4     # from the labels down to what goods stand on; left out: 2/5 of the spacing
    positions = 2                # places in each bay on each level
    pattern = "{aisle}{side}-{bay:02}-{level}-{position}"  # location codes: AL-01-2-1

    [[pad]]
    id = "home"                  # missions start and end here; without it, at the first to start from
    node = "A1"
    size_m = 0.5
    start = true                 # missions may start here
    charge = true                # batteries are changed or charged here
    offset_m = [0.0, 0.0]        # of its centre from the node, where it does not lie on it
    sign = "mat"                 # or "line_end": no mat; it lies from the painted end near it as on this map

    [[marker]]                   # a printed floor marker by which the place is known; may be left out
    id = 7
    dictionary = "4x4_50"        # or 4x4_250, 5x5_100, 6x6_250, apriltag_16h5, apriltag_36h11; one a site
    x_m = 1.5                    # its centre, beside the paint
    y_m = 0.4
    size_m = 0.2                 # of the black square; a pale rim a module wide around it
    yaw_deg = 0.0                # of its upper edge against x, clockwise from above

Map frame: x along the aisles, y to the right of x seen from above, metres.
"""

from __future__ import annotations

import json
import math
import tomllib
from pathlib import Path
from typing import Annotated, Any, cast

from pydantic import AfterValidator, Field, ValidationError

from flightd.config.section import Section
from flightd.core.errors import InputError
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


class _PadTable(Section):
    id: str = Field(min_length=1, max_length=40)
    node: str
    size_m: float = Field(0.5, ge=0.2, le=3)
    start: bool = True
    charge: bool = True
    offset_m: tuple[_PadOffset, _PadOffset] = (0.0, 0.0)
    sign: PadSign = PadSign.MAT


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


def load_site(path: Path) -> Site:
    """Read a site file.  Raises InputError naming the file, the key and what to do."""
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as err:
        raise InputError(f"{path}: cannot read the site file: {err.strerror or err}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: not a UTF-8 text file; a site file is TOML") from None
    return parse_site(text, str(path))


def parse_site(text: str, source: str) -> Site:
    """Make a site from the text of a site file; `source` names it in errors (InputError)."""
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as err:
        raise InputError(f"{source}: not valid TOML: {err}") from None
    try:
        file = SiteFile.model_validate(tables)
    except ValidationError as err:
        raise InputError(f"{source}: {_first_mistake(err, tables)}") from None
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
            racks=[_rack(rack, file.aisle) for rack in file.rack],
            one_way_crosses=[cross.nodes for cross in file.cross if cross.one_way],
            blocked=[blocked.nodes for blocked in file.blocked],
            keep_outs=[area.area() for area in file.keep_out],
            markers=[marker.marker() for marker in file.marker],
        )
    except LayoutError as err:
        raise InputError(f"{source}: {err}") from None


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
    )


def site_toml(site: Site) -> str:
    """The site as a site file; `parse_site` makes an equal site of it."""
    parts = [
        "[site]",
        f"name = {_quoted(site.name)}",
        f"line_width_m = {site.line_width_m!r}",
        f"line_colour = {_quoted(site.line_colour)}",
    ]
    if site.ceiling_given:
        parts.append(f"ceiling_m = {site.ceiling_m!r}")
    if site.interlock:
        parts.append("interlock = true")
    for aisle in site.aisles:
        parts += ["", "[[aisle]]", f"id = {_quoted(aisle.id)}"]
        parts += [f"x_m = {aisle.x_m!r}", f"y_m = {aisle.y_m!r}"]
        parts += [f"spacing_m = [{', '.join(map(repr, aisle.spacing_m))}]"]
        parts += [f"cross_half_m = {aisle.cross_half_m!r}", f"overrun_m = {aisle.overrun_m!r}"]
        parts += [f"shelves = [{', '.join(map(_quoted, aisle.shelves))}]"]
        parts += [f"shelf_distance_m = {aisle.shelf_distance_m!r}"]
        parts += [f"shelf_height_m = {aisle.shelf_height_m!r}"]
        parts += [f"one_way = {_quoted(aisle.one_way)}"] if aisle.one_way else []
    for cross in site.crosses:
        parts += ["", "[[cross]]", f"nodes = [{_quoted(cross.a)}, {_quoted(cross.b)}]"]
        parts += ["one_way = true"] if cross.one_way else []
    for a, b in site.blocked:
        parts += ["", "[[blocked]]", f"nodes = [{_quoted(a)}, {_quoted(b)}]"]
    for area in site.keep_outs:
        parts += ["", "[[keep_out]]", f"x0_m = {area.x0_m!r}", f"y0_m = {area.y0_m!r}"]
        parts += [f"x1_m = {area.x1_m!r}", f"y1_m = {area.y1_m!r}", f"from_m = {area.from_m!r}"]
        parts += [f"to_m = {area.to_m!r}"] if math.isfinite(area.to_m) else []
    for rack in site.racks:
        parts += ["", "[[rack]]", f"aisles = [{', '.join(map(_quoted, rack.aisles))}]"]
        parts += [f"sides = [{', '.join(map(_quoted, rack.sides))}]", f"bay_width_m = {rack.bay_width_m!r}"]
        parts += [f"levels_m = [{', '.join(map(repr, rack.levels_m))}]", f"positions = {rack.positions}"]
        parts += [f"pattern = {_quoted(rack.pattern)}"]
        if rack.deck_below_label_m is not None:
            parts += [f"deck_below_label_m = {rack.deck_below_label_m!r}"]
    for pad in site.pads:
        parts += ["", "[[pad]]", f"id = {_quoted(pad.id)}", f"node = {_quoted(pad.node)}"]
        parts += [f"size_m = {pad.size_m!r}"]
        parts += [f"offset_m = [{pad.offset_m[0]!r}, {pad.offset_m[1]!r}]"] if any(pad.offset_m) else []
        parts += [f'sign = "{pad.sign}"'] if pad.sign is not PadSign.MAT else []
        parts += [f"{key} = false" for key, on in (("start", pad.start), ("charge", pad.charge)) if not on]
    for marker in site.markers:
        parts += ["", "[[marker]]", f"id = {marker.id}", f"dictionary = {_quoted(marker.dictionary)}"]
        parts += [f"x_m = {marker.x_m!r}", f"y_m = {marker.y_m!r}", f"size_m = {marker.size_m!r}"]
        parts += [f"yaw_deg = {round(math.degrees(marker.yaw_rad), 9)!r}"]
    return "\n".join(parts) + "\n"


def _quoted(text: str) -> str:
    # a JSON string is a TOML basic string, but TOML wants the DEL character escaped too
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _first_mistake(err: ValidationError, tables: dict[str, Any]) -> str:
    """The first thing wrong, as `key: what, what to do`."""
    # a misspelt key also leaves one missing: the misspelling is what helps
    first = min(err.errors(), key=lambda mistake: mistake["type"] != "extra_forbidden")
    key = _key(first["loc"], tables)
    match first["type"]:
        case "missing":
            return f"{key}: missing; add it"
        case "extra_forbidden":
            parent = _fields(first["loc"])
            return f"{key}: unknown key; known here: {', '.join(parent)}"
        case "string_pattern_mismatch" if key.endswith(".id"):
            return f"{key}: {first['input']!r}: an aisle's id is one to three capital letters"
        case _:
            given = first["input"]
            shown = f" (it is {given!r})" if isinstance(given, str | int | float | bool) else ""
            return f"{key}: {first['msg'].removeprefix('Value error, ')}{shown}"


def _key(location: tuple[int | str, ...], tables: dict[str, Any]) -> str:
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
    tables: dict[str, type[Section]] = {
        "site": _SiteTable,
        "aisle": _AisleTable,
        "cross": _CrossTable,
        "blocked": _BlockedTable,
        "keep_out": _KeepOutTable,
        "rack": _RackTable,
        "pad": _PadTable,
        "marker": _MarkerTable,
    }
    table = tables[cast(str, location[0])] if len(location) > 1 else SiteFile
    return list(table.model_fields)
