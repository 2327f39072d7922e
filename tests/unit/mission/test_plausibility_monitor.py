"""The way back into the corridor, taken only where the position tells on which side the drone is."""

from __future__ import annotations

from pathlib import Path

import pytest

from flightd.core.geometry import Lens, Mount
from flightd.core.types import HEALTHY, GridPose
from flightd.localisation.state_estimator import Estimate
from flightd.mission.guidance import Warnings
from flightd.mission.safety.plausibility_monitor import PlausibilityMonitor
from flightd.site.site_file import load_site
from flightd.tracking.climb_doubt import ClimbDoubt
from flightd.tracking.frame_monitor import FrameMonitor
from flightd.tracking.line_tracker import LineTracker
from tests.unit.mission.configured import configured

SITE = load_site(Path(__file__).parents[3] / "configs" / "site-demo.toml")
ON_LINE = (2.0, 0.0)


def pose(y_m: float, sigma_m: float) -> GridPose:
    square = sigma_m * sigma_m
    covariance = (square, 0.0, 0.0, 0.0, square, 0.0, 0.0, 0.0, square)
    return GridPose(0, "A2", 0.0, y_m, 0.0, 2.0, y_m, 0.0, 0.0, 1.5, covariance, 0.99)


@pytest.mark.parametrize(
    ("y_m", "sigma_m", "leads_back"), [(0.8, 0.2, True), (0.8, 0.5, False), (0.1, 0.1, False)]
)
def test_back_where_it_is_outside_and_knows_it(y_m: float, sigma_m: float, leads_back: bool) -> None:
    back = PlausibilityMonitor(SITE, configured()).back(pose(y_m, sigma_m), ON_LINE)
    assert (back is not None) is leads_back
    if back is not None:
        assert back == pytest.approx((0.0, -1.0))


@pytest.mark.parametrize(
    ("told_share", "scale", "doubted"),
    [
        (0.9, 0.08, True),  # it creeps up by a reading that swings, and the scale bends along
        (1.1, -0.08, True),
        (0.9, -0.08, False),
        (0.9, 0.04, False),  # as far as a focal length may be off
        (0.96, 0.08, False),
        (0.8, 0.0, True),  # a quarter of a metre and 12 %
    ],
)
def test_a_height_that_width_and_scale_both_contradict_is_doubted(
    told_share: float, scale: float, doubted: bool
) -> None:
    monitor = PlausibilityMonitor(SITE, configured())
    assert told_by(monitor, _Seen(told_share, scale)).height_doubted is doubted


def test_a_height_that_was_doubted_is_believed_again_only_once_the_lines_agree_for_a_while() -> None:
    monitor = PlausibilityMonitor(SITE, configured())
    steps = [
        (0.7, True, 0.1, True),
        (0.82, True, 2.0, True),
        (0.95, True, 0.3, True),
        (0.82, True, 0.1, True),
        (1.0, False, 2.0, True),  # the widths contradict each other, or there are none
        (0.95, True, 0.6, False),
    ]
    for share, tells, lasts_s, doubted in steps:
        seen = _Seen(share, 0.0, tells=tells)
        for _ in range(round(lasts_s / 0.02)):
            warnings = told_by(monitor, seen)
        assert warnings.height_doubted is doubted


def told_by(monitor: PlausibilityMonitor, tracker: LineTracker) -> Warnings:
    """What a tick at 1.5 m warns of, where no line tells the place."""
    known = Estimate(height_m=1.5, tracks=None, pose=None, by_pad=False)
    return monitor.step(
        0,
        0.02,
        known,
        tracker=tracker,
        frames=FrameMonitor(),
        climb=ClimbDoubt(),
        height_stuck=False,
        health=HEALTHY,
    )


class _Seen(LineTracker):
    """What lines and motion say of the told height."""

    def __init__(self, told_share: float, scale: float, *, tells: bool = True) -> None:
        super().__init__(Lens(640, 360, 320.0, 320.0, 320.0, 180.0), Mount(), 0.075, 0.0)
        self._told_share, self._scale, self._tells = told_share, scale, tells

    @property
    def height_share(self) -> float:
        return self._told_share

    @property
    def height_off_m(self) -> float:
        return 1.5 - 1.5 / self._told_share

    @property
    def widths_tell(self) -> bool:
        return self._tells

    @property
    def scale_share(self) -> float:
        return self._scale
