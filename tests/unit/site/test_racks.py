"""Racks, location codes and what the front camera makes of them."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.core.errors import InputError
from flightd.site.coverage import FrontView, check_coverage
from flightd.site.site import Side, Site
from flightd.site.site_file import load_site, parse_site, site_toml

DEMO = Path(__file__).parents[3] / "configs" / "site-demo.toml"

HALL = """
[site]
name = "hall"

[[aisle]]
id = "A"
x_m = 0.0
y_m = 0.0
spacing_m = [1.5, 1.5, 1.5]
shelf_distance_m = 1.2
shelf_height_m = 4.0

[[aisle]]
id = "B"
x_m = 0.0
y_m = 4.0
spacing_m = [1.5, 1.5, 1.5]
shelves = ["right"]

[[cross]]
nodes = ["A1", "B1"]

[[pad]]
id = "home"
node = "A1"
"""

RACK = """
[[rack]]
aisles = ["A"]
bay_width_m = 1.5
levels_m = [0.4, 1.6, 2.8]
positions = 2
"""


def hall(*parts: str) -> Site:
    return parse_site(HALL + "".join(parts), "hall.toml")


def test_a_site_file_without_racks_stays_valid() -> None:
    assert load_site(DEMO).locations == {}


def test_bays_levels_and_places_get_codes_by_the_pattern() -> None:
    site = hall(RACK)
    left = [location for location in site.locations.values() if location.side is Side.LEFT]
    assert len(left) == 4 * 3 * 2  # 6 m of front
    first, last = site.locations["AL-01-1-1"], site.locations["AL-04-3-2"]
    assert [first.x_m, first.y_m, last.x_m] == pytest.approx([-0.375, -1.2, 4.875])
    assert (first.height_m, first.node) == (0.4, "A1")
    assert (last.height_m, last.node) == (2.8, "A4")
    assert site.locations["AR-01-1-1"].y_m == pytest.approx(1.2)


def test_bays_count_on_behind_the_way_through() -> None:
    # the cross at A1 interrupts the right front; what is left of 6 m holds 3 whole bays
    codes = [code for code in hall(RACK).locations if code.startswith("AR")]
    assert sorted({code[3:5] for code in codes}) == ["01", "02", "03"]


@given(
    st.floats(0.3, 3.0), st.lists(st.floats(0.0, 3.9), min_size=1, max_size=5, unique=True), st.integers(1, 4)
)
def test_every_place_lies_on_its_front_and_nearest_to_its_node(
    bay_m: float, levels: list[float], positions: int
) -> None:
    rack = f"[[rack]]\naisles = ['A']\nbay_width_m = {bay_m!r}\nlevels_m = {sorted(levels)!r}\n"
    rack += f"positions = {positions}\n"
    site = hall(rack)
    for location in site.locations.values():
        on = [s for s in site.shelves if s.aisle == "A" and s.side is location.side]
        assert any(s.x0_m < location.x_m < s.x1_m and s.y_m == location.y_m for s in on)
        distances = [abs(node.x_m - location.x_m) for node in site.aisle_nodes("A")]
        assert abs(site.nodes[location.node].x_m - location.x_m) == min(distances)
    assert parse_site(site_toml(site), "again") == site


def test_racks_without_aisles_take_every_aisle_with_such_shelves() -> None:
    site = hall('[[rack]]\nsides = ["right"]\nbay_width_m = 1.2\nlevels_m = [1.0]\n')
    assert {location.aisle for location in site.locations.values()} == {"A", "B"}


@pytest.mark.parametrize(
    ("rack", "words"),
    [
        ("aisles = ['Q']\nbay_width_m = 1\nlevels_m = [1]", "rack[0].aisles: there is no aisle Q"),
        ("aisles = ['B']\nbay_width_m = 1\nlevels_m = [1]", "aisle B has no shelf on its left side"),
        ("aisles = ['A']\nbay_width_m = 1\nlevels_m = [1, 4.0]", "above the shelf"),
        ("aisles = ['A']\nbay_width_m = 1\nlevels_m = [2, 1]", "rise"),
        ("aisles = ['A']\nbay_width_m = 30\nlevels_m = [1]", "wider than every front"),
        ("aisles = ['A']\nbay_width_m = 1\nlevels_m = [1]\npattern = '{bay}'", "twice"),
        ("aisles = ['A']\nbay_width_m = 1\nlevels_m = [1]\npattern = '{bay'", "cannot be filled in"),
        ("aisles = ['A']\nbay_width_m = 1\nlevels_m = [1]\npattern = '{rack}'", "{rack} is not known"),
        (
            "aisles = ['A']\nbay_width_m = 1\nlevels_m = [1]\npattern = '{bay.real}'",
            "{bay.real} is not known",
        ),
        ("aisles = ['A']\nbay_width_m = 1\nlevels_m = [1]\npattern = '{bay:999999999}'", "only a width"),
        ("aisles = ['A']\nbay_width_m = 1\nlevels_m = [1]\npattern = '{side:2}'", "letters take no width"),
        ("aisles = ['A']\nbay_width_m = 1\nlevel = [1]", "rack[0].level: unknown key"),
        ("aisles = ['A']\nbay_width_m = 1\nlevels_m = [nan]", "rack[0].levels_m[0]"),
        ("aisles = ['A']\nbay_width_m = 1\nlevels_m = [1]\npallets_deep = 0", "rack[0].pallets_deep"),
    ],
)
def test_mistakes_are_named_in_one_line(rack: str, words: str) -> None:
    with pytest.raises(InputError) as refused:
        hall("[[rack]]\n" + rack + "\n")
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_how_many_pallets_stand_behind_one_another_is_kept_with_each_place() -> None:
    site = hall(RACK.replace("[[rack]]", "[[rack]]\npallets_deep = 3"))
    assert {place.pallets_deep for place in site.locations.values()} == {3}
    assert parse_site(site_toml(site), "again").locations == site.locations
    assert {place.pallets_deep for place in hall(RACK).locations.values()} == {1}
    assert "pallets_deep" not in site_toml(hall(RACK))


def test_one_front_belongs_to_one_rack() -> None:
    with pytest.raises(InputError, match="belongs to an earlier rack"):
        hall(RACK, RACK)


def test_ten_thousand_locations_are_laid_out() -> None:
    aisles = "".join(
        f"[[aisle]]\nid = '{chr(65 + i)}'\nx_m = 0.0\ny_m = {4.0 * i}\nspacing_m = {[1.5] * 42}\n"
        for i in range(10)
    )
    crosses = "".join(f"[[cross]]\nnodes = ['{chr(65 + i)}1', '{chr(66 + i)}1']\n" for i in range(9))
    pad = "[[pad]]\nid = 'home'\nnode = 'A1'\n"
    rack = "[[rack]]\nbay_width_m = 1.5\nlevels_m = [0.3, 1.0, 1.7, 2.4]\npositions = 3\n"
    site = parse_site(f"[site]\nname = 'large'\n{aisles}{crosses}{pad}{rack}", "large.toml")
    assert len(site.locations) > 10_000


def view(
    fov_deg: float = 70.0, width_px: int = 1920, exposure_s: float = 1e-3, module_m: float = 3e-3
) -> FrontView:
    return FrontView(math.radians(fov_deg), width_px, exposure_s, module_m)


def test_the_papers_rule_is_the_width_of_the_picture() -> None:
    assert view(90.0).seen_m(1.2) == pytest.approx(2.4)
    just = 2 * math.degrees(math.atan(0.75 / 1.2))  # D_X = 1.5 m at 1.2 m
    assert check_coverage(hall(RACK), view(just + 0.01), 0.1).problems == ()
    short = check_coverage(hall(RACK), view(just - 0.5), 0.1)
    assert any("is in no picture" in problem for problem in short.problems)


def test_labels_between_the_pictures_are_named() -> None:
    found = check_coverage(hall(RACK), view(40.0), 0.1)
    assert "AL-01-1-1" not in found.unseen
    site = hall(RACK)
    reach_m = view(40.0).seen_m(1.2) / 2
    expected = {
        code for code, at in site.locations.items() if abs(at.x_m - site.nodes[at.node].x_m) > reach_m
    }
    assert set(found.unseen) == expected
    assert found.read_part == pytest.approx(1 - len(expected) / len(site.locations))


def test_small_labels_and_fast_flights_are_predicted() -> None:
    camera = view(70.0, 1920, 2e-3, 0.5e-3)
    found = check_coverage(hall(RACK), camera, 0.5)
    assert found.least_px_per_module == pytest.approx(960 / math.tan(math.radians(35)) * 0.5e-3 / 1.2)
    assert found.read_part == 0.0
    assert len(found.unreadable) == found.locations
    assert found.speed_limit_mps == pytest.approx(0.75 * 0.5e-3 / 2e-3)
    assert [p for p in found.problems if "px per module" in p]
    assert [p for p in found.problems if "fly at most 0.188 m/s" in p]
    assert check_coverage(hall(RACK), view(), 0.7).problems == ()
    assert check_coverage(hall(RACK), view(), 0.7).read_part == 1.0
