"""What a scanShelf may ask for: sides and levels of its node, and nothing that is not there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from flightd.fleet.vda5050.codec import Version, encoded
from flightd.fleet.vda5050.parts import Action, ActionParameter, BlockingType
from flightd.fleet.vehicle.abilities import ScanShelf, known_actions, scan_shelf_of
from flightd.fleet.vehicle.signals import Reached
from flightd.site.site import Side
from flightd.site.site_file import load_site
from tests.unit.fleet.vehicle_rig import BOTH, V2, Drone, floor_of, instant, order

RACKS = load_site(Path(__file__).parents[3] / "configs" / "site-racks-small.toml")
"""Places on levels 1 and 2 of both sides of A2 and A3, on the left of A1, on the right of B1."""


def scan(name: str = "x", /, **told: Any) -> Action:
    """A scanShelf with these parameters alone."""
    parameters = [ActionParameter(key=key, value=value) for key, value in told.items()]
    return Action(
        action_type="scanShelf",
        action_id=name,
        blocking_type=BlockingType.HARD,
        action_parameters=parameters or None,
    )


def stands(version: Version) -> Drone:
    drone = Drone(version)
    drone.vehicle.change_floor(floor_of(RACKS))
    return drone


@BOTH
@pytest.mark.parametrize(
    ("told", "asked"),
    [
        ({"side": "left"}, ScanShelf((), Side.LEFT)),
        ({"levels": [2, 1, 2]}, ScanShelf((2, 1))),
        ({"levels": [1, 9], "side": "right"}, ScanShelf((1, 9), Side.RIGHT)),  # level 9 is elsewhere
        ({}, ScanShelf()),
    ],
)
def test_side_and_levels_may_be_told_alone_together_or_not_at_all(
    version: Version, told: dict[str, str | list[int]], asked: ScanShelf
) -> None:
    drone, action = stands(version), scan(**told)
    drone.say(order("A1 A2", actions={"A2": [action]}))
    assert drone.errors == []
    assert drone.ahead == "A2"
    assert scan_shelf_of(action) == asked


@BOTH
@pytest.mark.parametrize(
    ("node", "told", "parameter", "why"),
    [
        ("A2", {"side": "up"}, "side", "is neither left nor right"),
        ("A2", {"side": "LEFT"}, "side", "is neither left nor right"),
        ("A2", {"side": ["left"]}, "side", "is neither left nor right"),
        ("A2", {"side": {"of": "left"}}, "side", "is neither left nor right"),
        ("A2", {"levels": [[1]]}, "levels", "is no list of 1 to 99 levels, from 1 to 99"),
        ("A2", {"levels": {"1": 2}}, "levels", "is no list of 1 to 99 levels, from 1 to 99"),
        ("A2", {"expected": [["X"]]}, "expected", "is no list of up to 10000 codes"),
        ("A2", {"expected": {"X": 1}}, "expected", "is no list of up to 10000 codes"),
        ("A1", {"side": "right"}, "side", "the right side of node A1 has no place to count"),
        ("A2", {"levels": [3]}, "levels", "node A2 has places on level 1, 2 alone"),
        (
            "A1",
            {"side": "left", "levels": [7]},
            "levels",
            "the left side of node A1 has places on level 1, 2 alone",
        ),
        ("A2", {"levels": [100]}, "levels", "is no list of 1 to 99 levels, from 1 to 99"),
    ],
)
def test_what_is_not_there_is_refused_by_the_parameter_in_one_line(
    version: Version, node: str, told: dict[str, Any], parameter: str, why: str
) -> None:
    drone = stands(version)
    drone.say(order("A1 A2", actions={node: [scan(**told)]}))
    (error,) = drone.state.errors
    assert error.error_type == "INVALID_ORDER_ACTION"
    assert (b'"orderError"' if version is V2 else b'"INVALID_ORDER_ACTION"') in encoded(drone.state, version)
    assert (drone.about("actionId"), drone.about("parameter")) == (["x"], [parameter])
    assert error.error_description == f"scanShelf: {parameter}: {why}"


@BOTH
def test_a_node_without_a_single_place_is_not_counted(version: Version) -> None:
    drone = stands(version)
    bare = floor_of(RACKS)
    none = {side: frozenset[int]() for side in Side}
    drone.vehicle.change_floor(type(bare)(bare.map_id, bare.nodes, bare.ways, {**bare.shelves, "A2": none}))
    drone.say(order("A1 A2", actions={"A2": [scan()]}))
    assert drone.errors == ["INVALID_ORDER_ACTION"]
    assert drone.state.errors[0].error_description == "scanShelf: actionType: node A2 has no place to count"


@BOTH
def test_the_actions_of_the_next_visit_and_those_that_go_on_are_told_by_node(version: Version) -> None:
    drone = stands(version)
    left, right = scan("l", side="left"), scan("r", side="right")
    drone.say(order("A1 A2 A3", actions={"A2": [left], "A3": [right, scan("both")]}))
    asked = {node: [one.action_id for one in here] for node, here in drone.vehicle.actions.items()}
    assert asked == {"A2": ["l"], "A3": ["r", "both"]}
    drone.say(Reached("A2"))
    assert [one.action_id for one in drone.vehicle.actions["A2"]] == ["l"], "it goes on"


@BOTH
def test_a_cancelled_order_has_nothing_counted_at_the_node_where_it_ends(version: Version) -> None:
    drone = stands(version)
    drone.say(order("A1 A2 A3", actions={"A2": [scan("l", side="left")]}))
    drone.is_at("A1", driving=True)
    drone.say(instant("cancelOrder"))
    assert drone.vehicle.ahead == ("A2",)
    assert drone.vehicle.actions == {"A2": ()}


def test_the_factsheet_says_what_side_means_and_that_both_may_be_left_out() -> None:
    (sheet,) = (one for one in known_actions() if one.action_type == "scanShelf")
    told = {one.key: one for one in sheet.action_parameters or []}
    assert told["side"].is_optional
    assert told["levels"].is_optional
    assert "looks along the site's +x" in (told["side"].description or "")
