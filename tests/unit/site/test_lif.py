"""VDMA LIF in and out: what LIF can hold comes back, what it cannot is told by name, and what a site lacks
stays in the file that it came from."""

from __future__ import annotations

import copy
import itertools
import json
import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from flightd.core.errors import InputError
from flightd.site.exchange.lif import lif_document, tables_of_lif
from flightd.site.exchange.lif_losses import lif_losses
from flightd.site.exchange.lif_onto import lif_onto
from flightd.site.exchange.low_ways import open_below_m
from flightd.site.site import Site
from flightd.site.site_file import parse_site
from flightd.site.site_tables import SiteTablesError, site_of

CONFIGS = Path(__file__).parents[3] / "configs"
HALL: dict[str, Any] = json.loads((Path(__file__).parent / "hall.lif.json").read_text())
WRITTEN = HALL["metaInformation"]["exportTimestamp"]


def hall() -> dict[str, Any]:
    return copy.deepcopy(HALL)


def near(value: float) -> float:
    return round(value, 4) + 0.0


def ways_of(site: Site) -> dict[tuple[str, str], float]:
    """Every open way in its direction, with the height below which it is open."""
    found: dict[tuple[str, str], float] = {}
    for edge in site.edges:
        below_m = open_below_m(site, edge)
        if below_m is not None:
            found |= dict.fromkeys(((edge.a, edge.b), (edge.b, edge.a))[: 1 if edge.one_way else 2], below_m)
    return found


def held(site: Site) -> dict[str, Any]:
    """All that LIF has a place for."""
    return {
        "name": site.name,
        "nodes": {node.id: (near(node.x_m), near(node.y_m), node.aisle) for node in site.nodes.values()},
        "ways": {way: near(m) if math.isfinite(m) else m for way, m in ways_of(site).items()},
        "pads": [(pad.id, pad.node, pad.charge, tuple(map(near, pad.offset_m))) for pad in site.pads],
        "places": {
            place.code: (place.aisle, place.side, place.level, place.node, near(place.x_m), near(place.y_m),
                         near(place.height_m))
            for place in site.locations.values()
        },
    }  # fmt: skip


_metres = st.integers(120, 260).map(lambda cm: cm / 100)


@st.composite
def sites(draw: st.DrawFn) -> Site:
    """Sound sites with all that a site file may hold."""
    names = draw(st.lists(st.sampled_from(["A", "B", "N", "AB", "ZZZ"]), min_size=1, max_size=4, unique=True))
    spacing = draw(st.lists(_metres, min_size=1, max_size=5))
    aisles: list[dict[str, Any]] = [
        {
            "id": name,
            "x_m": 1.25,
            "y_m": 3.5 * i - 2.0,
            "spacing_m": spacing,
            "shelves": draw(st.sampled_from([[], ["left"], ["left", "right"]])),
            "shelf_height_m": draw(st.sampled_from([3.0, 3.5])),
            "overrun_m": draw(st.sampled_from([0.4, 0.0])),
            **draw(st.sampled_from([{}, {}, {"one_way": "+x"}, {"one_way": "-x"}])),
        }
        for i, name in enumerate(names)
    ]
    last = len(spacing) + 1
    crosses = [
        {"nodes": [f"{a}{end}", f"{b}{end}"], "one_way": draw(st.booleans())}
        for a, b in itertools.pairwise(names)
        for end in (1, last)
    ]
    lines = [(f"{name}{i}", f"{name}{i + 1}") for name in names for i in range(1, last)]
    shelved = [aisle for aisle in aisles if aisle["shelves"]]
    rack: dict[str, Any] = {
        "aisles": [aisle["id"] for aisle in shelved],
        "sides": ["left"],
        "bay_width_m": draw(st.sampled_from([0.9, 1.2, 1.35])),
        "levels_m": draw(st.sampled_from([[0.4], [0.3, 1.5], [0.3, 1.1, 2.4]])),
        "positions": draw(st.integers(1, 3)),
        "pattern": draw(
            st.sampled_from(
                ["{aisle}{side}-{bay:02}-{level}-{position}", "{side}{aisle}.{bay}/{level}/{position:02}",
                 "H3 {aisle}{bay:03}{level}{position}", "Reg{aisle}_{level}_{bay}_{position}"]
            )
        ),
    }  # fmt: skip
    racked = draw(st.booleans())
    offset = draw(st.sampled_from([[0.0, 0.0], [0.25, -0.3]]))
    tables: dict[str, Any] = {
        "site": {"name": "hall", **draw(st.sampled_from([{}, {"ceiling_m": 6.0}])),
                 "line_width_m": draw(st.sampled_from([0.075, 0.06])), "interlock": draw(st.booleans()),
                 "unattended_start": draw(st.booleans())},
        "aisle": aisles,
        "cross": crosses,
        "rack": [rack] if shelved and racked else [],
        "pad": [
            {"id": "dock", "node": f"{names[-1]}{last}", "charge": draw(st.booleans()), "offset_m": offset},
            {"id": "home", "node": f"{names[0]}1", "size_m": draw(st.sampled_from([0.5, 0.8]))},
        ],
        "blocked": [{"nodes": list(line)} for line in draw(st.lists(st.sampled_from(lines), max_size=1))],
        "keep_out": draw(
            st.lists(
                st.builds(
                    lambda x, y, low: {"x0_m": x, "y0_m": y, "x1_m": x + 0.2, "y1_m": y + 0.2, "from_m": low},
                    st.integers(2, 8).map(float),
                    st.sampled_from([-2.1, 1.4, 3.2]),
                    st.sampled_from([0.0, 3.2, 4.0]),
                ),
                max_size=2,
            )
        ),
    }  # fmt: skip
    try:
        site = site_of(tables)
    except SiteTablesError:
        assume(False)
        raise
    closed = [edge for edge in site.crosses if open_below_m(site, edge) is None]
    assume(not closed)  # of a line between aisles that is closed LIF has nothing, and lif_losses says so
    return site


@settings(max_examples=30)
@given(site=sites())
def test_a_site_comes_back_from_lif_with_all_that_lif_can_hold(site: Site) -> None:
    found = tables_of_lif(lif_document(site, WRITTEN))
    again = site_of(found.tables)
    assert held(again) == held(site)
    assert not [note for note in found.notes if "not held" in note or "left out" in note]
    told = {line.removeprefix("LIF does not hold ").partition(" ")[0] for line in lif_losses(site)}
    assert told <= {
        "site.line_width_m", "site.interlock", "site.unattended_start", "aisle.shelves",
        "aisle.shelf_height_m", "aisle.overrun_m", "aisle.shelf_distance_m", "aisle.one_way", "pad.size_m",
        "keep_out", "rack", "site.ceiling_m", "site.ceiling_given",
    }  # fmt: skip
    assert ("site.interlock" in told) == site.interlock
    assert ("site.unattended_start" in told) == site.unattended_start
    if "rack" in told:  # codes of a single bay or place leave open which of the two they number
        assert any(again.locations[code].position != place.position for code, place in site.locations.items())
    if "aisle.one_way" in told:  # of an aisle that is closed from end to end LIF has no way at all
        open_aisles = {
            site.nodes[a].aisle for a, b in ways_of(site) if site.nodes[a].aisle == site.nodes[b].aisle
        }
        assert len(open_aisles) < len(site.aisles)


def test_what_lif_cannot_hold_is_told_in_a_line_for_each_kind() -> None:
    text = (CONFIGS / "site-racks-small.toml").read_text()
    text = text.replace('name = "racks-small"', 'name = "racks-small"\ninterlock = true')
    text += '\n[[marker]]\nid = 7\ndictionary = "4x4_50"\nx_m = 0.6\ny_m = 0.45\n'
    text += "\n[[keep_out]]\nx0_m = 1.8\ny0_m = 3.2\nx1_m = 2.0\ny1_m = 3.4\n"
    assert lif_losses(parse_site(text, "x")) == (
        "LIF does not hold site.interlock",
        "LIF does not hold aisle.shelf_height_m (A, B)",
        "LIF does not hold keep_out (at x 1.8 m, y 3.2 m)",
        "LIF does not hold marker (7)",
    )
    cut = parse_site(text + '\n[[blocked]]\nnodes = ["A4", "B4"]\n', "x")
    assert "LIF does not hold cross (A4 to B4)" in lif_losses(cut)


def test_a_layout_of_two_vehicle_types_becomes_the_floor_of_one() -> None:
    found = tables_of_lif(hall(), "acme.drone")
    site = site_of(found.tables)
    assert found.names == {"P11": "A1", "P12": "A2", "P13": "A3", "P21": "B1", "P22": "B2", "P23": "B3"}
    assert site.ceiling_m == 6.0
    ways = ways_of(site)
    assert ("B2", "B3") not in ways
    assert {way: below_m for way, below_m in ways.items() if below_m != 6.0} == {
        ("A2", "A3"): 4.5, ("A3", "A2"): 4.5
    }  # fmt: skip
    assert set(site.locations) == {f"S-{bay}-{level}" for bay in (1, 2, 3) for level in (1, 2)}
    assert [(pad.id, pad.offset_m) for pad in site.pads] == [("dock", (0.0, 0.0))]
    notes = "\n".join(found.notes)
    for words in (
        "of the layout not held by a site: layoutDescription (1), layoutId (1), layoutLevelId (1), layoutV",
        "of nodes not held by a site: actions (1), mapId (7), nodeName (1), theta (2)",
        "of edges not held by a site: edgeName (1), loadRestriction (1), maxRotationSpeed (1), maxSpeed (1)",
        "of stations not held by a site: stationDescription (1), stationName (1), theta (1)",
        "left out: handover",
    ):
        assert words in notes, words
    both = tables_of_lif(hall())
    assert "the ways of all vehicle types are taken: acme.truck, acme.drone" in both.notes
    with pytest.raises(InputError, match=r"the file has acme\.truck, acme\.drone"):
        tables_of_lif(hall(), "acme")


@pytest.mark.parametrize("vehicle", ["", "acme.drone"])
def test_a_foreign_file_loses_nothing_through_a_site_and_back_onto_it(vehicle: str) -> None:
    site = site_of(tables_of_lif(hall(), vehicle).tables)
    assert lif_onto(hall(), site, WRITTEN, vehicle) == hall()


_EXTRAS = st.fixed_dictionaries(
    {},
    optional={
        "nodeName": st.text(max_size=3), "edgeName": st.text(max_size=3), "stationName": st.text(max_size=3),
        "vendor": st.integers(), "mapId": st.text(max_size=3),
        "vehicleTypeEdgeProperties": st.lists(
            st.fixed_dictionaries(
                {"vehicleTypeId": st.sampled_from(["acme.drone", "x"]), "rotationAllowed": st.booleans()},
                optional={
                    "maxHeight": st.sampled_from([2.5, 4.5]), "maxSpeed": st.floats(0.1, 3.0),
                    "orientationType": st.sampled_from(["GLOBAL", "TANGENTIAL"]),
                    "vehicleOrientation": st.floats(-3.0, 3.0),
                },
            ),
            max_size=2,
        ),
    },
)  # fmt: skip


@settings(max_examples=40)
@given(
    extras=st.lists(
        st.tuples(st.sampled_from(["nodes", "edges", "stations"]), st.integers(0, 20), _EXTRAS), max_size=5
    )
)
def test_whatever_a_foreign_file_says_more_stays_in_it(extras: list[tuple[str, int, dict[str, Any]]]) -> None:
    told = hall()
    for kind, at, more in extras:
        parts = told["layouts"][0][kind]
        parts[at % len(parts)].update(more)
    try:
        site = site_of(tables_of_lif(told).tables)
    except SiteTablesError:
        return
    assert lif_onto(told, site, WRITTEN) == told


def test_only_what_has_changed_in_the_site_changes_in_the_file() -> None:
    tables = tables_of_lif(hall(), "acme.drone").tables
    tables["aisle"][0]["spacing_m"] = [2.0, 2.5]
    tables["aisle"][1]["spacing_m"] = [2.0, 2.5]
    tables["blocked"] = [{"nodes": ["A1", "A2"]}]
    tables["cross"].append({"nodes": ["A2", "B2"]})
    tables["pad"] = [{"id": "new", "node": "B1"}]
    del tables["aisle"][1]["one_way"], tables["rack"]
    told = lif_onto(hall(), site_of(tables), "2026-04-01T08:00:00Z", "acme.drone")
    assert told["metaInformation"] == {**HALL["metaInformation"], "exportTimestamp": "2026-04-01T08:00:00Z"}
    was, now = HALL["layouts"][0], told["layouts"][0]
    moved = {"P13": {"x": 2.0, "y": 5.5}, "P23": {"x": 6.0, "y": 5.5}}
    for old, new in zip(was["nodes"], now["nodes"], strict=True):
        assert new["nodePosition"] == moved.get(old["nodeId"], old["nodePosition"])
    assert [one["actionType"] for one in now["nodes"][0]["vehicleTypeNodeProperties"][1]["actions"]] == [
        "beep"
    ]
    assert now["nodes"][3]["vehicleTypeNodeProperties"][1]["actions"][0]["actionType"] == "startCharging"
    edges = {edge["edgeId"]: edge for edge in now["edges"]}
    # the truck keeps the way that the drone lost
    assert [one["vehicleTypeId"] for one in edges["e1"]["vehicleTypeEdgeProperties"]] == ["acme.truck"]
    assert "e2" not in edges
    assert edges["e3"] == was["edges"][2]
    new = edges.keys() - {edge["edgeId"] for edge in was["edges"]}
    assert new == {"P12-P22", "P22-P12", "P21-P22", "P22-P23"}
    assert edges["P12-P22"]["vehicleTypeEdgeProperties"] == [
        {"vehicleTypeId": "acme.drone", "rotationAllowed": True, "maxHeight": 6.0}
    ]
    assert [one["stationId"] for one in now["stations"]] == ["handover", "new"]
    assert now["stations"][0] == was["stations"][-1]


def test_a_file_that_is_not_the_sites_own_is_no_base() -> None:
    site = site_of(tables_of_lif(hall()).tables)
    base = hall()
    del base["layouts"][0]["edges"][7]
    with pytest.raises(InputError, match=r"makes no sound site: .*no legal way.*; export without --onto"):
        lif_onto(base, site, WRITTEN)
    text = (CONFIGS / "site-demo.toml").read_text().replace('"A', '"X').replace('"B', '"Y')
    site = parse_site(text, "x")
    with pytest.raises(InputError, match="has no node of this site"):
        lif_onto(hall(), site, WRITTEN)


_EDGE = ("edges", 4, "vehicleTypeEdgeProperties", 0)


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        (("edges", 0, "startNodeId"), 3, "layouts[0].edges[0].startNodeId is no text; mend it"),
        ((*_EDGE, "orientationType"), "MAP", "LIF does not know 'MAP'; one of GLOBAL, TANG"),
        ((*_EDGE, "rotationAllowed"), "may", "neither true nor false"),
        ((*_EDGE, "maxHeight"), "high", "maxHeight is no number"),
        ((*_EDGE, "maxHeight"), math.inf, "maxHeight is no number"),
        (("nodes", 2, "vehicleTypeNodeProperties"), {}, "NodeProperties is no list: this is no LIF"),
        (("nodes", 0, "vehicleTypeNodeProperties", 1, "actions", 0, "blockingType"), "", "one of NONE"),
        (("stations", 1, "stationHeight"), 1e9, "stations[1].stationHeight is 1e+09 m; at most 10,000 m"),
        (("stations", 0), 1, "layouts[0].stations[0] is no JSON object: this is no LIF"),
        (("stations", 0), {"stationId": "s"}, "layouts[0].stations[0] has no 'interactionNodeIds'; mend it"),
    ],
)  # fmt: skip
def test_a_key_of_the_wrong_kind_is_named(path: tuple[Any, ...], value: Any, words: str) -> None:
    told = hall()
    part = told["layouts"][0]
    for step in path[:-1]:
        part = part[step]
    part[path[-1]] = value
    with pytest.raises(InputError) as refused:
        tables_of_lif(told)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)
