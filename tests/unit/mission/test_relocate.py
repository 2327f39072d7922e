"""How high the drone rises to see more of the floor, not knowing where it is."""

from __future__ import annotations

from pathlib import Path

import pytest

from flightd.config.schema import load_config
from flightd.config.site_file import parse_site
from flightd.mission.flight.relocation import Relocator
from flightd.mission.guidance import MissionParams

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


def params() -> MissionParams:
    config = load_config(Path(__file__).parents[3] / "configs" / "sim.toml")
    return config.pilot_params(parse_site(SITE, "hall")).mission


@pytest.mark.parametrize(
    ("flown_m", "wanted_m"), [(1.0, 2.0), (1.5, 2.2), (2.2, 2.2), (3.0, 4.0), (5.2, 5.5), (5.6, 5.6)]
)
def test_the_climb_ends_below_the_ceiling_and_below_every_keep_out_above(
    flown_m: float, wanted_m: float
) -> None:
    assert Relocator(params()).height_m(flown_m) == pytest.approx(wanted_m)
