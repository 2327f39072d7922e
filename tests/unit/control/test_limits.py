"""The limits before the wire, for any stream of setpoints whatsoever."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.config.control import ControlConfig, ControlExpert
from flightd.control.limits import Limiter, Surroundings
from flightd.core.geometry import GRAVITY_MPS2
from flightd.core.types import AttitudeSetpoint

EXPERT = ControlExpert(max_jerk_mps3=9.0, max_yaw_accel_degps2=math.degrees(3.0))
LIMITS = ControlConfig(max_descend_mps=0.6, expert=EXPERT)
STEP_NS = 20_000_000
finite = st.floats(-100, 100)
wish = st.tuples(finite, finite, finite, finite, st.integers(0, 200))
wishes = st.lists(wish, min_size=1, max_size=30)
direction = st.floats(-math.pi, math.pi)


def stream(
    wanted: list[tuple[float, float, float, float, int]], around: Surroundings, limiter: Limiter | None = None
) -> list[AttitudeSetpoint]:
    limiter, now_ns = limiter or Limiter(LIMITS), 10**9
    limiter.apply(AttitudeSetpoint(now_ns))
    out = [AttitudeSetpoint(now_ns)]
    for roll, pitch, yaw_rate, climb, gap_ms in wanted:
        now_ns += gap_ms * 1_000_000
        out.append(limiter.apply(AttitudeSetpoint(now_ns, roll, pitch, yaw_rate, climb), around))
    return out


AROUND = [
    Surroundings(),
    Surroundings(back=(0.6, -0.8)),
    Surroundings(data_age_s=9.0),
    Surroundings(haste=0.4),
]


@pytest.mark.parametrize("around", [Surroundings(data_age_s=9.0), Surroundings(back=(1.0, 0.0))])
def test_what_comes_to_level_or_back_into_the_corridor_is_not_kept_waiting_by_late_pictures(
    around: Surroundings,
) -> None:
    limiter = Limiter(LIMITS)
    leaning = stream([(0.0, 0.15, 0.0, 0.0, 20)] * 40, Surroundings(), limiter)[-1]
    assert leaning.pitch_rad == pytest.approx(0.15)
    level = AttitudeSetpoint(leaning.stamp_ns + STEP_NS)
    slow = limiter.apply(level, replace(around, haste=0.4))
    assert leaning.pitch_rad - slow.pitch_rad > 0.9 * EXPERT.max_jerk_mps3 * 0.02 / GRAVITY_MPS2


@given(wishes, st.sampled_from(AROUND))
def test_nothing_beyond_the_limits_reaches_the_wire(
    wanted: list[tuple[float, float, float, float, int]], around: Surroundings
) -> None:
    for last, out in pairwise(stream(wanted, around)):
        dt_s = min((out.stamp_ns - last.stamp_ns) * 1e-9, 0.1)
        assert max(abs(out.roll_rad), abs(out.pitch_rad)) <= LIMITS.max_tilt_rad + 1e-9
        assert abs(out.yaw_rate_radps) <= LIMITS.max_yaw_rate_radps
        assert -LIMITS.max_descend_mps <= out.climb_mps <= LIMITS.max_climb_mps
        swing = around.haste * EXPERT.max_tilt_rate_radps * dt_s + 1e-9
        assert abs(out.roll_rad - last.roll_rad) <= swing
        assert abs(out.pitch_rad - last.pitch_rad) <= swing
        assert abs(out.yaw_rate_radps - last.yaw_rate_radps) <= EXPERT.max_yaw_accel_radps2 * dt_s + 1e-9
        change = GRAVITY_MPS2 * math.hypot(
            math.tan(out.roll_rad) - math.tan(last.roll_rad),
            math.tan(out.pitch_rad) - math.tan(last.pitch_rad),
        )
        assert change <= around.haste * EXPERT.max_jerk_mps3 * dt_s + 1e-9


@given(wishes, wishes, direction)
def test_outside_the_corridor_no_lean_grows_outwards(
    before: list[tuple[float, float, float, float, int]],
    after: list[tuple[float, float, float, float, int]],
    angle: float,
) -> None:
    limiter, back = Limiter(LIMITS), (math.cos(angle), math.sin(angle))
    last = stream(before, Surroundings(), limiter)[-1]
    now_ns = last.stamp_ns
    for roll, pitch, yaw_rate, climb, _ in after:
        now_ns += STEP_NS
        out = limiter.apply(AttitudeSetpoint(now_ns, roll, pitch, yaw_rate, climb), Surroundings(back=back))
        assert outward(out, back) <= max(outward(last, back), 0.0) + 0.02
        last = out
    for _ in range(40):
        now_ns += STEP_NS
        last = limiter.apply(AttitudeSetpoint(now_ns, 0.3, -0.3), Surroundings(back=back))
    assert outward(last, back) <= 0.01


@given(wishes, st.floats(max_value=0.0) | st.just(math.nan))
def test_nothing_climbs_at_the_ceiling_or_where_nobody_knows_it(
    wanted: list[tuple[float, float, float, float, int]], headroom_m: float
) -> None:
    assert all(out.climb_mps <= 0 for out in stream(wanted, Surroundings(headroom_m=headroom_m))[1:])


@given(wishes, st.floats(0.41, 1e9) | st.sampled_from([math.inf, math.nan]))
def test_nothing_leans_by_stale_data(
    wanted: list[tuple[float, float, float, float, int]], age_s: float
) -> None:
    for out in stream(wanted, Surroundings(data_age_s=age_s)):
        assert (out.roll_rad, out.pitch_rad, out.yaw_rate_radps) == (0.0, 0.0, 0.0)


@given(wishes)
def test_an_emergency_stop_is_level_at_once(wanted: list[tuple[float, float, float, float, int]]) -> None:
    limiter = Limiter(LIMITS)
    last = stream(wanted, Surroundings(), limiter)[-1]
    out = limiter.apply(AttitudeSetpoint(last.stamp_ns + 1, 0.1, 0.1, 0.5, -0.3), Surroundings(at_once=True))
    assert (out.roll_rad, out.pitch_rad, out.yaw_rate_radps, out.climb_mps) == (0.0, 0.0, 0.0, -0.3)


@pytest.mark.parametrize(
    ("wanted_mps", "error_mps", "headroom_m", "commanded_mps"),
    [
        pytest.param(0.0, -1.0, 3.0, -1.0, id="it climbs while it believes to hover"),
        pytest.param(-9.0, -1.0, 3.0, -LIMITS.max_descend_mps - 1.0, id="limited is the true climb"),
        pytest.param(0.0, -9.0, 3.0, -1.5, id="no more than that"),
        pytest.param(0.0, 9.0, 3.0, 0.5, id="less upwards"),
        pytest.param(0.3, 1.0, 0.0, 0.0, id="and never under the ceiling"),
    ],
)
def test_a_climb_that_the_vehicle_takes_for_another_is_commanded_otherwise(
    wanted_mps: float, error_mps: float, headroom_m: float, commanded_mps: float
) -> None:
    around = Surroundings(headroom_m=headroom_m, climb_error_mps=error_mps)
    limited = Limiter(LIMITS).apply(AttitudeSetpoint(1, climb_mps=wanted_mps), around)
    assert limited.climb_mps == pytest.approx(commanded_mps)


def outward(setpoint: AttitudeSetpoint, back: tuple[float, float]) -> float:
    """Acceleration of a setpoint away from where `back` points, m/s^2; negative when it leans back."""
    forward, right = -math.tan(setpoint.pitch_rad), math.tan(setpoint.roll_rad)
    return -GRAVITY_MPS2 * (forward * back[0] + right * back[1])
