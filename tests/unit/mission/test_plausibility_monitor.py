"""The way back into the corridor, taken only where the position tells on which side the drone is."""

from __future__ import annotations

from pathlib import Path

import pytest

from flightd.core.types import GridPose
from flightd.mission.safety.plausibility_monitor import PlausibilityMonitor
from flightd.site.site_file import load_site
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
