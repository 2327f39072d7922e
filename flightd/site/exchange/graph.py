"""Nodes and the ways between them, from whatever program, as the tables of a site file.

Aisles are what edges along x join, crosses are edges along y; what is neither is left out, and said.
"""

from __future__ import annotations

import itertools
import re
import statistics
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from flightd.core.errors import InputError

_STRAIGHT_M: Final = 0.05
"""Nodes that lie so much beside a line are put onto it."""
_TOLD_M: Final = 0.01
_ID: Final = re.compile(r"([A-Z]{1,3})([1-9]\d*)")
_MOST_NODES: Final = 20_000
_LISTED: Final = 6
_LETTERS: Final = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"


@dataclass(frozen=True, slots=True)
class Graph:
    """`nodes` by name (x, y), metres in the frame of a site; `ways` (from, to), each direction by itself; the
    nodes with pads, and the names of those."""

    name: str
    nodes: Mapping[str, tuple[float, float]]
    ways: Collection[tuple[str, str]]
    pads: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Imported:
    """Tables of a site file, and what a person should know of how they came about."""

    tables: dict[str, Any]
    notes: tuple[str, ...]


def site_tables(graph: Graph) -> Imported:
    """The graph as a site file holds it.  InputError where there is no line along x in it."""
    if len(graph.nodes) > _MOST_NODES:
        raise InputError(f"more than {_MOST_NODES} nodes")
    notes: list[str] = []
    graph = _turned(graph, notes)
    along, across, askew = _sorted_ways(graph)
    if askew:
        notes.append(f"neither along x nor along y, left out: {_listed([f'{a} to {b}' for a, b in askew])}")
    rows, alone = _rows(graph, along)
    if not rows:
        raise InputError("no two nodes are joined by a line along x: there is no aisle")
    if alone:
        notes.append(f"on no line along x, left out: {_listed(alone)}")
    named = list(zip(_names(rows), rows, strict=True))
    renamed = {old: f"{aisle}{i}" for aisle, row in named for i, old in enumerate(row, 1)}
    other = [f"{old} = {new}" for old, new in renamed.items() if old != new]
    if other:
        notes.append(f"nodes are named by their aisles: {_listed(other)}")
    pads = {graph.pads[node]: renamed[node] for node in graph.pads if node in renamed}
    if not pads:
        pads = {"home": f"{named[0][0]}1"}
        notes.append(f"no charger is told: the pad is put at {pads['home']}")
    if "home" not in pads:
        notes.append(f"missions start at the pad {next(iter(pads))}, unless one is called home")
    tables = {
        "site": {"name": graph.name[:80] or "imported"},
        "aisle": [_aisle(graph, name, row, along, notes) for name, row in named],
        "cross": list(_crosses(across, renamed)),
        "pad": [{"id": pad[:40], "node": node} for pad, node in pads.items()],
    }
    return Imported(tables, tuple(notes))


def _turned(graph: Graph, notes: list[str]) -> Graph:
    """With most of its ways along x: a site's aisles lie so."""
    along, across, _ = _sorted_ways(graph)
    if len(across) <= len(along):
        return graph
    notes.append("most lines ran along y: the map is turned by a quarter, x is the old y")
    nodes = {node: (-y, x) for node, (x, y) in graph.nodes.items()}
    return Graph(graph.name, nodes, graph.ways, graph.pads)


def _sorted_ways(
    graph: Graph,
) -> tuple[set[tuple[str, str]], list[tuple[str, str]], list[tuple[str, str]]]:
    """The ways along x, along y and neither."""
    along: set[tuple[str, str]] = set()
    across: list[tuple[str, str]] = []
    askew: list[tuple[str, str]] = []
    for a, b in dict.fromkeys(graph.ways):
        (ax, ay), (bx, by) = graph.nodes[a], graph.nodes[b]
        if abs(ay - by) <= _STRAIGHT_M < abs(ax - bx):
            along.add((a, b))
        elif abs(ax - bx) <= _STRAIGHT_M < abs(ay - by):
            across.append((a, b))
        else:
            askew.append((a, b))
    return along, across, askew


def _rows(graph: Graph, along: Collection[tuple[str, str]]) -> tuple[list[list[str]], list[str]]:
    """What the ways along x join, each by rising x, from left to right; and the nodes on none."""
    onward: dict[str, list[str]] = {}
    for a, b in along:
        onward.setdefault(a, []).append(b)
        onward.setdefault(b, []).append(a)
    rows: list[list[str]] = []
    met: set[str] = set()
    for node in graph.nodes:
        if node in met or node not in onward:
            continue
        row, pending = [], [node]
        met.add(node)
        while pending:
            here = pending.pop()
            row.append(here)
            new = [there for there in dict.fromkeys(onward[here]) if there not in met]
            met.update(new)
            pending += new
        rows.append(sorted(row, key=lambda one: graph.nodes[one][0]))
    rows.sort(key=lambda row: (round(_line_y_m(graph, row), 3), graph.nodes[row[0]][0]))
    return rows, [node for node in graph.nodes if node not in onward]


def _line_y_m(graph: Graph, row: Sequence[str]) -> float:
    return round(statistics.median(graph.nodes[node][1] for node in row), 6)


def _names(rows: Sequence[Sequence[str]]) -> list[str]:
    """Each aisle keeps the letters by which its nodes go already, A1 to A7; others get free ones."""
    own = [_own_name(row) for row in rows]
    free = (
        "".join(letters)
        for size in (1, 2, 3)
        for letters in itertools.product(_LETTERS, repeat=size)
        if "".join(letters) not in own
    )
    taken: set[str] = set()
    names = []
    for name in own:
        kept = name if name is not None and name not in taken else next(free)
        taken.add(kept)
        names.append(kept)
    return names


def _own_name(row: Sequence[str]) -> str | None:
    parts = [_ID.fullmatch(node) for node in row]
    if not all(part is not None and int(part[2]) == i for i, part in enumerate(parts, 1)):
        return None
    letters = {part[1] for part in parts if part is not None}
    return letters.pop() if len(letters) == 1 else None


def _aisle(
    graph: Graph, name: str, row: Sequence[str], along: Collection[tuple[str, str]], notes: list[str]
) -> dict[str, Any]:
    y_m = _line_y_m(graph, row)
    off_m = max(abs(graph.nodes[node][1] - y_m) for node in row)
    if off_m > _TOLD_M:
        notes.append(f"aisle {name}: nodes lay up to {off_m:.2f} m beside its line and are put onto it")
    at = [round(graph.nodes[node][0], 6) for node in row]
    told = {
        "id": name,
        "x_m": at[0],
        "y_m": y_m,
        "spacing_m": [round(b - a, 6) for a, b in itertools.pairwise(at)],
        "shelves": [],
    }
    up = {(a, b) in along for a, b in itertools.pairwise(row)}
    down = {(b, a) in along for a, b in itertools.pairwise(row)}
    if up == {True} and down == {False}:
        told["one_way"] = "+x"
    elif up == {False} and down == {True}:
        told["one_way"] = "-x"
    elif up != {True} or down != {True}:
        notes.append(f"aisle {name} is one way in parts only; here it is flown both ways")
    return told


def _crosses(across: Sequence[tuple[str, str]], renamed: Mapping[str, str]) -> Iterator[dict[str, Any]]:
    ways = {(a, b) for a, b in across if a in renamed and b in renamed}
    told: set[frozenset[str]] = set()
    for a, b in across:
        if (a, b) not in ways or frozenset((a, b)) in told:
            continue
        told.add(frozenset((a, b)))
        one_way = {} if (b, a) in ways else {"one_way": True}
        yield {"nodes": [renamed[a], renamed[b]], **one_way}


def _listed(names: Sequence[str]) -> str:
    more = len(names) - _LISTED
    return ", ".join(names[:_LISTED]) + (f" and {more} more" if more > 0 else "")
