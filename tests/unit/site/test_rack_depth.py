"""How far racks reach behind their fronts."""

from __future__ import annotations

import pytest

from flightd.site.floor_plan_svg import draw_site
from flightd.site.layout import CROSS_CLEARANCE_M, lay_out
from flightd.site.rack_depth import RACK_DEPTH_M, rack_body
from flightd.site.site import Aisle, Pad, Side, Site


def two_aisles(apart_m: float, *, only_a: bool) -> Site:
    """Aisle A with a front on its right, and aisle B there, with or without a front that stands before it."""
    spacing_m = (1.5, 1.5, 1.5)
    aisles = [
        Aisle("A", 0.0, 0.0, spacing_m, shelves=(Side.LEFT, Side.RIGHT), shelf_distance_m=1.2),
        Aisle("B", 0.0, apart_m, spacing_m, shelves=() if only_a else (Side.LEFT,), shelf_distance_m=1.2),
    ]
    return lay_out("two", aisles, [("A1", "B1")], [Pad("home", "A1", 0.5)])


def depths_m(site: Site) -> dict[tuple[str, Side], float]:
    """Of each front's rack, which begins at the front and reaches away from its aisle."""
    found = {}
    for shelf in site.shelves:
        body = rack_body(site, shelf)
        front_m, back_m = (body.y0_m, body.y1_m) if shelf.side is Side.RIGHT else (body.y1_m, body.y0_m)
        assert front_m == shelf.y_m
        assert (body.x0_m, body.x1_m, body.from_m, body.to_m) == (shelf.x0_m, shelf.x1_m, 0, shelf.height_m)
        found[shelf.aisle, shelf.side] = abs(back_m - front_m)
    return found


def test_a_rack_is_as_deep_as_racks_are_where_nothing_is_behind_it() -> None:
    assert list(depths_m(two_aisles(6.0, only_a=False)).values()) == pytest.approx([RACK_DEPTH_M] * 3)


def test_back_to_back_it_ends_at_the_other_front() -> None:
    found = depths_m(two_aisles(3.0, only_a=False))
    assert found["A", Side.RIGHT] == found["B", Side.LEFT] == pytest.approx(0.6)
    assert found["A", Side.LEFT] == pytest.approx(RACK_DEPTH_M)


def test_the_line_behind_it_keeps_its_way() -> None:
    found = depths_m(two_aisles(2.4, only_a=True))
    assert found["A", Side.RIGHT] == pytest.approx(2.4 - 1.2 - CROSS_CLEARANCE_M)


def test_a_plan_draws_racks_back_to_back_up_to_each_other() -> None:
    """64 units a metre; without an outline between them."""
    plan = draw_site(two_aisles(3.0, only_a=False))
    assert plan.count('height="38.4"/>') == 4
    assert plan.index('class="shelf"') > plan.rindex('class="rack"')
