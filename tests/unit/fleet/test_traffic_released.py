"""What is released to a drone stays its own, whoever is planned before it."""

from __future__ import annotations

import functools
import random

import pytest

from flightd.fleet.traffic.traffic_control import TrafficControl
from tests.unit.fleet.traffic_rig import CELL, PACE, SmallHall, fly_out

HALL = functools.cache(lambda: SmallHall(2, 4, 5))


@pytest.mark.parametrize("seed", [284, *range(6)])
def test_a_drone_that_displaces_another_ones_plan_does_not_have_what_is_released_to_that(seed: int) -> None:
    """With 284 the one whose plan was displaced lost the air it was in, and another was sent there."""
    rng, hall = random.Random(seed), HALL()
    control = TrafficControl(hall.lanes, PACE, CELL)
    nodes = rng.sample([vertex.name for vertex in hall.lanes.vertices if vertex.pad is None], 5)
    pads = list(hall.lanes.pads)
    rng.shuffle(pads)
    for i, (node, pad) in enumerate(zip(nodes, pads, strict=True)):
        if control.may_enter(f"d{i}", hall.lanes.over(node)):
            control.enter(f"d{i}", hall.lanes.over(node), ends=(pad,))
    control.replan(list(control.drones), 0)
    control.release(0)
    for drone in list(control.drones):
        if rng.random() < 0.5 and control.drones[drone].base:
            control.done(drone, control.drones[drone].done + 1, 3000)
    control.fail("d0", 4000)
    control.replan(list(control.drones), 5000)
    fly_out(control, seed)
