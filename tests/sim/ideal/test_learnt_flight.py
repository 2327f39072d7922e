"""What one flight learns of its sensors, the next one begins with."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from flightd.adapters.recorder.recorder import McapRecorder, wait_for_disk
from flightd.app.build import pilot_of
from flightd.app.recording import SETTING_TOPICS, FlightSetting, record_setting, recorded_setting
from flightd.config.schema import load_config
from flightd.core.flight_order import FlightOrder
from flightd.core.learnt import Learnt, LearntSensors
from flightd.core.tracks import SensorEstimate
from flightd.core.types import Phase
from flightd.replay.log import read_log
from flightd.site.site_file import load_site
from tests.rigs.brisk import BRISK
from tests.sim.ideal.ideal_flight import IdealFlight

CONFIGS = Path(__file__).parents[3] / "configs"
CONFIG = load_config(CONFIGS / "sim.toml").with_values(mission=BRISK)
SITE = load_site(CONFIGS / "site-demo.toml")
TOLD_DEG = 1.5
"""The camera is configured to be rolled by this, and is not."""
WRONG = CONFIG.with_values(camera={"mount_roll_deg": TOLD_DEG})
ORDER = FlightOrder(("A2", "A3"), autostart=True)


def flown(learnt: LearntSensors | None) -> tuple[list[SensorEstimate], LearntSensors]:
    """What a flight believed from its first line on, and what it has learnt in the end."""
    believed: list[SensorEstimate] = []
    flight = IdealFlight(SITE, CONFIG, visits=ORDER.nodes, observers=[lambda s: believed.append(s.sensors)])
    flight.pilot = pilot_of(WRONG, SITE, ORDER, learnt)
    assert flight.pilot.learnt == learnt
    assert flight.fly(120.0).phase is Phase.DONE
    assert flight.pilot.learnt is not None
    return [one for one in believed if one.is_known], flight.pilot.learnt


def test_the_next_flight_begins_with_what_the_last_has_learnt() -> None:
    first, learnt = flown(None)
    assert abs(math.degrees(first[0].mount_roll_rad)) < 0.3
    found_deg = math.degrees(learnt.mean(Learnt.MOUNT_ROLL))
    assert found_deg == pytest.approx(-TOLD_DEG, abs=0.5)
    second, again = flown(learnt)
    assert math.degrees(second[0].mount_roll_rad) == pytest.approx(found_deg, abs=0.2)
    assert second[0].mount_sigma_rad < first[0].mount_sigma_rad
    assert math.degrees(again.mean(Learnt.MOUNT_ROLL)) == pytest.approx(-TOLD_DEG, abs=0.5)


def test_a_record_tells_what_the_flight_began_with(tmp_path: Path) -> None:
    for learnt in (None, LearntSensors((0.1,) * 8, tuple(float(n == m) for n in range(8) for m in range(8)))):
        path = tmp_path / f"{learnt is None}.mcap"
        setting = FlightSetting(CONFIG, SITE, ORDER, learnt)
        with McapRecorder(path, when_full=wait_for_disk) as recorder:
            record_setting(recorder, 1, setting)
        assert recorded_setting(read_log(path, SETTING_TOPICS)).learnt == learnt
