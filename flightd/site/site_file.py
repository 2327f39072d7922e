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

    [[keep_out]]                 # no line within 0.6 m of this rectangle is flown
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
    pallets_deep = 1             # pallets behind one another in each place; the camera sees the first alone

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

import math
import tomllib
from pathlib import Path

from flightd.core.errors import InputError
from flightd.site.file_blocks import quoted
from flightd.site.site import PadSign, Site
from flightd.site.site_tables import SiteTablesError, site_of


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
        return site_of(tables)
    except SiteTablesError as err:
        raise InputError(f"{source}: {err}") from None


def site_toml(site: Site) -> str:
    """The site as a site file; `parse_site` makes an equal site of it."""
    parts = [
        "[site]",
        f"name = {quoted(site.name)}",
        f"line_width_m = {site.line_width_m!r}",
        f"line_colour = {quoted(site.line_colour)}",
    ]
    if site.ceiling_given:
        parts.append(f"ceiling_m = {site.ceiling_m!r}")
    if site.interlock:
        parts.append("interlock = true")
    if site.unattended_start:
        parts.append("unattended_start = true")
    for aisle in site.aisles:
        parts += ["", "[[aisle]]", f"id = {quoted(aisle.id)}"]
        parts += [f"x_m = {aisle.x_m!r}", f"y_m = {aisle.y_m!r}"]
        parts += [f"spacing_m = [{', '.join(map(repr, aisle.spacing_m))}]"]
        parts += [f"cross_half_m = {aisle.cross_half_m!r}", f"overrun_m = {aisle.overrun_m!r}"]
        parts += [f"shelves = [{', '.join(map(quoted, aisle.shelves))}]"]
        parts += [f"shelf_distance_m = {aisle.shelf_distance_m!r}"]
        parts += [f"shelf_height_m = {aisle.shelf_height_m!r}"]
        parts += [f"one_way = {quoted(aisle.one_way)}"] if aisle.one_way else []
    for cross in site.crosses:
        parts += ["", "[[cross]]", f"nodes = [{quoted(cross.a)}, {quoted(cross.b)}]"]
        parts += ["one_way = true"] if cross.one_way else []
    for a, b in site.blocked:
        parts += ["", "[[blocked]]", f"nodes = [{quoted(a)}, {quoted(b)}]"]
    for area in site.keep_outs:
        parts += ["", "[[keep_out]]", f"x0_m = {area.x0_m!r}", f"y0_m = {area.y0_m!r}"]
        parts += [f"x1_m = {area.x1_m!r}", f"y1_m = {area.y1_m!r}", f"from_m = {area.from_m!r}"]
        parts += [f"to_m = {area.to_m!r}"] if math.isfinite(area.to_m) else []
    for rack in site.racks:
        parts += ["", "[[rack]]", f"aisles = [{', '.join(map(quoted, rack.aisles))}]"]
        parts += [f"sides = [{', '.join(map(quoted, rack.sides))}]", f"bay_width_m = {rack.bay_width_m!r}"]
        parts += [f"levels_m = [{', '.join(map(repr, rack.levels_m))}]", f"positions = {rack.positions}"]
        parts += [f"pattern = {quoted(rack.pattern)}"]
        if rack.deck_below_label_m is not None:
            parts += [f"deck_below_label_m = {rack.deck_below_label_m!r}"]
        parts += [f"pallets_deep = {rack.pallets_deep}"] if rack.pallets_deep > 1 else []
    for pad in site.pads:
        parts += ["", "[[pad]]", f"id = {quoted(pad.id)}", f"node = {quoted(pad.node)}"]
        parts += [f"size_m = {pad.size_m!r}"]
        parts += [f"offset_m = [{pad.offset_m[0]!r}, {pad.offset_m[1]!r}]"] if any(pad.offset_m) else []
        parts += [f'sign = "{pad.sign}"'] if pad.sign is not PadSign.MAT else []
        parts += [f"{key} = false" for key, on in (("start", pad.start), ("charge", pad.charge)) if not on]
        parts += ["shared = true"] if pad.shared else []
    for marker in site.markers:
        parts += ["", "[[marker]]", f"id = {marker.id}", f"dictionary = {quoted(marker.dictionary)}"]
        parts += [f"x_m = {marker.x_m!r}", f"y_m = {marker.y_m!r}", f"size_m = {marker.size_m!r}"]
        parts += [f"yaw_deg = {round(math.degrees(marker.yaw_rad), 9)!r}"]
    return "\n".join(parts) + "\n"
