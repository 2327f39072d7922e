"""How high the drone rises to see more of the floor, not knowing where it is."""

from __future__ import annotations

import pytest

from flightd.mission.flight.relocation import Relocator
from flightd.mission.guidance import CEILING_MARGIN_M
from flightd.site.site_file import parse_site
from tests.unit.mission.configured import configured

SITE = """
[site]
name = "hall"
ceiling_m = 6.0

[[aisle]]
id = "A"
x_m = 0.0
y_m = 0.0
spacing_m = [1.5]

[[pad]]
id = "home"
node = "A1"

[[keep_out]]
x0_m = 9.0
y0_m = -1.0
x1_m = 10.0
y1_m = 1.0
from_m = 2.5
"""


@pytest.mark.parametrize(
    ("flown_m", "wanted_m"), [(1.0, 2.0), (1.5, 2.2), (2.2, 2.2), (3.0, 4.0), (5.2, 5.5), (5.6, 5.6)]
)
def test_the_climb_ends_below_the_ceiling_and_below_every_keep_out_above(
    flown_m: float, wanted_m: float
) -> None:
    site = parse_site(SITE, "hall")
    relocator = Relocator(configured().mission, site.ceiling_m - CEILING_MARGIN_M, site.overhead_m)
    assert relocator.height_m(flown_m) == pytest.approx(wanted_m)
    assert relocator.raised_m(flown_m, 0.1) == pytest.approx(min(flown_m + 0.1, wanted_m))
