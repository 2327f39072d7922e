"""Maps of other programs: what goes out comes in again as the same floor, and what is no map is refused."""

from __future__ import annotations

import csv
import io
import itertools
import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.core.errors import InputError
from flightd.site.aisle_grid import AisleGrid
from flightd.site.exchange.graph import Graph, Imported, site_tables
from flightd.site.exchange.lif import lif_document, tables_of_lif
from flightd.site.exchange.node_table import locations_csv, nodes_csv, tables_of_rows
from flightd.site.site import Site
from flightd.site.site_file import load_site, parse_site
from flightd.site.site_tables import site_of

CONFIGS = Path(__file__).parents[3] / "configs"
UTC = "2026-11-24T12:00:00Z"


def rows_of(text: str) -> list[list[str]]:
    return list(csv.reader(io.StringIO(text, newline="")))


def floor_of(site: Site) -> tuple[dict[str, tuple[float, float]], set[frozenset[str]], set[str]]:
    """Nodes with their places, joined pairs, pads."""
    nodes = {node.id: (round(node.x_m, 4), round(node.y_m, 4)) for node in site.nodes.values()}
    return nodes, {frozenset((edge.a, edge.b)) for edge in site.edges}, {pad.node for pad in site.pads}


@pytest.mark.parametrize("name", ["demo", "large", "racks", "racks-small"])
def test_every_site_of_ours_comes_back_from_lif_and_from_csv_as_the_same_floor(name: str) -> None:
    site = load_site(CONFIGS / f"site-{name}.toml")
    for found in (tables_of_lif(lif_document(site, UTC)), tables_of_rows(rows_of(nodes_csv(site)))):
        again = site_of(found.tables)
        assert floor_of(again) == floor_of(site)
        assert [pad.id for pad in again.pads] == [pad.id for pad in site.pads]


@pytest.mark.parametrize(("apart_m", "is_closed"), [(1.2, True), (1.4, False)])
def test_a_way_under_a_beam_that_no_keep_out_fits_into_is_closed(apart_m: float, is_closed: bool) -> None:
    nodes = {"A1": (0.0, 0.0), "A2": (apart_m, 0.0), "A3": (2.0 * apart_m, 0.0)}
    ways = [("A1", "A2"), ("A2", "A1"), ("A2", "A3"), ("A3", "A2")]
    below_m = {way: 2.0 if "A3" in way else 6.0 for way in ways}
    found = site_tables(Graph("hall", nodes, ways, below_m=below_m))
    assert ({"nodes": ["A2", "A3"]} in found.tables.get("blocked", [])) is is_closed
    assert bool(found.tables.get("keep_out")) is not is_closed
    assert any("closed: A2 to A3" in note for note in found.notes) is is_closed


def test_lif_has_its_y_to_the_left_and_a_station_for_each_place() -> None:
    site = load_site(CONFIGS / "site-racks-small.toml")
    layout = lif_document(site, UTC)["layouts"][0]
    assert {"x": 0.0, "y": -3.4} in [node["nodePosition"] for node in layout["nodes"]]
    stations = {station["stationId"]: station for station in layout["stations"]}
    assert len(stations) == 1 + len(site.locations)
    place = site.locations["BR-04-2-2"]
    assert stations["BR-04-2-2"] == {
        "stationId": "BR-04-2-2",
        "interactionNodeIds": [place.node],
        "stationHeight": 1.6,
        "stationPosition": {"x": pytest.approx(place.x_m), "y": pytest.approx(-place.y_m)},
    }
    charged = [
        node["nodeId"] for node in layout["nodes"] if node["vehicleTypeNodeProperties"][0].get("actions")
    ]
    assert charged == ["A1"]


def test_lif_holds_only_ways_that_are_open_in_the_directions_that_are() -> None:
    text = (CONFIGS / "site-demo.toml").read_text()
    text = text.replace('id = "B"', 'id = "B"\none_way = "-x"') + '\n[[blocked]]\nnodes = ["A2", "A3"]\n'
    layout = lif_document(parse_site(text, "x"), UTC)["layouts"][0]
    ways = {(edge["startNodeId"], edge["endNodeId"]) for edge in layout["edges"]}
    assert ("B2", "B1") in ways
    assert ("B1", "B2") not in ways
    assert not {("A2", "A3"), ("A3", "A2")} & ways
    found = tables_of_lif({"layouts": [layout]})
    assert [aisle.get("one_way") for aisle in found.tables["aisle"]] == [None, "-x"]
    assert found.tables["blocked"] == [{"nodes": ["A2", "A3"]}]


def foreign() -> dict[str, Any]:
    """A layout as another vendor's planner writes it: aisles along y, names of its own, one bend."""
    places = {
        "N10": (0, 0),
        "N11": (0.02, 2),
        "N12": (0, 4),
        "N20": (3, 0),
        "N21": (3, 2),
        "N22": (3, 4),
        "Z": (9, 9),
    }
    pairs = [("N10", "N11"), ("N11", "N12"), ("N20", "N21"), ("N21", "N22"), ("N10", "N20"), ("N12", "N22")]
    ways = [*pairs, *((b, a) for a, b in pairs), ("N22", "Z")]
    return {
        "metaInformation": {"lifVersion": "1.0.0"},
        "layouts": [
            {
                "layoutId": "hall",
                "nodes": [
                    {
                        "nodeId": name,
                        "nodePosition": {"x": x, "y": y},
                        "vehicleTypeNodeProperties": [
                            {"vehicleTypeId": "v", "actions": [{"actionType": "startCharging"}]}
                            if name == "N22"
                            else {"vehicleTypeId": "v"}
                        ],
                    }
                    for name, (x, y) in places.items()
                ],
                "edges": [
                    {"edgeId": f"E{i}", "startNodeId": a, "endNodeId": b} for i, (a, b) in enumerate(ways)
                ],
                "stations": [{"stationId": "S1", "interactionNodeIds": ["N10"]}],
            }
        ],
    }


def test_a_foreign_layout_is_turned_straightened_and_named_and_says_so() -> None:
    found = tables_of_lif(foreign())
    site = site_of(found.tables)
    assert [len(site.aisle_nodes(aisle.id)) for aisle in site.aisles] == [3, 3]
    assert len(site.crosses) == 2
    assert site.home.id == "pad-N22"
    notes = "\n".join(found.notes)
    for words in ("turned by a quarter", "N22 to Z", "left out: Z", "put onto it", "N10 = A1", "out: S1"):
        assert words in notes, words
    # seen from above it is the same floor: from N10 to N12 one has N20 on the right
    assert site.nodes["A1"].y_m < site.nodes["B1"].y_m


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda told: told.update(layouts=[]), "no layout"),
        (lambda told: told.update(layouts=3), "this is no LIF"),
        (lambda told: told["layouts"].__setitem__(0, None), "no JSON object"),
        (lambda told: told["layouts"][0].pop("nodes"), "no list 'nodes'"),
        (
            lambda told: told["layouts"][0]["nodes"].insert(1, told["layouts"][0]["nodes"][0]),
            "layouts[0].nodes[1].nodeId: 'N10' comes twice",
        ),
        (lambda told: told["layouts"][0]["nodes"][0].pop("nodeId"), "nodes[0] has no 'nodeId'"),
        (lambda told: told["layouts"][0]["nodes"][0]["nodePosition"].update(x="east"), "x is no number"),
        (lambda told: told["layouts"][0]["nodes"][0]["nodePosition"].update(y=math.nan), "y is no number"),
        (lambda told: told["layouts"][0]["nodes"][0]["nodePosition"].update(y=1e9), "10,000 m"),
        (
            lambda told: told["layouts"][0]["edges"][0].update(endNodeId="?"),
            "layouts[0].edges[0].endNodeId: there is no node '?'",
        ),
        (lambda told: told["layouts"][0].update(edges=[]), "there is no aisle"),
    ],
)
def test_what_is_no_lif_is_refused_in_words(change: Any, words: str) -> None:
    told = foreign()
    change(told)
    with pytest.raises(InputError) as refused:
        tables_of_lif(told)
    assert words in str(refused.value)


_junk = st.recursive(
    st.none() | st.booleans() | st.floats() | st.text(max_size=3) | st.sampled_from(["N10", "startCharging"]),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(
                ["layouts", "nodes", "edges", "stations", "nodeId", "nodePosition", "x", "y", "actions"]
            ),
            inner,
            max_size=4,
        )
    ),
    max_leaves=12,
)


@given(
    junk=_junk, part=st.sampled_from(["layouts", "nodes", "edges", "stations", "node", "edge", "position"])
)
def test_anything_in_a_lif_is_a_map_or_a_refusal(junk: Any, part: str) -> None:
    told = foreign()
    layout = told["layouts"][0]
    match part:
        case "layouts":
            told["layouts"] = junk
        case "node":
            layout["nodes"][1] = junk
        case "edge":
            layout["edges"][0] = junk
        case "position":
            layout["nodes"][1]["nodePosition"] = junk
        case _:
            layout[part] = junk
    try:
        found = tables_of_lif(told)
    except InputError:
        return
    assert isinstance(found, Imported)


def test_a_table_of_another_form_is_understood() -> None:
    rows = [
        ["ID", "X [m]", "Y [m]"],
        ["p1", "0,0", "0"], ["p2", "1,5", "0,01"], ["p3", "3", "0"],
        ["q1", "0", "3"], ["q2", "1.5", "3"], ["q3", "3", "3.0"],
    ]  # fmt: skip
    found = tables_of_rows(rows)
    site = site_of(found.tables)
    assert [aisle.id for aisle in site.aisles] == ["A", "B"]
    assert {(edge.a, edge.b) for edge in site.crosses} == {("A1", "B1"), ("A3", "B3")}
    assert "neighbouring aisles are joined at the ends" in "\n".join(found.notes)


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([], "no column 'node'"),
        ([["node", "x"]], "no column 'y_m'"),
        ([["node", "x", "y"], ["", "1", "1"]], "row 2: no node"),
        ([["node", "x", "y"], ["A1", "1", "1"], ["A1", "1", "1"]], "row 3: node 'A1' comes twice"),
        ([["node", "x", "y"], ["A1", "one", "1"]], "row 2: x_m is 'one'"),
        ([["node", "x", "y"], ["A1", "nan", "1"]], "row 2: x_m is 'nan'"),
        ([["node", "x", "y"], ["A1", "1e99", "1"]], "row 2: x_m is '1e99'"),
        ([["node", "x", "y", "joined_to"], ["A1", "1", "1", "B1"]], "row 2: joined to 'B1'"),
        ([["node", "x", "y"], ["A1", "1", "1"]], "there is no aisle"),
    ],
)
def test_a_table_that_is_no_map_is_refused_by_its_row(rows: list[list[str]], words: str) -> None:
    with pytest.raises(InputError) as refused:
        tables_of_rows(rows)
    assert words in str(refused.value)


def test_a_names_formula_stays_text_in_a_table_and_minus_stays_a_number() -> None:
    text = (CONFIGS / "site-racks-small.toml").read_text()
    text = text.replace("positions = 2", 'positions = 2\npattern = "={aisle}{side}{bay}{level}{position}"')
    rows = rows_of(locations_csv(parse_site(text.replace("y_m = 0.0", "y_m = -9.0"), "x")))
    assert rows[1][0] == "'=AL111"
    assert rows[1][rows[0].index("y_m")] == "-10.2"


@given(
    aisles=st.integers(1, 5),
    spacing=st.lists(st.integers(60, 300).map(lambda cm: cm / 100), min_size=1, max_size=5),
    shift=st.tuples(st.integers(-50, 50), st.integers(-50, 50)),
    names=st.booleans(),
)
def test_a_grid_of_any_names_and_place_keeps_its_measures(
    aisles: int, spacing: list[float], shift: tuple[int, int], names: bool
) -> None:
    grid = AisleGrid(
        "g", aisles, len(spacing) + 1, spacing, 3.0, 0.075, "yellow", 0.5, 0.4, (), 1.2, 3.0, None
    )
    site = parse_site(grid.toml(), "x")
    called = {node: node if names else f"n{i}" for i, node in enumerate(site.nodes)}
    places = {called[node.id]: (node.x_m + shift[0], node.y_m + shift[1]) for node in site.nodes.values()}
    pairs = [(called[edge.a], called[edge.b]) for edge in site.edges]
    ways = list(itertools.chain.from_iterable(((a, b), (b, a)) for a, b in pairs))
    imported = site_tables(Graph("g", places, ways))
    turned = "turned by a quarter" in " ".join(imported.notes)
    across = 2 * sum(abs(places[a][1] - places[b][1]) > 0.05 for a, b in ways) > len(ways)
    assert turned == (across and not names)
    if not turned:
        found = site_of(imported.tables)
        assert floor_of(found)[1] == floor_of(site)[1]
        steps = [step for aisle in found.aisles for step in aisle.spacing_m]
        assert steps == pytest.approx([step for aisle in site.aisles for step in aisle.spacing_m])
