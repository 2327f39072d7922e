"""The plan that stands, and what is counted by it after the flight for which it was chosen."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from flightd.config.scan import ScanConfig
from flightd.config.schema import load_config
from flightd.core.count_choice import ShelfCount
from flightd.core.types import Command, CommandKind
from flightd.mission.plan.flight_plan import make_plan
from flightd.mission.plan.leg_times import Pace
from flightd.mission.plan_in_hand import PlanInHand
from flightd.mission.scan.scanner import Scanner
from tests.unit.mission.driven import POLICY
from tests.unit.mission.shelves import SIGHT, SITE

CONFIG = load_config(Path(__file__).parents[3] / "configs" / "sim.toml")
PACE = Pace.of(CONFIG.mission)


def test_from_another_pad_a_node_flown_to_by_order_is_counted_on_the_same_levels_as_all_still_are() -> None:
    home = SITE.home.node
    scanner = Scanner(SITE, SIGHT, ScanConfig())
    plan = PlanInHand(SITE, make_plan(SITE, ("A2",), home, home, POLICY), POLICY, CONFIG, scanner)
    every_s = scanner.stop_s("A2", PACE)
    plan.take(Command("p", CommandKind.PLAN, nodes=("A2", "A3"), levels=(1,)))
    low_s = scanner.stop_s("A2", PACE)
    plan.begin_at("A4", 0.0)
    plan.count_at("A2", None)
    assert scanner.stop_s("A2", PACE) == low_s < every_s


def test_a_plan_says_at_how_many_of_its_nodes_it_counts() -> None:
    home = SITE.home.node
    scanner = Scanner(SITE, SIGHT, ScanConfig())
    plan = PlanInHand(SITE, make_plan(SITE, ("A2",), home, home, POLICY), POLICY, CONFIG, scanner)
    shelves = (ShelfCount("A2", "left"), ShelfCount("A2", "right", (1,)))
    told = Command("p", CommandKind.PLAN, nodes=("A2", "A3"), counts=shelves)
    assert plan.take(told) == "2 nodes, counted at 1 of them"
    assert plan.take(replace(told, counts=())) == "2 nodes, counted at 0 of them"
    assert plan.take(replace(told, counts=None)) == "2 nodes"
