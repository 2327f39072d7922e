"""Whole missions of a drone that does not stand where it believes to stand."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from flightd.config.schema import load_config
from flightd.core.types import Phase
from flightd.sim.random_sites import random_site
from flightd.site.layout import lay_out
from flightd.site.site import Aisle, Pad, Site
from flightd.site.site_file import load_site
from tests.rigs.brisk import BRISK
from tests.sim.ideal.ideal_flight import Flown, IdealFlight

CONFIGS = Path(__file__).parents[3] / "configs"
CONFIG = load_config(CONFIGS / "sim.toml").with_values(mission=BRISK)
DEMO = load_site(CONFIGS / "site-demo.toml")
UNIFORM = lay_out("uniform", [Aisle("A", 0.0, 0.0, (1.5,) * 6)], [], [Pad("home", "A4", 0.5)], ceiling_m=6.0)


def wrong_visits(flown: Flown, site: Site) -> list[str]:
    """Nodes that were noted as visited although the drone was not there."""
    wrong = []
    for output, (_, k) in zip(flown.outputs, flown.truth, strict=True):
        for event in output.events:
            if event.name == "visited":
                node = site.nodes[event.text]
                if math.hypot(k.x_m - node.x_m, k.y_m - node.y_m) > 0.3:
                    wrong.append(event.text)
    return wrong


@pytest.mark.parametrize(
    ("site", "stands_on", "visits"),
    [(DEMO, "A2", ("A2", "A3")), (DEMO, "B1", ("A2",)), (random_site(8), "A2", ("A3",))],
)
def test_carried_one_cell_off_it_notices_flies_the_mission_and_notes_nothing_wrong(
    site: Site, stands_on: str, visits: tuple[str, ...]
) -> None:
    flown = IdealFlight(site, CONFIG, visits=visits, carried_to=stands_on).fly(200)
    corrected = [event for event in flown.events if event.text == f"corrected: it is {stands_on}"]
    assert corrected
    assert flown.phase is Phase.DONE
    assert tuple(flown.visited) == visits
    assert wrong_visits(flown, site) == []


def test_where_cells_look_alike_it_moves_on_the_line_until_it_knows() -> None:
    flown = IdealFlight(UNIFORM, CONFIG, visits=("A2",), carried_to="A5", seed=2).fly(200)
    assert any(event.name == "position" and "doubted" in event.text for event in flown.events)
    assert wrong_visits(flown, UNIFORM) == []
    assert flown.phase is Phase.DONE
    assert flown.visited == ["A2"]
    for k in (k for phase, k in flown.truth if phase is Phase.RELOCATE):
        assert abs(k.y_m) < 0.25, "it stays above the line"
        assert -0.5 < k.x_m < 9.5
