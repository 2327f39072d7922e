"""Rendered shelves through the reader: codes in their places, empty places told, none told wrongly."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from flightd.core.scanning import CodeSet, Occupancy, PictureWorth
from flightd.mission.scan.code_assignment import Assigner, FrontSight, ShelfLook
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.front_camera import FrontCamera
from flightd.sim.racks.stock import StockShares, StockSituation
from flightd.sim.racks.stock_truth import LocationTruth, stock_truth
from flightd.site.site_file import load_site
from flightd.vision.shelf.evidence_jpeg import MOST_BYTES, picture_name
from flightd.vision.shelf.shelf_look import read_shelf
from tests.sim.pictures.shelf_pictures import shelf_pictures

SITE = load_site(Path(__file__).parents[3] / "configs" / "site-racks-small.toml")
CAMERA = FrontCamera()
SIGHT = FrontSight(CAMERA.lens, CAMERA.mount)
LOOK = replace(RackAppearance(), shares=StockShares(empty=0.35, occluded=0.1, missing=0.1, dark=0.0))
SEED = 4


@pytest.fixture(scope="module")
def looks() -> list[tuple[CodeSet, ShelfLook, dict[str, bytes]]]:
    """One picture of each view of three nodes, its pose known as well as in flight."""
    assigner = Assigner(SITE, SIGHT)
    found = []
    for seen in shelf_pictures(SITE, CAMERA, LOOK, SEED, ("A1", "A3", "B2")):
        places = assigner.places(seen.pose, seen.view.locations)
        codes, evidence = read_shelf(seen.picture, seen.pose.stamp_ns, seen.pose.stamp_ns, places)
        found.append((codes, assigner.look(codes, seen.pose, (seen.view.aisle, seen.view.side)), evidence))
    return found


@pytest.fixture(scope="module")
def truth() -> dict[str, LocationTruth]:
    return stock_truth(SITE, LOOK, CAMERA.lens.fx_px, SEED)


Looks = list[tuple[CodeSet, ShelfLook, dict[str, bytes]]]
Truth = dict[str, LocationTruth]


def test_no_picture_is_made_of_a_place_where_that_would_be_worth_no_more_than_the_one_that_is_kept() -> None:
    (seen,) = itertools.islice(shelf_pictures(SITE, CAMERA, LOOK, SEED, ("A1",)), 1)
    places = Assigner(SITE, SIGHT).places(seen.pose, seen.view.locations)
    full, all_kept = read_shelf(seen.picture, 0, 0, places)
    assert len(all_kept) == len(places)
    best = [replace(place, kept=PictureWorth(True, True, 1.0)) for place in places]
    codes, kept = read_shelf(seen.picture, 0, 0, best)
    assert not kept
    assert [replace(look, evidence="") for look in full.places] == list(codes.places)
    worse = [replace(place, kept=PictureWorth(False, False, 1.0)) for place in places]
    assert read_shelf(seen.picture, 0, 0, worse)[1] == all_kept


def test_the_label_of_the_place_itself_makes_no_picture_worth_more() -> None:
    assigner = Assigner(SITE, SIGHT)
    labels = stock = 0
    for seen in shelf_pictures(SITE, CAMERA, LOOK, SEED, ("A1", "A3")):
        places = assigner.places(seen.pose, seen.view.locations)
        kept = [replace(place, kept=PictureWorth(False, True, 1.0)) for place in places]
        codes, made = read_shelf(seen.picture, 0, 0, kept)
        read = assigner.look(codes, seen.pose, (seen.view.aisle, seen.view.side)).reads
        with_stock = {placed.likeliest for placed in read}
        assert {look.location for look in codes.places if look.code} <= with_stock
        assert {look.evidence for look in codes.places if not look.code} <= {""}
        labels += len({one.text for one in codes.reads} & {place.location for place in places} - with_stock)
        stock += len(made)
    assert labels >= 1
    assert stock >= 2


def test_empty_places_are_told_and_no_other_is_ever_called_empty(looks: Looks, truth: Truth) -> None:
    told = Counter(
        (truth[place.location].situation == StockSituation.EMPTY, place.occupancy)
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
