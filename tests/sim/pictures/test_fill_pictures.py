"""Rendered shelves that are filled in part: how full their places are told to be."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from flightd.core.inventory import PlaceFill
from flightd.core.scanning import Occupancy
from flightd.mission.scan.code_assignment import Assigner, FrontSight
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.front_camera import FrontCamera
from flightd.sim.racks.stock import StockShares
from flightd.sim.racks.stock_truth import LocationTruth, stock_truth
from flightd.site.site_file import load_site
from flightd.vision.shelf.shelf_look import read_shelf
from tests.sim.pictures.shelf_pictures import shelf_pictures

SITE = load_site(Path(__file__).parents[3] / "configs" / "site-racks-small.toml")
CAMERA = FrontCamera()
LOOK = replace(RackAppearance(), in_part=1.0)
SEED = 31


def fills(look: RackAppearance, seed: int = SEED) -> list[tuple[LocationTruth, PlaceFill | None]]:
    """What is true of each place in the pictures before two nodes, and what one picture tells of it."""
    assigner = Assigner(SITE, FrontSight(CAMERA.lens, CAMERA.mount))
    truth = stock_truth(SITE, look, CAMERA.lens.fx_px, seed)
    told: list[tuple[LocationTruth, PlaceFill | None]] = []
    for seen in shelf_pictures(SITE, CAMERA, look, seed, ("A2", "B3")):
        codes, _ = read_shelf(seen.picture, 0, 0, assigner.places(seen.pose, seen.view.locations))
        told += [(truth[place.location], place.fill) for place in codes.places]
    return told


@pytest.mark.parametrize(
    ("seed", "node", "aside"), [(22, "B4", "BR-04-1-2"), (91, "B4", "BR-04-2-1"), (94, "A3", "AL-03-2-2")]
)
def test_a_place_with_goods_at_its_sides_alone_is_not_taken_for_empty(
    seed: int, node: str, aside: str
) -> None:
    look = replace(LOOK, shares=StockShares(empty=0.4, occluded=0.0, dark=0.0))
    assigner = Assigner(SITE, FrontSight(CAMERA.lens, CAMERA.mount))
    truth = stock_truth(SITE, look, CAMERA.lens.fx_px, seed)
    shown: dict[str, Occupancy] = {}
    for seen in shelf_pictures(SITE, CAMERA, look, seed, (node,)):
        codes, _ = read_shelf(seen.picture, 0, 0, assigner.places(seen.pose, seen.view.locations))
        shown |= {place.location: place.occupancy for place in codes.places}
    assert truth[aside].fill > 0.0
    assert shown[aside] is not Occupancy.EMPTY
    empty = {code for code, occupancy in shown.items() if occupancy is Occupancy.EMPTY}
    assert empty == {code for code in shown if truth[code].fill == 0.0}


def test_how_full_places_are_is_told_within_ten_points() -> None:
    told = [one for seed in range(SEED, SEED + 4) for one in fills(LOOK, seed)]
    known = [(true.fill, fill.share) for true, fill in told if fill is not None and fill.share is not None]
    assert len(known) >= 0.7 * len(told) >= 32
    assert sum(abs(share - true) <= 0.1 for true, share in known) >= 0.9 * len(known)
    assert max(true for true, _ in known) - min(true for true, _ in known) > 0.3


def test_cases_are_counted_in_regular_stacks_and_nowhere_else() -> None:
    look = replace(RackAppearance(), shares=StockShares(empty=0.05), cartons=0.8)
    told = [(true.boxes, fill) for true, fill in fills(look)]
    counted = [(boxes, fill.cases) for boxes, fill in told if fill is not None and fill.cases is not None]
    plain = [boxes for boxes, _ in told if len(boxes) > 1 and boxes[0] > 1 and len(set(boxes)) == 1]
    assert len(counted) >= 0.4 * len(plain) >= 1.2
    assert all(boxes == (grid.columns,) * grid.rows for boxes, grid in counted)
