"""What the line detectors cost at 1920x1080, in units of one cvtColor(BGR2HSV) of the same frame.

Processor time of one core, as `flightd bench` measures it.
"""

from __future__ import annotations

import pytest

from flightd.studies.bench import UNIT, Timing, bench

LIMITS = {"centroid": 1.6, "skeleton": 1.6, "combined": 2.5}
"""Ceilings against a slow change creeping in; what is reached is about half of them."""


@pytest.fixture(scope="module")
def timings() -> dict[str, Timing]:
    return {timing.method: timing for timing in bench(0.25, ((1920, 1080),), all_cores=False)}


@pytest.mark.parametrize("method", LIMITS)
def test_a_full_frame_costs_no_more_than_a_colour_conversion_or_two(
    timings: dict[str, Timing], method: str
) -> None:
    assert timings[method].median_ms / timings[UNIT].median_ms < LIMITS[method]


def test_every_method_is_faster_than_what_one_would_pick_instead(timings: dict[str, Timing]) -> None:
    slowest = max(timings[method].median_ms for method in LIMITS)
    for baseline in ("naive, every pixel", "textbook centroid", "LSD + merging"):
        assert slowest < timings[baseline].median_ms
