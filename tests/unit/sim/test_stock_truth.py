"""What stands in the simulated racks, and how a count is scored against it."""

import json
from collections import Counter
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from flightd.core.errors import InputError
from flightd.core.inventory import LocationRecord, LocationState, Observation, PlaceFill
from flightd.core.types import CodeRead
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.code_symbols import Symbol, Symbology
from flightd.sim.racks.rack_layout import BEAM_M, faces, rack_levels
from flightd.sim.racks.stock import Condition, StockPlace, StockShares, StockSituation, stock
from flightd.sim.racks.stock_truth import LocationTruth, score_stock, stock_truth, write_truth
from flightd.sim.scenario.scenario_files import load_scenario
from flightd.site.site import Rack
from flightd.site.site_file import load_site

SITE = load_site(Path(__file__).parents[3] / "configs" / "site-racks.toml")
FOCAL_PX = 1000.0


@cache
def places() -> dict[str, StockPlace]:
    return dict(stock(SITE, StockShares(), FOCAL_PX, 1))


@cache
def truth() -> dict[str, LocationTruth]:
    return stock_truth(SITE, RackAppearance(), FOCAL_PX, 1)


def record(code: str, state: LocationState, *texts: str) -> LocationRecord:
    reads = tuple(CodeRead("QR Code", text, (), True, 2, 1.0) for text in texts)
    return LocationRecord(code, "A1", Observation("run", code, 1, state, 0.9, reads))


def perfect_count() -> dict[str, LocationRecord]:
    return {
        place.code: record(place.code, place.state, *sorted(place.readable)) for place in truth().values()
    }


def of_situation(situation: StockSituation) -> LocationTruth:
    return next(place for place in truth().values() if place.situation == situation)


def test_the_shipped_site_has_more_than_a_thousand_locations_on_four_levels() -> None:
    assert len(SITE.locations) >= 1000
    assert {location.level for location in SITE.locations.values()} == {1, 2, 3, 4}
    assert len(SITE.aisles) == 10


def test_every_location_has_its_opening_and_it_fits_between_deck_and_beam() -> None:
    found = {opening.location.code: opening for face in faces(SITE) for opening in face.openings}
    assert found.keys() == SITE.locations.keys()
    for opening in found.values():
        assert opening.level.deck_m < opening.location.height_m < opening.level.top_m


@pytest.mark.parametrize("levels_m", [(0.3,), (0.0, 1.2), (0.5, 1.2, 1.9, 2.6), (0.2, 0.35, 3.0)])
def test_decks_rise_and_leave_room_for_a_beam(levels_m: tuple[float, ...]) -> None:
    levels = rack_levels(Rack(("A",), 1.2, levels_m), 3.3)
    assert all(level.deck_m >= BEAM_M - 1e-9 for level in levels)
    assert levels[-1].top_m > levels[-1].deck_m


def test_stock_is_the_same_for_the_same_seed_and_another_for_another() -> None:
    assert stock(SITE, StockShares(), FOCAL_PX, 1) == places()
    assert stock(SITE, StockShares(), FOCAL_PX, 2) != places()


def test_no_text_hangs_twice() -> None:
    texts = [label.symbol.text for place in places().values() for label in place.labels]
    assert len(texts) == len(set(texts)) > 900
    assert not set(texts) & SITE.locations.keys()


def test_every_symbology_and_situation_occurs_about_as_often_as_asked() -> None:
    counts = Counter(place.situation for place in places().values())
    for name in StockShares.names():
        share = getattr(StockShares(), name)
        assert counts[StockSituation(name)] / len(places()) == pytest.approx(share, abs=0.03)
    kinds = Counter(label.symbol.symbology for place in places().values() for label in place.labels)
    assert all(kinds[symbology] > 50 for symbology in Symbology)


def test_readable_labels_are_large_enough_and_the_small_ones_too_small() -> None:
    for place in places().values():
        location = place.opening.location
        distance_m = abs(location.y_m - SITE.nodes[location.node].y_m)
        for label in place.labels:
            px = FOCAL_PX * label.module_m / (distance_m + 0.05)
            assert (px < 1.0) if label.condition is Condition.TOO_SMALL else (px >= 2.5)


def test_labels_hang_on_their_goods() -> None:
    for place in places().values():
        for label in place.labels:
            assert place.goods is not None
            reach_m = label.paper_size_m[0] / 2
            assert abs(label.right_m - place.goods.right_m) + reach_m < place.goods.width_m / 2 + 0.03
            above_m = label.height_m - place.opening.level.deck_m
            assert label.paper_size_m[1] / 2 < above_m < place.goods.height_m


def test_a_gs1_symbol_tells_its_elements_with_separators() -> None:
    assert Symbol(Symbology.CODE_128, "(10)AB12(21)77").text == "10AB12\x1d2177"
    assert Symbol(Symbology.DATA_MATRIX, "(00)340123450000000013").text == "00340123450000000013"
    assert Symbol(Symbology.QR, "PAL-7/L1").text == "PAL-7/L1"


def test_shares_beyond_one_are_one_clear_line(tmp_path: Path) -> None:
    file = tmp_path / "full.toml"
    file.write_text("[racks]\nempty = 0.7\ntorn = 0.7\n")
    with pytest.raises(InputError, match=r"full\.toml: racks: .*shares of places are 1\.7"):
        load_scenario(file)


def test_a_scenario_sets_shares_and_camera(tmp_path: Path) -> None:
    file = tmp_path / "half.toml"
    file.write_text("[racks]\nempty = 0.5\nseed = 4\n[front_camera]\nwidth_px = 640\n")
    scenario = load_scenario(file)
    assert scenario.racks.appearance() == RackAppearance(replace(StockShares(), empty=0.5), seed=4)
    assert scenario.front_camera.camera().lens.centre_px == (319.5, 399.5)


def test_the_racks_own_seed_keeps_the_stock_whatever_the_flights_seed_is() -> None:
    look = RackAppearance(seed=4)
    assert stock_truth(SITE, look, FOCAL_PX, 1) == stock_truth(SITE, look, FOCAL_PX, 2)


def test_a_perfect_count_scores_perfectly() -> None:
    score = score_stock(truth(), perfect_count().values())
    assert score.locations_right == score.locations_visited == score.locations_planned == len(SITE.locations)
    assert score.codes_read == score.codes_expected > 800
    assert score.empty_right == score.empty_expected > 100
    assert score.unreadable_told == score.unreadable_expected > 80
    assert (score.codes_wrong, score.empty_wrong) == (0, 0)


def test_nothing_counted_is_nothing_wrong() -> None:
    score = score_stock(truth(), [])
    assert score.codes_expected > 800
    assert (score.codes_read, score.codes_wrong, score.locations_visited, score.locations_right) == (0,) * 4


def test_a_misread_text_is_wrong() -> None:
    place = of_situation(StockSituation.CLEAN)
    score = score_stock(truth(), [record(place.code, LocationState.READ, "nobody's")])
    assert (score.codes_read, score.codes_wrong) == (0, 1)


def test_the_right_text_at_the_neighbours_place_is_wrong() -> None:
    here, there = of_situation(StockSituation.CLEAN), of_situation(StockSituation.TILTED)
    (text,) = there.readable
    score = score_stock(truth(), [record(here.code, LocationState.READ, text)])
    assert (score.codes_read, score.codes_wrong) == (0, 1)


def test_a_locations_own_label_told_as_goods_is_wrong() -> None:
    place = of_situation(StockSituation.EMPTY)
    score = score_stock(truth(), [record(place.code, LocationState.READ, place.code)])
    assert (score.codes_wrong, score.empty_right) == (1, 0)


def test_one_of_two_labels_is_half_a_success() -> None:
    place = of_situation(StockSituation.SEVERAL)
    score = score_stock(truth(), [record(place.code, LocationState.READ, min(place.readable))])
    assert (score.codes_read, score.codes_wrong, score.locations_right) == (1, 0, 0)


def test_a_torn_label_that_was_read_all_the_same_is_not_wrong() -> None:
    place = of_situation(StockSituation.TORN)
    score = score_stock(truth(), [record(place.code, LocationState.READ, *place.texts)])
    assert (score.codes_wrong, score.unreadable_told) == (0, 0)


def test_goods_called_empty_are_counted_and_occluded_for_unreadable_is_not_held_against_anyone() -> None:
    clean, covered = of_situation(StockSituation.CLEAN), of_situation(StockSituation.OCCLUDED)
    records = [record(clean.code, LocationState.EMPTY), record(covered.code, LocationState.UNREADABLE)]
    score = score_stock(truth(), records)
    assert (score.empty_wrong, score.unreadable_told, score.locations_right) == (1, 1, 0)


def test_only_planned_locations_are_expected() -> None:
    place = of_situation(StockSituation.CLEAN)
    score = score_stock(truth(), [], planned=[place.code])
    assert (score.locations_planned, score.codes_expected) == (1, 1)


def test_the_truth_file_is_json_with_every_location(tmp_path: Path) -> None:
    write_truth(tmp_path / "truth.json", truth(), 1)
    written = json.loads((tmp_path / "truth.json").read_text())
    assert [place["code"] for place in written["locations"]] == list(SITE.locations)
    assert {place["state"] for place in written["locations"]} == {
        "read",
        "several",
        "empty",
        "unreadable",
        "occluded",
    }


def test_how_full_places_are_is_right_within_ten_points_and_unknown_is_not_told() -> None:
    code, place = next((code, place) for code, place in truth().items() if place.fill > 0.5)

    def scored(share: float | None) -> tuple[int, int]:
        looked = record(code, LocationState.UNREADABLE)
        assert looked.observation is not None
        seen = replace(looked, observation=replace(looked.observation, fill=PlaceFill(share)))
        score = score_stock(truth(), [seen])
        return score.fill_told, score.fill_right

    assert [scored(share) for share in (place.fill + 0.09, place.fill - 0.11, None)] == [
        (1, 1),
        (1, 0),
        (0, 0),
    ]
