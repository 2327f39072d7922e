"""Each level of a rack front is judged in its own light, whatever the next one's is."""

from __future__ import annotations

from dataclasses import replace

import pytest

from flightd.config.paths import shipped
from flightd.core.scanning import Light, PlaceLook
from flightd.mission.scan.code_assignment import Assigner, FrontSight
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.front_camera import FrontCamera
from flightd.site.site_file import load_site
from flightd.vision.shelf.shelf_look import read_shelf
from tests.sim.pictures.shelf_pictures import shelf_pictures

SITE = load_site(shipped("site-racks-small.toml"))
CAMERA = FrontCamera()


def looks(low: float, high: float, *, both: bool = False) -> dict[int, list[PlaceLook]]:
    """What the pictures taken for each level show of its places, or of all of the front, with that light on
    the lower level and on the upper one."""
    light = {f"A left {level}": factor for level, factor in ((1, low), (2, high))}
    look = replace(RackAppearance(), light=light)
    assigner = Assigner(SITE, FrontSight(CAMERA.lens, CAMERA.mount))
    levels = {code: place.level for code, place in SITE.locations.items()}
    found: dict[int, list[PlaceLook]] = {1: [], 2: []}
    for seen in shelf_pictures(SITE, CAMERA, look, 6, ("A2", "A3")):
        if seen.view.side.value == "left":
            wanted = [code for code in levels if code.startswith("AL")] if both else seen.view.locations
            codes, _ = read_shelf(seen.picture, 0, 0, assigner.places(seen.pose, wanted))
            for place in codes.places:
                found[levels[place.location]].append(place)
    return found


def test_white_is_that_of_the_labels_on_the_places_own_level() -> None:
    found = looks(0.7, 1.1, both=True)
    whites = {level: [place.white for place in places if place.white] for level, places in found.items()}
    assert all(len(level) >= 4 for level in whites.values())
    assert max(whites[1]) < min(whites[2])
    assert sum(whites[1]) / len(whites[1]) == pytest.approx(0.7 * 200.0, rel=0.15)


def test_what_is_burnt_out_above_burns_out_nothing_below() -> None:
    found = looks(1.0, 4.0)
    assert {place.light for place in found[2]} == {Light.BURNT}
    assert {place.light for place in found[1]} == {Light.FAIR}


def test_nothing_is_told_of_a_level_in_the_dark_below_a_bright_one() -> None:
    found = looks(0.35, 1.0)
    dark = [place for place in found[1] if place.white]
    assert dark
    assert {place.light for place in dark} == {Light.DIM}
    assert all(place.fill is None or place.fill.share is None for place in dark)
