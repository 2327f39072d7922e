"""A map as a table: a row for each node with its place, the nodes of other aisles that it is joined to, and
the pad that lies on it.  One-way and blocked lines, racks, keep-outs and markers are not in it."""

from __future__ import annotations

import csv
import io
import itertools
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from flightd.core.csv_text import inert
from flightd.core.errors import InputError
from flightd.site.exchange.graph import Graph, Imported, PadAt, site_tables
from flightd.site.site import Site

COLUMNS: Final = ("node", "x_m", "y_m", "joined_to", "pad")
_NAMES: Final = {
    "node": {"node", "nodeid", "id", "name", "knoten"},
    "x_m": {"x", "xm"},
    "y_m": {"y", "ym"},
    "joined_to": {"joinedto", "joined", "cross", "crosses"},
    "pad": {"pad", "charger"},
}
_LETTERS: Final = re.compile(r"([A-Z]{1,3})\d+")
_SAME_M: Final = 0.05


def nodes_csv(site: Site) -> str:
    """Every node of a site."""
    joined: dict[str, list[str]] = {}
    for edge in site.crosses:
        joined.setdefault(edge.a, []).append(edge.b)
    pads = {pad.node: pad.id for pad in site.pads}
    rows = (
        (
            node.id,
            round(node.x_m, 6),
            round(node.y_m, 6),
            " ".join(joined.get(node.id, ())),
            pads.get(node.id, ""),
        )
        for node in site.nodes.values()
    )
    return _csv(COLUMNS, rows)


def locations_csv(site: Site) -> str:
    """Every location of a site with its place."""
    columns = ("location", "aisle", "side", "bay", "level", "position", "x_m", "y_m", "height_m", "node")
    rows = (
        (
            place.code, place.aisle, place.side.value, place.bay, place.level, place.position,
            round(place.x_m, 6), round(place.y_m, 6), round(place.height_m, 6), place.node,
        )
        for place in site.locations.values()
    )  # fmt: skip
    return _csv(columns, rows)


def _csv(columns: Sequence[str], rows: Iterator[tuple[str | float, ...]]) -> str:
    out = io.StringIO(newline="")
    writer = csv.writer(out)
    writer.writerow(columns)
    # a number's minus is no formula; a text's is
    writer.writerows([inert(cell) if isinstance(cell, str) else cell for cell in row] for row in rows)
    return out.getvalue()


def tables_of_rows(rows: Sequence[Sequence[str]]) -> Imported:
    """The tables of a site file from such a table, its heading first.  InputError naming the row."""
    columns = _columns(rows[0]) if rows else {}
    missing = [name for name in ("node", "x_m", "y_m") if name not in columns]
    if missing:
        raise InputError(
            f"the first row names no column {missing[0]!r}", remedy=f"head the table {', '.join(COLUMNS)}"
        )
    nodes: dict[str, tuple[float, float]] = {}
    pads: dict[str, PadAt] = {}
    joins: list[tuple[int, str, str]] = []
    for number, row in enumerate(rows[1:], start=2):
        cells = {name: row[column].strip() for name, column in columns.items() if column < len(row)}
        node = cells.get("node", "")
        if not node:
            raise InputError(f"row {number}: no node")
        if node in nodes:
            raise InputError(f"row {number}: node {node!r} comes twice")
        nodes[node] = _metres(cells, "x_m", number), _metres(cells, "y_m", number)
        if cells.get("pad"):
            pads[node] = PadAt(cells["pad"])
        joins += [
            (number, node, other) for other in re.split(r"[\s,;|]+", cells.get("joined_to", "")) if other
        ]
    for number, _, other in joins:
        if other not in nodes:
            raise InputError(f"row {number}: joined to {other!r}, of which there is no row")
    aisles = _aisles(nodes)
    pairs = [pair for aisle in aisles for pair in itertools.pairwise(aisle)]
    pairs += [(a, b) for _, a, b in joins]
    notes: tuple[str, ...] = ()
    if "joined_to" not in columns:
        pairs += _end_crosses(nodes, aisles)
        notes = ("no column joined_to: neighbouring aisles are joined at the ends that lie side by side",)
    ways = dict.fromkeys((*pairs, *((b, a) for a, b in pairs)))
    found = site_tables(Graph("imported", nodes, ways, pads))
    return Imported(found.tables, (*found.notes, *notes))


def _columns(heading: Sequence[str]) -> dict[str, int]:
    plain = [re.sub(r"[^a-z]", "", cell.lower()) for cell in heading]
    return {
        name: next(i for i, cell in enumerate(plain) if cell in known)
        for name, known in _NAMES.items()
        if any(cell in known for cell in plain)
    }


def _metres(cells: Mapping[str, str], name: str, row: int) -> float:
    text = cells.get(name, "")
    try:
        value = float(text.replace(",", ".") if "." not in text else text)
    except ValueError:
        value = math.nan
    if not abs(value) <= 10_000:
        raise InputError(f"row {row}: {name} is {text!r}, no number of metres up to 10,000")
    return value


def _aisles(nodes: Mapping[str, tuple[float, float]]) -> list[list[str]]:
    """Nodes of one aisle by rising x: of the same letters, or, where names tell nothing, of the same y."""
    letters = {node: _LETTERS.fullmatch(node) for node in nodes}
    groups: dict[str | float, list[str]] = {}
    if all(letters.values()):
        for node, match in letters.items():
            groups.setdefault(match[1] if match else "", []).append(node)
    else:
        line_m = -math.inf
        for node in sorted(nodes, key=lambda node: nodes[node][1]):
            if nodes[node][1] > line_m + _SAME_M:
                line_m = nodes[node][1]
            groups.setdefault(line_m, []).append(node)
    return [sorted(group, key=lambda node: nodes[node][0]) for group in groups.values()]


def _end_crosses(
    nodes: Mapping[str, tuple[float, float]], aisles: Sequence[Sequence[str]]
) -> Iterator[tuple[str, str]]:
    by_y = sorted(aisles, key=lambda aisle: nodes[aisle[0]][1])
    for one, other in itertools.pairwise(by_y):
        for end in (0, -1):
            if abs(nodes[one[end]][0] - nodes[other[end]][0]) <= _SAME_M:
                yield one[end], other[end]
