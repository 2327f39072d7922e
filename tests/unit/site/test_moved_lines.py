"""A site whose painted lines move, and its file with their new places."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.core.errors import InputError
from flightd.sim.floor.misplaced_lines import misplaced
from flightd.sim.random_sites import random_site
from flightd.site.layout import LayoutError
from flightd.site.moved_lines import columns, moved
from flightd.site.site_edit import with_aisles
from flightd.site.site_file import load_site, parse_site

DEMO = Path(__file__).parents[3] / "configs" / "site-demo.toml"


def test_nodes_that_a_cross_joins_lie_on_one_line() -> None:
    found = columns(load_site(DEMO))
    assert ("A1", "B1") in found
    assert ("A6", "B6") in found
    assert ("A2",) in found
    assert len(found) == 10


def test_what_is_not_moved_stays() -> None:
    site = load_site(DEMO)
    assert moved(site, {}, {}) == site


def test_shelves_go_with_their_aisle() -> None:
    site = load_site(DEMO)
    shifted = moved(site, {"B": 3.1}, {})
    assert [shelf.y_m for shelf in shifted.shelves if shelf.aisle == "A"] == [
        shelf.y_m for shelf in site.shelves if shelf.aisle == "A"
    ]
    for before, after in zip(site.shelves, shifted.shelves, strict=True):
        if before.aisle == "B":
            assert after.y_m == pytest.approx(before.y_m + 0.1)


def test_nodes_cannot_pass_each_other() -> None:
    with pytest.raises(LayoutError, match="too close"):
        moved(load_site(DEMO), {}, {"A2": 3.0})


@given(seed=st.integers(0, 50), most_m=st.floats(0.001, 0.2))
def test_lines_are_misplaced_by_no_more_than_asked_and_home_stays(seed: int, most_m: float) -> None:
    site = random_site(seed)
    off = misplaced(site, most_m, seed)
    home = site.home.node
    assert off.nodes[home] == site.nodes[home]
    assert off.edges == site.edges
    for node in site.nodes.values():
        assert abs(off.nodes[node.id].x_m - node.x_m) <= most_m + 1e-6
        assert abs(off.nodes[node.id].y_m - node.y_m) <= most_m + 1e-6
    assert off == misplaced(site, most_m, seed)


def test_a_floor_that_cannot_be_is_refused_in_a_line() -> None:
    text = """
        site.name = "tight"
        [[aisle]]
        id = "A"
        x_m = 0.0
        y_m = 0.0
        spacing_m = [0.31, 0.31, 0.31, 0.31, 0.31, 0.31, 0.31, 0.31, 0.31, 0.31, 0.31, 0.31]
        [[pad]]
        id = "home"
        node = "A1"
    """
    with pytest.raises(InputError, match=r"floor\.map_error_m = 0\.3: no such floor.*too close"):
        misplaced(parse_site(text, "tight"), 0.3, 1)


def test_a_file_keeps_its_comments_where_numbers_change() -> None:
    text = DEMO.read_text().replace(
        "spacing_m = [1.5, 1.2, 1.8, 2.0, 1.4]",
        "spacing_m = [\n  1.5,  # to the pillar\n  1.2, 1.8, 2.0, 1.4,\n]  # by tape",
    )
    text = text.replace("y_m = 3.0", "y_m = 3.0  # by the door")
    site = parse_site(text, "x")
    fitted = moved(site, {"B": 3.043}, {"A2": 1.538})
    edited = with_aisles(text, {aisle.id: aisle for aisle in fitted.aisles})
    assert parse_site(edited, "y") == fitted
    assert "1.538,  # to the pillar" in edited
    assert "]  # by tape" in edited
    assert "y_m = 3.043  # by the door" in edited
    assert edited.startswith("# Two aisles of six nodes")
    assert len(edited.splitlines()) == len(text.splitlines())


def test_a_file_whose_lines_stay_is_not_touched() -> None:
    text = DEMO.read_text()
    assert with_aisles(text, {aisle.id: aisle for aisle in load_site(DEMO).aisles}) == text
