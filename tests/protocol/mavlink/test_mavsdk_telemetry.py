"""What MAVSDK tells of the vehicle, as the adapter takes it."""

from __future__ import annotations

import json
import math
import random
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mavsdk.plugins.telemetry import LandedState as SdkLanded

from flightd.adapters.vehicle.mavlink.services.clock_offset import ClockSync
from flightd.adapters.vehicle.mavsdk.library import whole_fields
from flightd.adapters.vehicle.mavsdk.telemetry import MavsdkTelemetry
from flightd.core.types import LandedState


def test_a_landed_state_is_believed_for_a_second() -> None:
    readings = MavsdkTelemetry(ClockSync())
    readings.take_landed(SdkLanded.ON_GROUND, 5)
    assert readings.landed(5 + 10**9) is LandedState.ON_GROUND
    assert readings.landed(6 + 10**9) is LandedState.UNKNOWN


_ATTITUDE = ("roll", "pitch", "yaw", "rollspeed", "pitchspeed", "yawspeed")
_RANGED = {
    "id": 0,
    "orientation": 25,
    "current_distance": 160,
    "min_distance": 10,
    "max_distance": 800,
    "signal_quality": 0,
}


def test_a_range_finder_whose_signal_is_none_tells_no_height() -> None:
    """As over our own link: the library's form of the message leaves the quality out."""
    readings = MavsdkTelemetry(ClockSync())
    readings.take_range(json.dumps(_RANGED), 1)
    assert readings.height_m(2) == pytest.approx(1.6)
    readings.take_range(json.dumps(_RANGED | {"signal_quality": 1, "current_distance": 30}), 3)
    assert readings.height_m(4) == pytest.approx(1.6)
    readings.take_range(json.dumps(_RANGED | {"id": 1, "current_distance": 30, "signal_quality": 90}), 5)
    assert readings.height_m(6) == pytest.approx(0.3), "disarmed, the better one is chosen"
    readings.take_range("{}", 7)
    assert readings.height_m(8) == pytest.approx(0.3)


def test_attitudes_keep_their_time_when_boot_times_begin_anew_after_49_days() -> None:
    """They were taken for a reboot's, and had the time of their arrival from then on."""
    sync, ms = ClockSync(), 1_000_000
    wrap_ms, late_ns = 2**32, 30 * ms
    boot_ns = -(wrap_ms - 3_000) * ms  # ours at their boot
    readings = MavsdkTelemetry(sync)
    for now_ns in range(0, 6_000 * ms, 100 * ms):
        asked = sync.ask(now_ns)
        assert sync.answered(asked, asked - boot_ns, asked + 2 * ms)
        angles = dict.fromkeys(_ATTITUDE, 0.0) | {"time_boot_ms": (now_ns - boot_ns) // ms % wrap_ms}
        readings.take_attitude(json.dumps(angles), now_ns + late_ns)
        (attitude,) = readings.attitudes()
        assert attitude.stamp_ns == pytest.approx(now_ns, abs=2 * ms)


def test_attitudes_whose_time_makes_no_sense_are_counted_and_make_no_reboot_of_the_next() -> None:
    """The count was always 0: a clock that jumped was never found by it."""
    sync, ms = ClockSync(), 1_000_000
    readings = MavsdkTelemetry(sync)
    readings.take_mode(1, 1)

    def refused(now_ms: int, boot_ms: int) -> int:
        angles = dict.fromkeys(_ATTITUDE, 0.0) | {"time_boot_ms": boot_ms}
        readings.take_attitude(json.dumps(angles), now_ms * ms)
        state = readings.state(now_ms * ms, in_control=True, refusal=None)
        assert state is not None
        return state.stamps_refused

    for now_ms in range(1_000, 3_000, 100):
        asked = sync.ask(now_ms * ms)
        assert sync.answered(asked, asked + 500 * ms, asked + 2 * ms)
        assert refused(now_ms + 10, now_ms + 500) == 0
    assert refused(3_010, 9_500) == 1, "seconds ahead"
    assert refused(3_110, 3_600) == 1, "as before"
    assert refused(3_210, 3_000) == 2, "long past"


def test_the_current_of_the_battery_is_taken_where_it_is_known() -> None:
    readings = MavsdkTelemetry(ClockSync())
    readings.take_mode(1, 1)
    readings.take_attitude(json.dumps(dict.fromkeys(_ATTITUDE, 0.0) | {"time_boot_ms": 7}), 1)
    for told_a, taken_a in ((14.2, 14.2), (math.nan, math.nan), (-0.01, math.nan)):
        battery = SimpleNamespace(id=0, voltage_v=15.0, remaining_percent=80.0, current_battery_a=told_a)
        readings.take_battery(battery, 2)
        state = readings.state(3, in_control=True, refusal=None)
        assert state is not None
        assert state.battery_a == pytest.approx(taken_a, nan_ok=True)


def test_whatever_the_library_hands_over_nothing_raises_and_nothing_absurd_is_believed() -> None:
    rng = random.Random(11)
    odd = [math.nan, math.inf, -math.inf, 1e30, -1.0, 0.0, 0.7, 90.0, 270.0, 2**63, -(2**40), 255, 3]
    readings = MavsdkTelemetry(ClockSync())
    for now_ns in range(0, 20_000 * 1_000_000, 1_000_000):

        def some(*names: str) -> Any:
            return SimpleNamespace(**{name: rng.choice(odd) for name in names})

        whole = rng.choice([value for value in odd if isinstance(value, int)])
        angles = {name: rng.choice([*odd, None]) for name in _ATTITUDE} | {"time_boot_ms": whole}
        ranged = {name: rng.choice([*odd, 25, None]) for name in _RANGED}
        readings.take_mode(whole, now_ns)
        readings.take_landed(whole, now_ns)
        readings.take_armed(bool(whole), now_ns)
        readings.take_attitude(json.dumps(angles), now_ns)
        readings.take_range(json.dumps(ranged), now_ns)
        readings.take_velocity(SimpleNamespace(velocity=some("down_m_s")), now_ns)
        readings.take_battery(some("id", "voltage_v", "remaining_percent", "current_battery_a"), now_ns)
        state = readings.state(now_ns, in_control=False, refusal=None)
        if state is not None:
            assert abs(state.attitude.roll_rad) < 10.0
            assert not state.height_m < 0.0
            assert not state.battery_frac > 1.0
            assert math.isnan(state.battery_a) or 0.0 <= state.battery_a < math.inf
            assert state.attitude.stamp_ns <= now_ns
    stamps = [sample.stamp_ns for sample in readings.attitudes()]
    assert stamps == sorted(stamps)


@given(document=st.text() | st.recursive(st.none() | st.floats() | st.text(), st.lists).map(json.dumps))
def test_fields_of_any_text_are_whole_numbers_or_none(document: str) -> None:
    fields = whole_fields(document, "tc1")
    assert fields is None or all(isinstance(field, int) for field in fields)


@pytest.mark.parametrize("document", ["", "{", "[]", "null", '{"tc1": 1}', '{"tc1": null, "ts1": {}}', "7"])
def test_a_message_whose_fields_are_not_as_known_is_passed_over(document: str) -> None:
    assert whole_fields(document, "tc1", "ts1") is None
    assert whole_fields('{"tc1": "12", "ts1": 5}', "tc1", "ts1") == (12, 5)
