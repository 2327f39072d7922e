"""Rendered shelves through the reader: codes in their places, empty places told, none told wrongly."""

from __future__ import annotations

import math
import random
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from flightd.config.site_file import load_site
from flightd.core.scanning import BodyPose, CodeSet, Occupancy
from flightd.mission.assign import Assigner, FrontSight, ShelfLook
from flightd.mission.views import ScanParams, ViewPlanner
from flightd.sim.kinematics import Kinematics
from flightd.sim.racks.camera import FrontCamera
from flightd.sim.racks.look import RackLook
from flightd.sim.racks.renderer import FrontRenderer
from flightd.sim.racks.stock import Situation, StockShares
from flightd.sim.racks.truth import LocationTruth, stock_truth
from flightd.vision.shelf import read_shelf
from flightd.vision.small_jpeg import MOST_BYTES, picture_name

SITE = load_site(Path(__file__).parents[2] / "configs" / "site-racks-small.toml")
CAMERA = FrontCamera()
SIGHT = FrontSight(CAMERA.lens, CAMERA.mount)
LOOK = replace(RackLook(), shares=StockShares(empty=0.35, occluded=0.1, missing=0.1))
SEED = 4


@pytest.fixture(scope="module")
def looks() -> list[tuple[CodeSet, ShelfLook, dict[str, bytes]]]:
    """One picture of each view of three nodes, its pose known as well as in flight."""
    assigner = Assigner(SITE, SIGHT)
    planner = ViewPlanner(SITE, SIGHT, assigner, ScanParams(max_height_m=4.0))
    renderer = FrontRenderer(SITE, CAMERA, LOOK, SEED)
    rng = random.Random(SEED)
    taken = []
    for node in ("A1", "A3", "B2"):
        for seq, view in enumerate(planner.views(node, frozenset(SITE.locations), 1.0, 0.0)):
            roll, pitch = rng.gauss(0, 0.01), rng.gauss(0, 0.01)
            at = (view.x_m + rng.gauss(0, 0.03), view.y_m + rng.gauss(0, 0.03), view.height_m)
            k = Kinematics(seq + 1, *at, 0.0, 0.0, 0.0, roll, pitch, view.yaw_rad, 0.0, 0.0, 0.0)
            pose = BodyPose(
                seq + 1,
                at[0] + rng.gauss(0, 0.01),
                at[1] + rng.gauss(0, 0.01),
                at[2] + rng.gauss(0, 0.01),
                roll,
                pitch,
                view.yaw_rad + rng.gauss(0, 0.003),
                0.01,
                0.01,
                0.004,
                True,
            )
            places = assigner.places(pose, view.locations)
            codes, evidence = read_shelf(renderer.render(k, seq), seq, k.stamp_ns, places)
            taken.append((codes, assigner.look(codes, pose, (view.aisle, view.side)), evidence))
    return taken


@pytest.fixture(scope="module")
def truth() -> dict[str, LocationTruth]:
    return stock_truth(SITE, LOOK, CAMERA.lens.fx_px, SEED)


Looks = list[tuple[CodeSet, ShelfLook, dict[str, bytes]]]
Truth = dict[str, LocationTruth]


def test_empty_places_are_told_and_no_other_is_ever_called_empty(looks: Looks, truth: Truth) -> None:
    told = Counter(
        (truth[place.location].situation == Situation.EMPTY, place.occupancy)
        for codes, _, _ in looks
        for place in codes.places
    )
    empties = sum(count for (empty, _), count in told.items() if empty)
    assert empties >= 5
    assert told[True, Occupancy.EMPTY] >= 0.9 * empties
    assert told[False, Occupancy.EMPTY] == 0


def test_no_code_is_given_to_another_location_and_most_are_read_at_first_sight(
    looks: Looks, truth: Truth
) -> None:
    read = [(p.location, p.read.text) for _, look, _ in looks for p in look.reads if p.location]
    assert all(text in truth[location].texts for location, text in read)
    wanted = {
        (place.location, text)
        for codes, _, _ in looks
        for place in codes.places
        for text in truth[place.location].readable
    }
    assert len(wanted) >= 8
    assert len(wanted & set(read)) >= 0.8 * len(wanted)


def test_location_labels_on_the_beams_agree_with_the_place(looks: Looks) -> None:
    sightings = [sighting for _, look, _ in looks for sighting in look.sightings]
    assert len(sightings) >= 6
    assert not [s for s in sightings if s.contradicts]
    assert [s for s in sightings if abs(s.off_m) > 0.2] == []


def test_each_place_leaves_a_small_picture_named_by_its_content(looks: Looks) -> None:
    for codes, _, evidence in looks:
        for place in codes.places:
            jpeg = evidence[place.evidence]
            assert len(jpeg) <= MOST_BYTES
            assert picture_name(jpeg) == place.evidence
        assert all(math.isfinite(ms) for ms in codes.timings_ms.values())
