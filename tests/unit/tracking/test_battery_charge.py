"""What a battery is believed to hold: age, plausibility and the volts of a cell under load decide."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from flightd.config.battery import BatteryConfig
from flightd.core.types import Attitude, LandedState, VehicleState
from flightd.tracking.battery_charge import BatteryCharge, Charge, ChargeDoubt, told_charge

S = 10**9
START_NS = 1000 * S
STATE = VehicleState(
    Attitude(0, 0.0, 0.0, 0.0), 1.5, 0, 0.0, "GUIDED", True, True, LandedState.IN_AIR, 0.8, 15.4, 0
)


def judged(
    seconds: int,
    config: BatteryConfig | None = None,
    *,
    flying: bool = True,
    silent_from_s: int | None = None,
    drains: bool = True,
    **told: object,
) -> Charge:
    """After so long, told of each second until `silent_from_s`, by default of a 4S battery that drains."""
    judge, charge = BatteryCharge(config or BatteryConfig(cells=4)), Charge(math.nan)
    for second in range(seconds + 1):
        now_ns = START_NS + second * S
        heard_ns = now_ns if silent_from_s is None else min(now_ns, START_NS + silent_from_s * S)
        state = replace(STATE, battery_stamp_ns=heard_ns)
        if drains:
            state = replace(state, battery_frac=0.8 - round(second / 600, 2))
        charge = judge.step(now_ns, replace(state, **told), flying=flying)  # type: ignore[arg-type]
    return charge


def test_a_battery_that_is_told_of_is_believed() -> None:
    charge = judged(60)
    assert charge.doubt is None
    assert charge.frac == pytest.approx(0.7)
    assert charge.cell_v == pytest.approx(3.85)
    assert not charge.low


def test_a_charge_that_is_told_no_longer_is_not_known() -> None:
    assert judged(9, silent_from_s=0).doubt is None
    charge = judged(12, silent_from_s=0)
    assert charge.doubt is ChargeDoubt.SILENT
    assert math.isnan(charge.frac)
    assert judged(12, silent_from_s=0, flying=False).doubt is ChargeDoubt.SILENT


def test_a_charge_that_the_vehicle_does_not_know_is_no_old_one() -> None:
    judge = BatteryCharge(BatteryConfig())
    judge.step(START_NS, STATE, flying=True)
    unknown = replace(STATE, battery_frac=math.nan)
    assert judge.step(START_NS + 2 * S, unknown, flying=True).frac == 0.8  # one message without it
    assert judge.step(START_NS + 4 * S, unknown, flying=True).doubt is ChargeDoubt.UNKNOWN
    assert told_charge(unknown).doubt is ChargeDoubt.UNKNOWN
    assert told_charge(None).doubt is ChargeDoubt.UNKNOWN


def test_a_charge_that_stands_still_in_flight_is_not_believed() -> None:
    assert judged(55, drains=False).doubt is None
    assert judged(62, drains=False).doubt is ChargeDoubt.FROZEN
    assert judged(62, drains=False, flying=False).doubt is None
    assert judged(600, BatteryConfig(frozen=1.0), drains=False).doubt is None
    assert judged(200, BatteryConfig(flight_s=3000.0), drains=False).doubt is None


def test_a_charge_that_flickers_between_two_percents_stands_still_too() -> None:
    judge = BatteryCharge(BatteryConfig())
    doubts = []
    for second in range(90):
        state = replace(
            STATE, battery_stamp_ns=START_NS + second * S, battery_frac=0.8 - second % 3 // 2 / 100
        )
        doubts.append(judge.step(START_NS + second * S, state, flying=True).doubt)
    assert doubts[55] is None
    assert set(doubts[62:]) == {ChargeDoubt.FROZEN}


@pytest.mark.parametrize("flight_s", [600, 1800])
def test_a_battery_that_lasts_three_times_as_long_as_believed_does_not_stand_still(flight_s: int) -> None:
    judge = BatteryCharge(BatteryConfig(flight_s=600.0))
    for second in range(flight_s // 2):
        frac = round(0.9 - second / flight_s + 0.005 * (second % 2), 2)  # flickers, too
        state = replace(STATE, battery_stamp_ns=START_NS + second * S, battery_frac=frac)
        assert judge.step(START_NS + second * S, state, flying=True).doubt is None


def test_a_charge_that_rises_in_flight_counts_for_little() -> None:
    judge = BatteryCharge(BatteryConfig())
    judge.step(START_NS, replace(STATE, battery_frac=0.3), flying=True)
    risen = judge.step(START_NS + S, replace(STATE, battery_frac=1.0), flying=True)  # the autopilot rebooted
    assert risen.frac == pytest.approx(0.35)
    judge.step(START_NS + 2 * S, STATE, flying=False)  # another battery, on the ground
    assert judge.step(START_NS + 3 * S, replace(STATE, battery_frac=1.0), flying=True).frac == 1.0


@pytest.mark.parametrize(
    ("volts", "low", "empty"), [(14.4, False, False), (13.6, True, False), (13.1, True, True)]
)
def test_the_volts_of_a_cell_decide_whatever_the_charge(volts: float, low: bool, empty: bool) -> None:
    charge = judged(5, battery_v=volts)
    assert (charge.low, charge.empty) == (low, empty)
    assert not judged(1, battery_v=volts).low, "a cell sags for a moment"
    assert not judged(5, battery_v=volts, flying=False).low


def test_the_cells_are_those_of_the_configuration_else_those_that_are_told() -> None:
    assert judged(1, battery_v=12.0, battery_cells=3).cell_v == pytest.approx(3.0)  # a 3S voltage on 4S
    assert judged(1, BatteryConfig(), battery_v=12.0, battery_cells=3).cell_v == pytest.approx(4.0)
    assert math.isnan(judged(1, BatteryConfig(), battery_v=12.0).cell_v)


@pytest.mark.parametrize("volts", [25.0, 5.0])
def test_volts_that_the_cells_cannot_have_are_a_doubt(volts: float) -> None:
    assert judged(5, battery_v=volts).doubt is ChargeDoubt.CELLS
    assert not judged(5, battery_v=volts).empty


def test_a_battery_of_one_cell_more_than_is_configured_is_a_doubt_before_it_is_half_empty() -> None:
    assert judged(5, BatteryConfig(cells=3), battery_v=13.4).doubt is ChargeDoubt.CELLS  # 3.35 V in each of 4
    assert judged(5, BatteryConfig(cells=3), battery_v=13.05).doubt is None  # 4.35 V, the fullest there are


def test_volts_that_are_told_no_longer_in_flight_are_a_doubt() -> None:
    """Charge alone, counted from full, would decide."""
    judge = BatteryCharge(BatteryConfig(cells=4))
    for second in range(20):
        state = replace(STATE, battery_stamp_ns=START_NS + second * S, battery_frac=0.8 - second / 600)
        told = state if second < 10 else replace(state, battery_v=math.nan)
        charge = judge.step(START_NS + second * S, told, flying=True)
        assert (charge.doubt is ChargeDoubt.VOLTS) is (second > 12)
    unheard = BatteryCharge(BatteryConfig(cells=4))  # one that never told any
    for second in range(20):
        state = replace(STATE, battery_stamp_ns=START_NS + second * S, battery_v=math.nan)
        assert unheard.step(START_NS + second * S, state, flying=True).doubt is None
