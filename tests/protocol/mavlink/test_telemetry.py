"""MAVLink telemetry to the vehicle's state: units, signs, what is missing, what makes no sense."""

from __future__ import annotations

import math
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.services.clock_offset import ClockSync
from flightd.adapters.vehicle.mavlink.telemetry import ClimbSource, MavlinkTelemetry
from flightd.core.types import LandedState, VehicleState

NOW_NS = 1_000_000_000_000
MS = 1_000_000


def attitude(boot_ms: int = 0, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0) -> Any:
    return dialect.MAVLink_attitude_message(boot_ms, roll, pitch, yaw, 0.0, 0.0, 0.0)


def told(*messages: Any, telemetry: MavlinkTelemetry | None = None, now_ns: int = NOW_NS) -> VehicleState:
    telemetry = telemetry or MavlinkTelemetry(ClockSync())
    for message in (dialect.MAVLink_heartbeat_message(2, 3, 1, 20, 4, 3), attitude(), *messages):
        telemetry.take(message, now_ns)
    state = telemetry.state(now_ns, "", in_control=False, refusal=None)
    assert state is not None
    return state


def distance(
    centimetres: int,
    orientation: int = 25,
    least: int = 20,
    most: int = 400,
    number: int = 0,
    quality: int = 0,
) -> Any:
    return dialect.MAVLink_distance_sensor_message(
        0, least, most, centimetres, 1, number, orientation, 0, signal_quality=quality
    )


def heartbeat(*, armed: bool) -> Any:
    return dialect.MAVLink_heartbeat_message(2, 3, 129 if armed else 1, 20, 4, 3)


def heights(*messages: Any, armed: bool = False, telemetry: MavlinkTelemetry | None = None) -> list[float]:
    """The height after each message, 40 ms apart."""
    telemetry = telemetry or MavlinkTelemetry(ClockSync())
    telemetry.take(heartbeat(armed=armed), NOW_NS)
    known = []
    for number, message in enumerate(messages):
        now_ns = NOW_NS + number * 40 * MS
        telemetry.take(message, now_ns)
        known.append(telemetry.height_m(now_ns))
    return known


def test_nothing_is_known_before_heartbeat_and_attitude() -> None:
    telemetry = MavlinkTelemetry(ClockSync())
    telemetry.take(attitude(), NOW_NS)
    assert telemetry.state(NOW_NS, "", in_control=False, refusal=None) is None
    state = told()
    assert math.isnan(state.height_m)
    assert math.isnan(state.climb_mps)
    assert math.isnan(state.battery_frac)
    assert state.landed is LandedState.UNKNOWN


def test_the_range_is_along_the_body_and_the_height_along_the_vertical() -> None:
    assert told(distance(155)).height_m == pytest.approx(1.55)
    state = told(attitude(1, math.radians(10), math.radians(-20)), distance(200))
    assert state.height_m == pytest.approx(2.0 * math.cos(math.radians(10)) * math.cos(math.radians(20)))


@pytest.mark.parametrize("message", [distance(0), distance(19), distance(401), distance(155, orientation=0)])
def test_what_the_range_finder_did_not_see_is_no_height(message: Any) -> None:
    seen = heights(distance(155), message, *[message] * 20, armed=True)
    assert seen[0] == pytest.approx(1.55)
    assert math.isnan(seen[-1])


def test_a_signal_that_is_none_is_no_height_whatever_is_read() -> None:
    assert math.isnan(heights(distance(155, quality=1))[0])
    for quality in (0, 2, 100):
        assert heights(distance(155, quality=quality)) == [pytest.approx(1.55)]


@pytest.mark.parametrize("read", [0, 12])
def test_standing_lower_than_the_sensor_measures_is_a_height(read: int) -> None:
    """ArduCopter says 0 for as long as it stands so: the flight waited for a height for ever."""
    telemetry = MavlinkTelemetry(ClockSync())
    assert heights(*[distance(read)] * 3, telemetry=telemetry) == [pytest.approx(0.2)] * 3
    climbing = heights(*[distance(0)] * 20, distance(21), distance(35), armed=True, telemetry=telemetry)
    assert climbing[:20] == [pytest.approx(0.2)] * 20
    assert climbing[-1] == pytest.approx(0.35)
    sinking = [distance(cm) for cm in (90, 60, 30, 0, 0)]
    assert heights(*sinking, armed=True, telemetry=telemetry)[-1] == pytest.approx(0.2)


@pytest.mark.parametrize(("vz_cmps", "read_m"), [(-70, 0.24), (0, 0.2), (70, 0.2)])
def test_nothing_seen_right_above_the_least_reading_is_that_one_only_where_it_does_not_climb(
    vz_cmps: int, read_m: float
) -> None:
    """A range finder that drops out in a take-off told 0.3 m of one at 0.5 m."""
    telemetry = MavlinkTelemetry(ClockSync())
    heights(distance(0), telemetry=telemetry)
    climbs = [position(0, 100, vz=vz_cmps), distance(24), distance(0)]
    assert heights(*climbs, armed=True, telemetry=telemetry)[-1] == pytest.approx(read_m)


def test_nothing_seen_from_high_up_is_not_the_floor() -> None:
    telemetry = MavlinkTelemetry(ClockSync())
    heights(distance(0), telemetry=telemetry)
    seen = heights(distance(150), *[distance(0)] * 20, armed=True, telemetry=telemetry)
    assert seen[1] == pytest.approx(1.5)
    assert math.isnan(seen[-1])


def two(own_cm: int, other_cm: int, own_quality: int = 0, other_quality: int = 0) -> list[Any]:
    return [
        distance(own_cm, least=5, number=0, quality=own_quality),
        distance(other_cm, least=5, number=1, quality=other_quality),
    ]


def test_of_two_range_finders_the_one_that_measures_on_the_floor_is_flown_by() -> None:
    """Side by side, 10 cm apart: the height leapt to and fro between them."""
    telemetry = MavlinkTelemetry(ClockSync())
    heights(*two(0, 10) * 30, telemetry=telemetry)
    flown = heights(*two(160, 150) * 10, armed=True, telemetry=telemetry)
    assert flown[5:] == [pytest.approx(1.5)] * 15  # the very same, told again, confirms nothing


def test_the_choice_stands_in_flight_even_when_the_chosen_one_falls_silent() -> None:
    telemetry = MavlinkTelemetry(ClockSync())
    heights(*two(10, 12, 90, 40) * 30, telemetry=telemetry)
    assert heights(*two(150, 160, 90, 40) * 4, armed=True, telemetry=telemetry)[-1] == pytest.approx(1.5)
    rest = heights(*[distance(160, least=5, number=1)] * 20, armed=True, telemetry=telemetry)
    assert math.isnan(rest[-1])


def test_the_range_finder_that_is_configured_is_the_one() -> None:
    telemetry = MavlinkTelemetry(ClockSync(), range_finder=0)
    heights(*two(0, 10) * 30, telemetry=telemetry)
    assert heights(*two(160, 150) * 10, armed=True, telemetry=telemetry)[-1] == pytest.approx(1.6)


def test_the_better_signal_decides_between_two_that_measure() -> None:
    telemetry = MavlinkTelemetry(ClockSync())
    assert heights(*two(10, 12, 30, 95) * 30, telemetry=telemetry)[-1] == pytest.approx(0.12)


def test_an_echo_by_a_longer_way_is_no_height_and_goods_below_are_after_one_reading() -> None:
    """One of 2.9 m at 1.6 m was near the ceiling, and contradicted the lines for half a second."""
    telemetry = MavlinkTelemetry(ClockSync())
    flying = heights(*[distance(160)] * 3, distance(290), distance(161), armed=True, telemetry=telemetry)
    assert flying == [pytest.approx(1.6)] * 4 + [pytest.approx(1.61)]
    over = heights(distance(110), distance(112), distance(111), armed=True, telemetry=telemetry)
    assert over == [pytest.approx(1.61), pytest.approx(1.12), pytest.approx(1.11)]


def test_a_silent_range_finder_is_no_height() -> None:
    telemetry = MavlinkTelemetry(ClockSync())
    told(distance(155), telemetry=telemetry)
    assert telemetry.height_m(NOW_NS + 400 * MS) == pytest.approx(1.55)
    assert math.isnan(telemetry.height_m(NOW_NS + 600 * MS))


def position(boot_ms: int, relative_mm: int, vz: int = 0, vx: int = 0) -> Any:
    return dialect.MAVLink_global_position_int_message(boot_ms, 0, 0, 0, relative_mm, vx, 0, vz, 0)


def test_the_climb_rate_points_up() -> None:
    assert told(position(0, 1000, vz=-50)).climb_mps == pytest.approx(0.5)
    by_local = MavlinkTelemetry(ClockSync(), ClimbSource.LOCAL_POSITION)
    assert told(local(0.3), telemetry=by_local).climb_mps == pytest.approx(-0.3)


def local(vz_mps: float) -> Any:
    return dialect.MAVLink_local_position_ned_message(0, 0.0, 0.0, -1.0, 0.0, 0.0, vz_mps)


@pytest.mark.parametrize("source", list(ClimbSource))
def test_the_climb_rate_comes_from_one_message_only(source: ClimbSource) -> None:
    telemetry = MavlinkTelemetry(ClockSync(), source)
    state = told(position(0, 1000, vz=-50), local(0.3), position(40, 1000, vz=-50), telemetry=telemetry)
    wanted = 0.5 if source is ClimbSource.GLOBAL_POSITION else -0.3
    assert state.climb_mps == pytest.approx(wanted)


def test_a_leap_of_the_height_is_no_climb() -> None:
    """Home is set at arming: everything is 1.4 m lower, or higher, from one sample to the next."""
    telemetry = MavlinkTelemetry(ClockSync())
    for leap_mm in (1436, -1436):
        seen = [
            told(position(40 * i, 1000 + (leap_mm if i >= 20 else 0)), telemetry=telemetry).climb_mps
            for i in range(40)
        ]
        known = [climb for climb in seen if not math.isnan(climb)]
        assert len(known) > 30
        assert max(map(abs, known)) < 0.01


def test_without_a_velocity_the_climb_rate_is_the_heights_slope() -> None:
    """ArduPilot without a velocity estimate sends zeros, also while it climbs."""
    rising = [position(40 * i, 1000 + 20 * i) for i in range(20)]
    assert told(*rising).climb_mps == pytest.approx(0.5)
    assert math.isnan(told(*rising, position(5000, 9000)).climb_mps)  # after a gap it starts anew
    assert told(position(0, 1000, vx=10)).climb_mps == 0.0


def test_a_height_that_was_overtaken_on_its_way_does_not_begin_the_slope_anew() -> None:
    order = [i + (i % 5 == 2) - (i % 5 == 3) for i in range(60)]
    assert order != sorted(order)
    telemetry = MavlinkTelemetry(ClockSync())
    seen = [told(position(40 * i, 1000 + 20 * i), telemetry=telemetry).climb_mps for i in order]
    assert seen[12:] == pytest.approx([0.5] * len(seen[12:]))


def test_the_battery_is_read_from_either_message_and_unknown_stays_unknown() -> None:
    cells = [3900, 3900, 3900] + [65535] * 7

    def battery(percent: int, number: int = 0, voltages: list[int] = cells) -> Any:
        return dialect.MAVLink_battery_status_message(number, 0, 1, 0, voltages, 0, 0, -1, percent)

    state = told(battery(75))
    assert state.battery_frac == 0.75
    assert state.battery_v == pytest.approx(11.7)
    assert math.isnan(told(battery(-1)).battery_frac)
    assert math.isnan(told(battery(75, number=1)).battery_frac)
    assert math.isnan(told(battery(75, voltages=[65535] * 10)).battery_v)
    status = dialect.MAVLink_sys_status_message(0, 0, 0, 0, 12_100, -1, 60, 0, 0, 0, 0, 0, 0)
    assert told(status).battery_v == pytest.approx(12.1)
    unknown = dialect.MAVLink_sys_status_message(0, 0, 0, 0, 65535, -1, -1, 0, 0, 0, 0, 0, 0)
    assert math.isnan(told(unknown).battery_v)


def test_a_landed_state_is_believed_for_a_second() -> None:
    telemetry = MavlinkTelemetry(ClockSync())
    told(dialect.MAVLink_extended_sys_state_message(0, 1), telemetry=telemetry)
    assert told(telemetry=telemetry, now_ns=NOW_NS + 1000 * MS).landed is LandedState.ON_GROUND
    assert told(telemetry=telemetry, now_ns=NOW_NS + 1001 * MS).landed is LandedState.UNKNOWN


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e30])
def test_an_attitude_that_makes_no_sense_is_not_taken(value: float) -> None:
    telemetry = MavlinkTelemetry(ClockSync())
    told(attitude(10, roll=value), telemetry=telemetry)
    assert len(telemetry.attitudes()) == 1


def test_stamps_are_in_our_clock_once_the_clocks_are_compared() -> None:
    sync = ClockSync()
    telemetry = MavlinkTelemetry(sync)
    telemetry.take(attitude(5000), NOW_NS)
    asked = sync.ask(NOW_NS)
    assert sync.answered(asked, 5_010 * MS, NOW_NS + 20 * MS)  # their 5010 ms is our NOW + 10 ms
    telemetry.take(attitude(5100), NOW_NS + 130 * MS)
    first, second = telemetry.attitudes()
    assert first.stamp_ns == NOW_NS
    assert second.stamp_ns == NOW_NS + 100 * MS


def test_an_impossible_stamp_is_replaced_by_the_arrival() -> None:
    sync = ClockSync()
    telemetry = MavlinkTelemetry(sync)
    sync.answered(sync.ask(NOW_NS), 5_000 * MS, NOW_NS)
    telemetry.take(attitude(9_000), NOW_NS + 10 * MS)  # four seconds in our future
    assert telemetry.attitudes()[0].stamp_ns == NOW_NS + 10 * MS


def refused(*off_ms: int) -> list[int]:
    """How many times made no sense, after each attitude; 20 ms apart, their times off by so much from those
    of a clock that is well compared."""
    sync = ClockSync()
    telemetry = MavlinkTelemetry(sync)
    sync.answered(sync.ask(NOW_NS), 60_000 * MS, NOW_NS)
    telemetry.take(heartbeat(armed=True), NOW_NS)
    counts = []
    for number, off in enumerate(off_ms):
        now_ns = NOW_NS + number * 20 * MS
        telemetry.take(attitude(60_000 + 20 * number + off), now_ns)
        state = telemetry.state(now_ns, "", in_control=True, refusal=None)
        assert state is not None
        counts.append(state.stamps_refused)
    return counts


def test_each_time_that_makes_no_sense_counts_once() -> None:
    assert refused(0, -400, 0) == [0, 0, 0], "late, and within reason"
    assert refused(0, -700, 0, 0) == [0, 1, 1, 1], "a stray datagram"
    assert refused(0, 9_000, 0, 0) == [0, 1, 1, 1], "one from the future makes no reboot of the next"
    assert refused(0, 100_000, 100_000) == [0, 1, 2], "a clock that jumped"


def test_a_boot_clock_that_jumps_back_is_a_reboot() -> None:
    sync = ClockSync()
    telemetry = MavlinkTelemetry(sync)
    sync.answered(sync.ask(NOW_NS), 60_000 * MS, NOW_NS)
    assert not telemetry.take(attitude(60_000), NOW_NS)
    assert not telemetry.take(attitude(59_900), NOW_NS)  # late, not rebooted
    assert telemetry.take(attitude(100), NOW_NS + 50 * MS)
    assert sync.offset_ns is None
    assert telemetry.attitudes()[-1].stamp_ns == NOW_NS + 50 * MS


def test_over_a_time_that_is_not_known_nobody_reckons_by_the_rates_of_roll_and_pitch() -> None:
    sync = ClockSync()
    telemetry = MavlinkTelemetry(sync)
    sync.answered(sync.ask(NOW_NS), 60_000 * MS, NOW_NS)
    for number, off_ms in enumerate((0, 0, -700, 0, 0)):  # one strays
        telemetry.take(attitude(60_000 + 20 * number + off_ms), NOW_NS + 20 * number * MS)
    telemetry.take(attitude(60_100 - 700), NOW_NS + 80 * MS)  # as old as the newest: not passed on
    telemetry.take(attitude(60_100), NOW_NS + 100 * MS)
    told = [math.isfinite(one.roll_rate_radps + one.pitch_rate_radps) for one in telemetry.attitudes()]
    assert told == [True, True, False, True, True, False]


def test_the_fastest_of_the_round_trips_counts() -> None:
    sync = ClockSync()
    for delay_ms in (30, 4, 50, 80):
        asked = sync.ask(NOW_NS + delay_ms)
        # all of the delay lies on the way back: the worst asymmetry
        sync.answered(asked, asked + 7_000 * MS, asked + delay_ms * MS)
    assert sync.offset_ns == pytest.approx(7_000 * MS, abs=2.1 * MS)


def test_answers_to_others_forged_and_late_ones_are_not_taken() -> None:
    sync = ClockSync()
    asked = sync.ask(NOW_NS)
    assert not sync.answered(NOW_NS - 5, 1, NOW_NS)
    assert not sync.answered(asked, 1, NOW_NS + 600 * MS)
    assert not sync.answered(asked, 1, NOW_NS - 1)
    assert sync.answered(asked, 1, NOW_NS + MS)
    assert not sync.answered(asked, 1, NOW_NS + MS)
