"""Where a place is drawn: by the site where it is known, else by what its code says."""

from __future__ import annotations

from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from flightd.inventory.elevation import fronts_of
from flightd.site.shelf_cells import cells_of
from flightd.site.site_file import load_site

SITE = load_site(Path(__file__).parents[3] / "configs" / "site-racks-small.toml")


def test_a_front_is_drawn_as_who_faces_it_sees_it() -> None:
    fronts = {(front.aisle, front.side): front for front in fronts_of(SITE.locations, SITE)}
    assert set(fronts) == {("A", "left"), ("A", "right"), ("B", "left"), ("B", "right")}
    cells = cells_of(SITE)
    for (_, side), front in fronts.items():
        lowest = [spot for spot in front.spots if spot.level == 1]
        xs = [cells[spot.code].corners_m[0][0] for spot in lowest]
        # the corner that who faces it sees at the left: x runs to his right, or mirrored to his left
        assert xs == sorted(xs, reverse=side == "right")
        assert front.mirrored == (side == "right")
    assert sum(len(front.spots) for front in fronts.values()) == len(SITE.locations)


def test_without_a_site_the_code_says_where_it_is() -> None:
    codes = ["AL-01-2-1", "AL-01-1-1", "AL-01-1-2", "H3.12.4", "H3.11.4", "DOCK", "AL-1-1-1", "007", "A7"]
    rack, hall, others = fronts_of(codes)
    assert (rack.aisle, [spot.code for spot in rack.spots]) == ("AL", ["AL-01-1-1", "AL-01-1-2", "AL-01-2-1"])
    assert (rack.spots[1].bay, rack.spots[1].level, rack.spots[1].position) == (1, 1, 2)
    assert (hall.aisle, [spot.code for spot in hall.spots]) == ("H", ["H3.11.4", "H3.12.4"])
    assert not others.placed
    assert {spot.code for spot in others.spots} == {"DOCK", "AL-1-1-1", "007", "A7"}


def test_what_the_site_does_not_know_stands_beside_it() -> None:
    fronts = fronts_of(["AL-01-1-1", "Z-01-1-1", "GATE"], SITE)
    assert [(front.aisle, front.side, front.placed) for front in fronts] == [
        ("A", "left", True), ("Z", "", True), ("", "", False)
    ]  # fmt: skip


@given(st.lists(st.text(max_size=12), unique=True))
def test_every_place_is_drawn_once(codes: list[str]) -> None:
    drawn = [spot.code for front in fronts_of(codes) for spot in front.spots]
    assert sorted(drawn) == sorted(codes)
