"""Codes find their location by geometry, or none: never a neighbour's."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.core.scanning import CodeSet
from flightd.core.types import CodeRead
from flightd.mission.scan.code_assignment import Assigner
from flightd.site.shelf_cells import cells_of
from flightd.site.site import Location, Side
from tests.unit.mission.shelves import SIGHT, SITE, picture, pose, read

ASSIGNER = Assigner(SITE, SIGHT)
LEFT = ("A", Side.LEFT)
FACING = [
    place
    for place in SITE.locations.values()
    if (place.side, place.node, place.level) == (Side.LEFT, "A2", 1)
]


def seen_from(true_pose: dict[str, float], place: Location, dx_m: float, dh_m: float, text: str) -> CodeSet:
    """What the camera really at `true_pose` sees of a label near a location's own."""
    view = SIGHT.view(pose(0, **true_pose))
    x, h, half = place.x_m + dx_m, place.height_m + dh_m, 0.03
    corners = [(x - half, h + half), (x + half, h + half), (x + half, h - half), (x - half, h - half)]
    pixels = view.project(np.array([(cx, place.y_m, ch) for cx, ch in corners])) - SIGHT.lens.centre_px
    return picture(1, (CodeRead("QR Code", text, tuple(map(tuple, pixels.tolist())), True, 1, 1.0),))


def test_the_cells_of_a_front_neither_overlap_nor_leave_gaps() -> None:
    cells = [cell for cell in cells_of(SITE).values() if (cell.aisle, cell.side) == LEFT]
    area = sum((cell.x1_m - cell.x0_m) * (cell.high_m - cell.low_m) for cell in cells)
    width = max(c.x1_m for c in cells) - min(c.x0_m for c in cells)
    height = max(c.high_m for c in cells) - min(c.low_m for c in cells)
    assert area == pytest.approx(width * height)
    for cell in cells:
        place = SITE.locations[cell.location]
        assert cell.inside_probability(place.x_m, place.height_m, 0.01, 0.01) > 0.999


@given(
    st.sampled_from(FACING),
    st.floats(-0.30, 0.30),
    st.floats(-0.3, 0.3),
    st.floats(-2, 2),
    st.floats(-2, 2),
    st.floats(-2, 2),
    st.floats(-2, 2),
)
def test_poses_within_their_tolerance_never_give_a_read_to_a_neighbour(
    place: Location, dx_m: float, dh_m: float, ex: float, ey: float, eyaw: float, eh: float
) -> None:
    sigma_m, sigma_rad = 0.03, 0.01
    true_pose = {
        "x_m": 1.3 + ex * sigma_m,
        "y_m": ey * sigma_m,
        "yaw_rad": -math.pi / 2 + eyaw * sigma_rad,
        "height_m": 0.9 + eh * 0.02,
    }
    codes = seen_from(true_pose, place, dx_m, dh_m, "PALLET-1")
    believed = pose(0, sigma_x_m=sigma_m, sigma_y_m=sigma_m, sigma_yaw_rad=sigma_rad)
    (placed,) = ASSIGNER.look(codes, believed, LEFT).reads
    assert placed.location in {place.code, ""}


def test_a_label_well_inside_is_its_locations_own() -> None:
    for place in FACING:
        (placed,) = ASSIGNER.look(seen_from({}, place, 0.1, 0.1, "PALLET-1"), pose(), LEFT).reads
        assert placed.location == place.code
        assert placed.probability > 0.999


def test_a_read_on_the_border_or_from_a_doubtful_place_is_nobodys() -> None:
    place = FACING[0]
    border = seen_from({}, place, 0.325, 0.0, "PALLET-1")
    assert [p.location for p in ASSIGNER.look(border, pose(), LEFT).reads] == [""]
    inside = seen_from({}, place, 0.0, 0.0, "PALLET-1")
    for doubtful in (pose(certain=False), pose(sigma_x_m=0.5)):
        assert [p.location for p in ASSIGNER.look(inside, doubtful, LEFT).reads] == [""]


def test_a_location_label_is_no_stock_and_contradicts_a_place_one_bay_off() -> None:
    place = FACING[0]
    codes = seen_from({}, place, 0.0, 0.0, place.code)
    look = ASSIGNER.look(codes, pose(), LEFT)
    assert not look.reads
    assert [(s.location, s.contradicts) for s in look.sightings] == [(place.code, False)]
    one_off = ASSIGNER.look(codes, pose(x_m=2.6), LEFT).sightings
    assert [s.contradicts for s in one_off] == [True]
    assert one_off[0].off_m == pytest.approx(1.3, abs=0.02)


def test_a_location_label_of_the_other_side_contradicts_too() -> None:
    other = next(place for place in SITE.locations.values() if place.side is Side.RIGHT)
    look = ASSIGNER.look(picture(1, (read(other.code),)), pose(), LEFT)
    assert [s.contradicts for s in look.sightings] == [True]


def test_wanted_places_are_shown_where_they_are() -> None:
    places = ASSIGNER.places(pose(), [place.code for place in FACING])
    assert {place.location for place in places} == {place.code for place in FACING}
    for place in places:
        label = SITE.locations[place.location]
        at = SIGHT.view(pose()).project(np.array([(label.x_m, label.y_m, label.height_m)]))[0]
        x, y = at - SIGHT.lens.centre_px
        xs, ys = zip(*place.quad_px, strict=True)
        assert min(xs) < x < max(xs)
        assert min(ys) < y < max(ys)
        assert place.share > 0.9
