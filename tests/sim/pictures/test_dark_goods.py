"""Goods as dark as the empty rack: never counted as an empty place, and empty places still told."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from flightd.core.scanning import Light, Occupancy
from flightd.mission.scan.code_assignment import Assigner, FrontSight
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.front_camera import FrontCamera
from flightd.sim.racks.stock import StockShares, StockSituation, stock
from flightd.site.site_file import load_site
from flightd.vision.shelf.shelf_look import read_shelf
from tests.sim.pictures.shelf_pictures import shelf_pictures

SITE = load_site(Path(__file__).parents[3] / "configs" / "site-racks-small.toml")
CAMERA = FrontCamera()
SHARES = StockShares(0.4, 0.0, 0.0, 0.0, torn=0.05, too_small=0.05, missing=0.0, occluded=0.0, dark=0.5)
LOOK = replace(RackAppearance(), shares=SHARES)


def judged(seed: int, exposure: float) -> Counter[tuple[bool, Occupancy]]:
    """How often places that are (not) empty were taken for what, from all places that are looked from."""
    assigner = Assigner(SITE, FrontSight(CAMERA.lens, CAMERA.mount))
    empty = {
        code: place.situation is StockSituation.EMPTY
        for code, place in stock(SITE, LOOK.shares, CAMERA.lens.fx_px, seed).items()
    }
    told: Counter[tuple[bool, Occupancy]] = Counter()
    for seen in shelf_pictures(SITE, CAMERA, LOOK, seed, ("A2", "B3"), (exposure,), retakes=True):
        places = assigner.places(seen.pose, seen.view.locations)
        codes, _ = read_shelf(seen.picture, 0, 0, places, seen.part)
        told.update((empty[place.location], place.occupancy) for place in codes.places if place.share > 0.9)
    return told


@pytest.mark.parametrize(("seed", "exposure"), [(1, 0.7), (2, 1.4)])
def test_dark_goods_are_never_taken_for_an_empty_place(seed: int, exposure: float) -> None:
    told = judged(seed, exposure)
    assert sum(count for (empty, _), count in told.items() if not empty) >= 10
    assert told[False, Occupancy.EMPTY] == 0
    assert told[True, Occupancy.EMPTY] >= 0.9 * sum(count for (empty, _), count in told.items() if empty) >= 6


@pytest.mark.parametrize(("exposure", "part", "light"), [(4.0, 0.3, Light.BURNT), (0.06, 6.0, Light.DIM)])
def test_another_exposure_makes_labels_readable_that_were_burnt_out_or_in_the_dark(
    exposure: float, part: float, light: Light
) -> None:
    glossy = StockShares(0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    look = replace(RackAppearance(), shares=glossy, exposure=exposure)
    assigner = Assigner(SITE, FrontSight(CAMERA.lens, CAMERA.mount))
    read: Counter[float] = Counter()
    lights: set[Light] = set()
    for seen in shelf_pictures(SITE, CAMERA, look, 3, ("A2",), (1.0, part)):
        codes, _ = read_shelf(seen.picture, 0, 0, assigner.places(seen.pose, seen.view.locations), seen.part)
        found = assigner.look(codes, seen.pose, (seen.view.aisle, seen.view.side)).reads
        read[seen.part] += len({placed.location for placed in found if placed.location})
        if seen.part == 1.0:
            lights |= {place.light for place in codes.places}
    assert light in lights
    assert read[part] >= read[1.0] + 2
