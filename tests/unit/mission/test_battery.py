"""Charge as time: consumption learnt, ways back reckoned, plans cut into sorties."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.config.battery import BatteryConfig
from flightd.config.mission import Heading
from flightd.config.scan import ScanConfig
from flightd.core.errors import InputError
from flightd.core.scanning import CountedPlace
from flightd.mission.battery.consumption import BatteryGauge
from flightd.mission.battery.sorties import Sorties, check_battery
from flightd.mission.plan.flight_plan import HeadingPolicy, make_plan
from flightd.mission.plan.leg_times import Legs, Pace
from flightd.mission.reasons import in_words
from flightd.mission.scan.scanner import Scanner
from flightd.site.site_file import load_site
from tests.unit.mission import shelves
from tests.unit.mission.configured import configured

LARGE = load_site(Path(__file__).parents[3] / "configs" / "site-large.toml")
POLICY = HeadingPolicy(Heading.ALONG)
LEGS = Legs(LARGE, POLICY, Pace.of(configured().mission))
S = 10**9


@settings(max_examples=40, deadline=None)
@given(st.floats(120, 3000), st.floats(120, 3000))
def test_the_true_consumption_is_learnt_from_a_gauge_in_whole_percents(
    believed_s: float, true_s: float
) -> None:
    gauge = BatteryGauge(believed_s)
    for second in range(0, round(0.9 * true_s), 5):
        gauge.step(second * S, round(1.0 - second / true_s, 2), True)
    assert gauge.rate_per_s * true_s > 0.9, "never far too hopeful"
    gauge.step(3000 * S, 1.0, False)
    learnt = gauge.rate_per_s
    gauge.step(3001 * S, 1.0, True)
    assert gauge.rate_per_s == pytest.approx(learnt), "what was learnt outlives the swap"
    if true_s > 600:
        assert learnt * true_s == pytest.approx(1.0, abs=0.12 + 0.15 * true_s / believed_s)


def test_a_gauge_that_says_nothing_leaves_the_belief() -> None:
    gauge = BatteryGauge(500.0)
    gauge.step(0, math.nan, True)
    gauge.step(60 * S, math.nan, True)
    assert gauge.rate_per_s == pytest.approx(1 / 500)


def test_what_is_surely_left_falls_with_the_time_from_the_last_charge_known() -> None:
    gauge = BatteryGauge(500.0)
    assert math.isnan(gauge.sure_frac(0))
    gauge.step(0, 0.8, True)
    gauge.step(50 * S, 0.75, True)
    gauge.step(60 * S, math.nan, True)
    assert gauge.sure_frac(100 * S) == pytest.approx(0.65), "no less than what is configured"
    gauge.step(100 * S, 0.55, True)
    gauge.step(120 * S, math.nan, True)
    assert gauge.sure_frac(140 * S) == pytest.approx(0.45), "as fast as it was seen to go"
    gauge.step(150 * S, math.nan, False)
    assert math.isnan(gauge.sure_frac(150 * S))


def sorties(flight_s: float = 600.0) -> Sorties:
    return Sorties(LARGE, LEGS, BatteryConfig(flight_s=flight_s, reserve=0.1))


def test_it_turns_back_just_when_the_way_home_needs_what_is_left() -> None:
    back = sorties().way_back("J10")
    needed = back.seconds / 600.0 + 0.1
    for charge, turns in ((needed + 0.005, False), (needed - 0.005, True), (math.nan, False)):
        watch = sorties()
        watch.step(0, charge, True)
        assert (watch.must_return("J10", 0.0) is not None) is turns
    watch = sorties()
    watch.step(0, needed + 0.005, True)
    short = watch.must_return("J10", 8.0)
    assert short is not None, "the rest of the leg counts"
    assert "the way back to A1" in in_words(short)


def test_the_nearest_charge_pad_is_chosen() -> None:
    pad = replace(LARGE.pads[0], id="dock", node="J10", start=False)
    two = replace(LARGE, pads=(*LARGE.pads, pad))
    watch = Sorties(two, Legs(two, POLICY, LEGS.pace), BatteryConfig())
    assert watch.way_back("I9").pad == "J10"
    assert watch.way_back("B2").pad == "A1"


def test_what_no_full_battery_reaches_is_refused_before_the_flight() -> None:
    plan = make_plan(LARGE, ["A2", "J10"], "A1", "A1", POLICY)
    check_battery(LARGE, plan, POLICY, configured())
    weak = configured(battery=BatteryConfig(flight_s=90.0))
    with pytest.raises(InputError, match=r"battery\.flight_s = 90\) does not reach J10"):
        check_battery(LARGE, plan, POLICY, weak)


def test_what_is_left_to_count_at_a_stop_counts_as_flying_time() -> None:
    params = configured().mission
    legs = Legs(shelves.SITE, POLICY, Pace.of(params))
    scanner = Scanner(shelves.SITE, shelves.SIGHT, ScanConfig(max_height_m=4.0))
    battery = BatteryConfig(flight_s=600.0, reserve=0.1)
    counting = Sorties(shelves.SITE, legs, battery, scanner)
    scan_s = scanner.stop_s("A3", legs.pace)
    assert scan_s > 2 * len(shelves.SITE.racks[0].levels_m) * ScanConfig().view_s
    needed = 0.1 + (legs.way_s("A2", "A3") + scan_s + counting.way_back("A3").seconds) / 600.0
    for charge, short in ((needed + 0.002, False), (needed - 0.002, True)):
        counting.step(0, charge, False)
        assert (counting.must_not_go_on("A2", "A3") is not None) is short
    scanner.go_on_with(map(CountedPlace, shelves.SITE.locations))
    assert counting.must_not_go_on("A2", "A3") is None, "nothing left: a plain stop"


def test_a_count_that_no_battery_lasts_for_is_refused_before_the_flight() -> None:
    site, params = shelves.SITE, configured(battery=BatteryConfig(flight_s=70.0))
    plan = make_plan(site, ["A2"], "A1", "A1", POLICY)
    check_battery(site, plan, POLICY, params)
    scanner = Scanner(site, shelves.SIGHT, ScanConfig(max_height_m=4.0, view_s=20.0))
    with pytest.raises(InputError, match="does not reach A2, last for the stop there"):
        check_battery(site, plan, POLICY, params, scanner)
