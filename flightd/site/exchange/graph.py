"""Nodes and the ways between them, from whatever program, as the tables of a site file.

Aisles are what edges along x join, crosses are edges along y; what is neither is left out, and said.
"""

from __future__ import annotations

import itertools
import re
import statistics
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

from flightd.core.errors import InputError
from flightd.site.exchange.listed import listed
from flightd.site.exchange.low_ways import low_way_tables
from flightd.site.exchange.places import PlaceAt, rack_tables

_STRAIGHT_M: Final = 0.05
"""Nodes that lie so much beside a line are put onto it."""
_TOLD_M: Final = 0.01
_ID: Final = re.compile(r"([A-Z]{1,3})([1-9]\d*)")
_MOST_NODES: Final = 20_000
_LETTERS: Final = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"


@dataclass(frozen=True, slots=True)
class PadAt:
    """A pad on a node, and how far its centre lies off it (x, y)."""

    id: str
    charge: bool = True
    offset_m: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Graph:
    """`nodes` by name (x, y), metres in the frame of a site; `ways` (from, to), each direction by itself; the
    pads by the nodes that they lie on; the heights below which ways are open; the places for goods."""

    name: str
    nodes: Mapping[str, tuple[float, float]]
    ways: Collection[tuple[str, str]]
    pads: Mapping[str, PadAt] = field(default_factory=dict)
    below_m: Mapping[tuple[str, str], float] = field(default_factory=dict)
    places: Sequence[PlaceAt] = ()


@dataclass(frozen=True, slots=True)
class Imported:
    """Tables of a site file, and what a person should know of how they came about.  `names`: what the nodes
    are called here, by what they were called; `turned`: the map was, by a quarter."""

    tables: dict[str, Any]
    notes: tuple[str, ...]
    names: Mapping[str, str] = field(default_factory=dict)
    turned: bool = False


def site_tables(graph: Graph) -> Imported:
    """The graph as a site file holds it.  InputError where there is no line along x in it."""
    if len(graph.nodes) > _MOST_NODES:
        raise InputError(f"more than {_MOST_NODES} nodes")
    notes: list[str] = []
    rows = _rows_by_name(graph)
    turned = not rows and _runs_along_y(graph)
    if turned:
        graph = _turned(graph, notes)
    along, across, askew = _sorted_ways(graph)
    if askew:
        notes.append(f"neither along x nor along y, left out: {listed([f'{a} to {b}' for a, b in askew])}")
    if not rows:
        rows, alone = _rows(graph, along)
        if not rows:
            raise InputError("no two nodes are joined by a line along x: there is no aisle")
        if alone:
            notes.append(f"on no line along x, left out: {listed(alone)}")
    named = list(zip(_names(rows), rows, strict=True))
    renamed = {old: f"{aisle}{i}" for aisle, row in named for i, old in enumerate(row, 1)}
    other = [f"{old} = {new}" for old, new in renamed.items() if old != new]
    if other:
        notes.append(f"nodes are named by their aisles: {listed(other)}")
    site: dict[str, Any] = {"name": graph.name[:80] or "imported"}
    tables: dict[str, Any] = {
        "site": site,
        "aisle": [_aisle(graph, name, row, along, notes) for name, row in named],
        "cross": list(_crosses(across, renamed)),
        "blocked": [{"nodes": [renamed[a], renamed[b]]} for row in rows for a, b in _closed(row, along)],
        "pad": _pads(graph, renamed, named[0][0], notes),
    }
    ceiling_m, low, short = low_way_tables(graph.nodes, graph.ways, graph.below_m, renamed, notes)
    tables["keep_out"] = low
    tables["blocked"] += [{"nodes": list(pair)} for pair in short]
    if ceiling_m is not None:
        site["ceiling_m"] = ceiling_m
    places = [replace(place, node=renamed[place.node]) for place in graph.places if place.node in renamed]
    lost = [place.code for place in graph.places if place.node not in renamed]
    if lost:
        notes.append(f"stations at nodes that are left out: {listed(lost)}")
    tables = rack_tables(tables, places, notes)
    kept = {name: told for name, told in tables.items() if told or name == "cross"}
    return Imported(kept, tuple(notes), renamed, turned)


def _pads(graph: Graph, renamed: Mapping[str, str], first: str, notes: list[str]) -> list[dict[str, Any]]:
    pads = [(renamed[node], pad) for node, pad in graph.pads.items() if node in renamed]
    if not any(pad.charge for _, pad in pads):
        taken = {node for node, _ in pads}
        node = f"{first}1"
        if node in taken:
            notes.append(f"no charger is told: the pad at {node} is taken for one")
            pads = [(at, replace(pad, charge=True) if at == node else pad) for at, pad in pads]
        else:
            notes.append(f"no charger is told: the pad is put at {node}")
            pads.append((node, PadAt("home")))
    if all(pad.id != "home" for _, pad in pads):
        notes.append(f"missions start at the pad {pads[0][1].id}, unless one is called home")
    return [
        {
            "id": pad.id[:40],
            "node": node,
            **({} if pad.charge else {"charge": False}),
            **({"offset_m": list(pad.offset_m)} if any(pad.offset_m) else {}),
        }
        for node, pad in pads
    ]


def _rows_by_name(graph: Graph) -> list[list[str]]:
    """The aisles where every node goes by one already: A1, A2, … by rising x on a line.  Empty otherwise."""
    by_aisle: dict[str, list[tuple[int, str]]] = {}
    for node in graph.nodes:
        match = _ID.fullmatch(node)
        if match is None:
            return []
        by_aisle.setdefault(match[1], []).append((int(match[2]), node))
    rows = []
    for numbered in by_aisle.values():
        row = [node for _, node in sorted(numbered)]
        at = [graph.nodes[node] for node in row]
        level = max(y for _, y in at) - min(y for _, y in at) <= _STRAIGHT_M
        rising = all(b[0] - a[0] > _STRAIGHT_M for a, b in itertools.pairwise(at))
        if len(row) < 2 or not level or not rising or max(numbered)[0] != len(row):
            return []
        rows.append(row)
    rows.sort(key=lambda row: (round(_line_y_m(graph, row), 3), graph.nodes[row[0]][0]))
    return rows


def _runs_along_y(graph: Graph) -> bool:
    along, across, _ = _sorted_ways(graph)
    return len(across) > len(along)


def _turned(graph: Graph, notes: list[str]) -> Graph:
    """With most of its ways along x: a site's aisles lie so."""
    notes.append("most lines ran along y: the map is turned by a quarter, x is the old y")
    return replace(
        graph,
        nodes={node: (0.0 - y, x) for node, (x, y) in graph.nodes.items()},
        places=[replace(place, x_m=0.0 - place.y_m, y_m=place.x_m) for place in graph.places],
        pads={
            node: replace(pad, offset_m=(0.0 - pad.offset_m[1], pad.offset_m[0]))
            for node, pad in graph.pads.items()
        },
    )


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
    steps = [pair for pair in itertools.pairwise(row) if pair not in _closed(row, along)]
    up = {(a, b) in along for a, b in steps}
    down = {(b, a) in along for a, b in steps}
    if up == {True} and down == {False}:
        told["one_way"] = "+x"
    elif up == {False} and down == {True}:
        told["one_way"] = "-x"
    elif False in up | down:
        notes.append(f"aisle {name} is one way in parts only; here it is flown both ways")
    return told


def _closed(row: Sequence[str], along: Collection[tuple[str, str]]) -> list[tuple[str, str]]:
    """The neighbours of a row that no way joins."""
    return [(a, b) for a, b in itertools.pairwise(row) if (a, b) not in along and (b, a) not in along]


def _crosses(across: Sequence[tuple[str, str]], renamed: Mapping[str, str]) -> Iterator[dict[str, Any]]:
    ways = {(a, b) for a, b in across if a in renamed and b in renamed}
    told: set[frozenset[str]] = set()
    for a, b in across:
        if (a, b) not in ways or frozenset((a, b)) in told:
            continue
        told.add(frozenset((a, b)))
        one_way = {} if (b, a) in ways else {"one_way": True}
        yield {"nodes": [renamed[a], renamed[b]], **one_way}
