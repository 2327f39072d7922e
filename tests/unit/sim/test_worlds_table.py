"""What the table of many flights tells of their sigmas."""

from __future__ import annotations

import math

import pytest

from flightd.sim.unknowns import WorldKind
from tests.sim.flights.worlds import PlannedFlight, Result, sigmas_off, summary_line

KEYS = ("delay_to_attitude_s", "mount_roll_deg", "mount_pitch_deg", "mount_yaw_deg", "focal_percent")


def result(off: dict[str, float]) -> Result:
    planned = PlannedFlight(WorldKind.USUAL, 1, "")
    return Result(
        planned, True, 0.02, 0.05, 0.1, miscounted=0, faults="", unsafe=False, reason="", sigmas=off
    )


def test_errors_are_told_in_the_flights_own_sigmas() -> None:
    tilts = {"tilt_roll_deg": 0.5, "tilt_pitch_deg": -0.1}
    estimated: dict[str, float | None] = {**dict.fromkeys(KEYS, 0.3), **tilts, "height_percent": None}
    sigma: dict[str, float | None] = {
        **dict.fromkeys(KEYS, 0.1),
        **dict.fromkeys(tilts, 0.2),
        "height_percent": 1.0,
    }
    drawn: dict[str, float | None] = {
        **dict.fromkeys(KEYS, 0.1),
        **dict.fromkeys(tilts, math.nan),
        "height_percent": 0.0,
    }
    off = sigmas_off({"estimated": estimated, "estimated_sigma": sigma, "drawn": drawn}, (0.1, 0.1))
    assert set(off) == {*KEYS, *tilts}
    assert [off[key] for key in KEYS] == pytest.approx([2.0] * 5)
    assert off["tilt_roll_deg"] == pytest.approx(2.0)
    assert off["tilt_pitch_deg"] == pytest.approx(-1.0)


def test_the_last_line_tells_the_share_of_flights_within_one_sigma_and_two() -> None:
    flights = [result({"mount_yaw_deg": off}) for off in (0.5, -0.9, 1.5, -3.0)]
    assert summary_line([*flights, result({})]).endswith("own sigma: mount_yaw_deg 50%/75%")
    assert "sigma" not in summary_line([result({})])
