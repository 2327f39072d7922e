"""What a simulated autopilot tells of its battery is what it measures, not what the battery holds."""

from __future__ import annotations

import pytest

from flightd.sim.autopilot.telemetry import Instruments
from flightd.sim.plant.airframe import Airframe, AirframeCommand, AirframeParams
from flightd.sim.sensors.battery_monitor import MonitorParams
from flightd.sim.sensors.instruments import SensorParams, Sensors
from tests.rigs.vehicles import CALM

STEP_S = 0.005
HOVER = AirframeCommand(True, collective=AirframeParams().hover_collective)
SYS_STATUS, BATTERY_STATUS = 1, 147


def flown(airframe: Airframe, sensors: Sensors, seconds: float) -> None:
    for _ in range(round(seconds / STEP_S)):
        airframe.step(STEP_S, HOVER)
        sensors.update(STEP_S, airframe)


def test_the_charge_is_counted_by_a_current_that_is_measured_of_a_capacity_that_is_configured() -> None:
    airframe = Airframe(AirframeParams(battery_capacity_ah=0.4), CALM)
    monitor = MonitorParams(capacity_ah=0.5, current_share=0.9, volt_share=1.01)
    sensors = Sensors(SensorParams(battery=monitor))
    flown(airframe, sensors, 30.0)
    gone = 1.0 - airframe.battery_frac
    assert gone > 0.2
    assert 1.0 - sensors.battery.charge_frac == pytest.approx(gone * 0.9 * 0.4 / 0.5, rel=1e-4)
    instruments = Instruments(airframe, sensors)
    (status,), (battery,) = instruments.messages(SYS_STATUS), instruments.messages(BATTERY_STATUS)
    assert status.battery_remaining == battery.battery_remaining == round(sensors.battery.charge_frac * 100)
    assert status.voltage_battery == pytest.approx(airframe.battery_v * 1010, abs=1)
    assert status.current_battery == battery.current_battery == round(airframe.current_a * 90)
    assert battery.current_consumed == round(gone * 0.9 * 400)


def test_without_errors_the_charge_that_is_told_is_the_one_that_it_holds() -> None:
    airframe = Airframe(AirframeParams(battery_capacity_ah=0.4), CALM, battery_frac=0.6)
    sensors = Sensors(SensorParams(battery=MonitorParams(0.4)))
    flown(airframe, sensors, 30.0)
    assert airframe.battery_frac < 0.4
    assert sensors.battery.charge_frac == pytest.approx(airframe.battery_frac)


def test_what_is_done_to_the_battery_is_told() -> None:
    airframe = Airframe(AirframeParams(battery_capacity_ah=0.4), CALM)
    sensors = Sensors(SensorParams(battery=MonitorParams(0.8)))
    flown(airframe, sensors, 30.0)
    told = sensors.battery.charge_frac
    airframe.battery_frac -= 0.2
    flown(airframe, sensors, STEP_S)
    assert sensors.battery.charge_frac == pytest.approx(told - 0.2, abs=1e-3)
    airframe.battery_frac = 1.0
    flown(airframe, sensors, STEP_S)
    assert sensors.battery.charge_frac == 1.0


def test_a_full_battery_is_told_to_be_full_whatever_was_counted_of_the_last_one() -> None:
    airframe = Airframe(AirframeParams(battery_capacity_ah=0.4), CALM)
    sensors = Sensors(SensorParams(battery=MonitorParams(0.4, current_share=1.3)))
    flown(airframe, sensors, 30.0)
    assert sensors.battery.charge_frac < airframe.battery_frac - 0.05
    airframe.battery_frac = 1.0
    for _ in range(3):  # contacts keep it full
        flown(airframe, sensors, STEP_S)
        airframe.battery_frac = 1.0
        assert sensors.battery.charge_frac == pytest.approx(1.0, abs=1e-5)
