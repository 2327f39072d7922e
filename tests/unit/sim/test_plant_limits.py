"""What a rough world's airframe is able to, the air beside racks, and a range finder above goods."""

from __future__ import annotations

import math
import statistics

import pytest

from flightd.config.paths import shipped
from flightd.sim.floor.paint_damage import PALLET_HEIGHT_M
from flightd.sim.plant.airframe import Airframe, AirframeCommand, AirframeParams
from flightd.sim.plant.wash import Wash
from flightd.sim.plant.wind import WindParams
from flightd.sim.sensors.instruments import Goods, SensorParams, Sensors
from flightd.sim.unknowns import WorldKind, unknowns_of
from flightd.site.site_file import load_site

STEP_S = 0.005
CALM = WindParams(gust_rms_mps=0.0, vertical_gust_rms_mps=0.0)
EXACT = SensorParams(range_noise_m=0.0, range_dropout=0.0, range_step_m=0.001)
HOVER = AirframeParams().hover_collective


def flown(airframe: Airframe, seconds: float, command: AirframeCommand) -> Airframe:
    for _ in range(round(seconds / STEP_S)):
        airframe.step(STEP_S, command)
    return airframe


def test_a_battery_that_sags_takes_thrust_as_it_empties() -> None:
    lifts = [
        flown(
            Airframe(AirframeParams(sags=True), CALM, battery_frac=charge), 0.3, AirframeCommand(True)
        ).lift(HOVER)
        for charge in (1.0, 0.5, 0.1)
    ]
    assert lifts[0] > lifts[1] > lifts[2]
    assert 0.7 < lifts[2] / lifts[0] < 0.85
    assert Airframe(battery_frac=0.1).lift(HOVER) == 1.0


def test_a_cell_rests_at_a_voltage_between_those_of_its_table() -> None:
    per_cell_v = [
        Airframe(battery_frac=charge).battery_v / AirframeParams().battery_cells
        for charge in (-0.1, 0.0, 0.025, 0.5, 0.65, 0.9, 1.0, 1.1)
    ]
    assert per_cell_v == pytest.approx([3.3, 3.3, 3.4, 3.84, 3.93, 4.11, 4.2, 4.2])


def test_motors_lift_no_more_than_they_can_and_turn_less_near_it() -> None:
    weak = AirframeParams(thrust_to_weight=1.7)
    assert Airframe(weak).lift(1.0) == 1.7
    assert Airframe().lift(1.0) == pytest.approx(1.0 / HOVER)

    def turned_rad(params: AirframeParams, collective: float) -> float:
        airframe = flown(Airframe(params, CALM), 2.0, AirframeCommand(True, collective=collective))
        return flown(airframe, 0.1, AirframeCommand(True, roll_rad=0.6, collective=collective)).roll_rad

    assert turned_rad(weak, 1.1 * HOVER) == turned_rad(AirframeParams(), 1.1 * HOVER)
    assert turned_rad(weak, 1.7 * HOVER) < 0.6 * turned_rad(AirframeParams(), 1.7 * HOVER)


def test_the_air_that_comes_back_is_strong_beside_floor_and_racks_and_gone_away_from_them() -> None:
    site = load_site(shipped("site-demo.toml"))
    shelf = site.shelves[0]
    middle_m = (shelf.x0_m + shelf.x1_m) / 2

    def rms_mps(y_m: float, height_m: float, seed: int = 3) -> float:
        wash, felt = Wash(0.4, site.shelves, seed), []
        for _ in range(20_000):
            wash.step(STEP_S, middle_m, y_m, height_m)
            felt.append(wash.x_mps)
        return math.sqrt(statistics.fmean(one * one for one in felt))

    assert rms_mps(shelf.y_m, 1.6) == pytest.approx(0.4, rel=0.25)
    assert rms_mps(shelf.y_m, 1.6) == rms_mps(shelf.y_m, 1.6)
    assert rms_mps(shelf.y_m + 100.0, 0.0) == pytest.approx(0.4, rel=0.2)
    assert rms_mps(shelf.y_m + 100.0, 3.0) < 0.01
    assert rms_mps(shelf.y_m, shelf.height_m + 3.0) < 0.01


def test_the_range_finder_follows_late_and_steps_over_goods() -> None:
    stands = Goods(1.0, -1.0, 2.0, 1.0, 0.4)
    airframe, air = Airframe(wind=CALM), AirframeCommand(True, collective=HOVER)
    airframe.height_m = 1.6
    sensors = Sensors(SensorParams(range_noise_m=0.0, range_dropout=0.0, range_lag_s=0.1, goods=[stands]))
    read = []
    for n in range(200):
        airframe.step(STEP_S, air)
        airframe.height_m, airframe.x_m = 1.6, 0.0 if n < 100 else 1.5
        sensors.update(STEP_S, airframe)
        read.append(sensors.range_m(airframe))
    assert read[99] == pytest.approx(1.6, abs=0.011)
    assert read[100 + 20] == pytest.approx(1.2 + 0.4 * math.exp(-1.0), abs=0.03)
    assert read[-1] == pytest.approx(1.2, abs=0.011)


def test_some_readings_come_back_by_a_longer_way() -> None:
    airframe = Airframe(wind=CALM)
    airframe.height_m = 1.6
    sensors = Sensors(SensorParams(range_noise_m=0.0, range_dropout=0.0, range_echo=0.1))
    read = [sensors.range_m(airframe) for _ in range(2000)]
    long = [one for one in read if one > 1.65]
    assert 0.07 < len(long) / len(read) < 0.13
    assert min(long) >= 1.15 * 1.6 - 0.01
    assert max(long) <= 1.8 * 1.6 + 0.01
    exact = Sensors(EXACT)
    assert {exact.range_m(airframe) for _ in range(200)} == {1.6}


def test_the_plant_that_is_drawn_is_within_its_world() -> None:
    site = load_site(shipped("site-demo.toml"))
    usual, rough = unknowns_of(WorldKind.USUAL, 5), unknowns_of(WorldKind.ROUGH, 5)
    assert usual.wash(site, 5) is None
    assert rough.wash(site, 5) is not None
    assert (usual.airframe(AirframeParams()).sags, usual.thrust_to_weight) == (False, None)
    shares = [unknowns_of(WorldKind.ROUGH, seed).drag_share for seed in range(100)]
    assert 0.75 <= min(shares) < 0.8
    assert 1.2 < max(shares) <= 1.25
    assert rough.airframe(AirframeParams()).drag_per_s == rough.drag_share * AirframeParams().drag_per_s


def test_a_pallet_that_lies_on_the_paint_is_below_the_range_finder() -> None:
    site = load_site(shipped("site-demo.toml"))
    kinds = {seed: unknowns_of(WorldKind.ROUGH, seed).paint_damage(site, seed).pallets for seed in range(8)}
    seed, (pallet, *_) = next((seed, found) for seed, found in kinds.items() if found)
    goods = [Goods(*pallet, PALLET_HEIGHT_M)]
    airframe = Airframe(wind=CALM, x_m=(pallet[0] + pallet[2]) / 2, y_m=(pallet[1] + pallet[3]) / 2)
    airframe.height_m = 1.6
    sensors = Sensors(SensorParams(range_noise_m=0.0, range_dropout=0.0, goods=goods), seed)
    assert sensors.range_m(airframe) == pytest.approx(1.6 - 0.144, abs=0.006)
