"""What a simulated flight found out of its sensors, in its summary."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from flightd.app.simulation.prepare import SimOptions, prepare
from flightd.app.simulation.sensor_summary import sensor_summary
from flightd.app.simulation.simulation import Simulation
from flightd.core.tracks import NOT_SEEN, SensorEstimate
from flightd.sim.scenario.scenario import Scenario

SEEN = SensorEstimate(
    delay_s=-0.012,
    delay_sigma_s=0.002,
    mount_roll_rad=math.radians(0.5),
    mount_pitch_rad=math.radians(-0.25),
    mount_sigma_rad=math.radians(0.2),
    tilt_roll_rad=math.radians(-0.3),
    tilt_pitch_rad=math.radians(0.4),
    tilt_sigma_rad=math.radians(0.1),
    scale_share=0.25,
    scale_sigma=0.004,
    height_share=0.1,
    height_sigma=0.02,
)


@pytest.fixture
def simulation(tmp_path: Path) -> Simulation:
    return prepare(SimOptions(seed=3), Scenario(), tmp_path, lambda _: None)


def test_what_was_found_stands_beside_what_was_drawn_with_the_same_keys(simulation: Simulation) -> None:
    told = sensor_summary(simulation, SEEN, leapt=False)
    assert told["estimated"] == {
        "camera_delay_s": pytest.approx(simulation.config.camera.latency_s + 0.012),
        "delay_to_attitude_s": pytest.approx(simulation.config.camera.latency_s + 0.012),
        "mount_roll_deg": 0.5,
        "mount_pitch_deg": -0.25,
        "mount_yaw_deg": None,
        "tilt_bias_deg": 0.5,
        "tilt_roll_deg": 0.3,
        "tilt_pitch_deg": -0.4,
        "focal_percent": -20.0,
        "height_percent": 10.0,
    }
    assert told["estimated_sigma"]["camera_delay_s"] == 0.002
    assert told["estimated_sigma"]["tilt_bias_deg"] == 0.1
    assert (told["estimated_sigma"]["focal_percent"], told["drawn"]["height_percent"]) == (0.4, 0.0)
    assert told["drawn"]["focal_percent"] == pytest.approx(
        100.0 * (simulation.unknowns.focal_share - 1.0), abs=1e-4
    )
    assert list(told["estimated"]) == list(told["estimated_sigma"]) == list(told["drawn"])


def test_the_drawn_delay_is_the_whole_one(simulation: Simulation) -> None:
    drawn = sensor_summary(simulation, NOT_SEEN, leapt=False)["drawn"]
    delay_s = simulation.scenario.camera.capture_delay_s + simulation.unknowns.camera_delay_s
    assert drawn["camera_delay_s"] == pytest.approx(delay_s, abs=1e-4)
    down_s, up_s = simulation.unknowns.path_s
    assert abs(down_s - up_s) > 0.001
    assert drawn["delay_to_attitude_s"] == pytest.approx(delay_s + 0.5 * (up_s - down_s), abs=1e-4)
    assert drawn["mount_yaw_deg"] == pytest.approx(math.degrees(simulation.unknowns.mount_yaw_rad), abs=1e-4)


def test_before_any_line_nothing_is_estimated(simulation: Simulation) -> None:
    told = sensor_summary(simulation, NOT_SEEN, leapt=False)
    assert set(told["estimated"].values()) == set(told["estimated_sigma"].values()) == {None}


def test_the_drawn_delay_is_the_one_after_its_leap_where_the_flight_felt_it(tmp_path: Path) -> None:
    rough = prepare(SimOptions(seed=3, world="rough"), Scenario(), tmp_path, lambda _: None)
    before, after = (sensor_summary(rough, NOT_SEEN, leapt=leapt)["drawn"] for leapt in (False, True))
    leap_s = rough.unknowns.camera_leap.by_s
    assert abs(leap_s) == 0.033
    for key in ("camera_delay_s", "delay_to_attitude_s"):
        assert after[key] - before[key] == pytest.approx(leap_s, abs=2e-4)
    assert after["mount_yaw_deg"] == before["mount_yaw_deg"]
