"""Pictures stop for two seconds at cruising speed: the stream goes on, steering ends, the brake is short."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

from flightd.config.schema import load_config
from flightd.core.types import AttitudeSetpoint, Phase
from flightd.sim.plant.wind import WindParams
from flightd.site.site_file import load_site
from tests.sim.ideal.ideal_flight import IdealFlight

CONFIGS = Path(__file__).parents[3] / "configs"
CONFIG = load_config(CONFIGS / "sim.toml")
SITE = load_site(CONFIGS / "site-demo.toml")
STALL_S, STEERED_S, BRAKED_S = 2.0, 0.3, 1.6
TRIM_RAD = math.radians(2.1)


def stalled() -> list[tuple[float, AttitudeSetpoint, float]]:
    """(time since the stall began, setpoint, true speed) of each tick, until it is over."""
    flight = IdealFlight(SITE, CONFIG, visits=("A4",), seed=1, wind=WindParams(gust_rms_mps=0.0))
    began: list[int] = []

    def stall(phase: Phase, now_ns: int) -> None:
        speed_mps = math.hypot(flight.airframe.vx_mps, flight.airframe.vy_mps)
        if not began and phase is Phase.FOLLOW and speed_mps > 0.75:
            began.append(now_ns)
        flight.faults.blind = bool(began) and (now_ns - began[0]) * 1e-9 < STALL_S

    flight.on_tick = stall
    flown = flight.fly(25)
    assert began
    rows = []
    for output, (_, k) in zip(flown.outputs, flown.truth, strict=True):
        since_s = (k.stamp_ns - began[0]) * 1e-9
        if 0.0 <= since_s < STALL_S:
            assert output.setpoint is not None, "the stream goes on"
            rows.append((since_s, output.setpoint, math.hypot(k.vx_mps, k.vy_mps)))
    return rows


def test_a_stall_ends_steering_at_once_and_leaves_level_after_a_short_brake() -> None:
    rows = stalled()
    gaps_ms = [(b[1].stamp_ns - a[1].stamp_ns) * 1e-6 for a, b in itertools.pairwise(rows)]
    assert sorted(gaps_ms)[int(0.99 * len(gaps_ms))] <= 30.0
    after = [row for row in rows if row[0] >= STEERED_S]
    assert all(setpoint.yaw_rate_radps == 0.0 for _, setpoint, _ in after), "nothing turns it any more"
    assert max(setpoint.climb_mps for _, setpoint, _ in after) <= 0.1
    braking = [
        s for s, setpoint, _ in after if max(abs(setpoint.roll_rad), abs(setpoint.pitch_rad)) > TRIM_RAD
    ]
    assert braking
    assert max(braking) < BRAKED_S
    leans = [setpoint.pitch_rad for s, setpoint, speed_mps in after if speed_mps > 0.3]
    assert min(leans) > -TRIM_RAD, "never a lean along the motion: nose down speeds it up"
    assert next(speed_mps for s, _, speed_mps in rows if s > BRAKED_S) < 0.15
