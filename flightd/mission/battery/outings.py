"""How many batteries a plan takes, and how long it is in the air: the rule by which a flight turns back,
applied to the plan before it is flown.  Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flightd.mission.battery.sorties import Sorties
from flightd.mission.plan.flight_plan import FlightPlan


@dataclass(frozen=True, slots=True)
class Flown:
    """Seconds in the air over all batteries, and how many of these."""

    seconds: float
    batteries: int


def flown_on(
    sorties: Sorties,
    plan: FlightPlan,
    nodes: Sequence[str],
    charge: float,
    rate_per_s: float,
    reserve: float,
) -> Flown:
    """What visiting the nodes of a plan takes, in their order; each must be in reach of a full battery.

    As in flight it goes on to a node only with what brings it from there to a charge pad with its reserve;
    otherwise it turns back and goes on from the pad with a full battery."""
    batteries, landed_s, flies = 1, 0.0, False
    here, air_s, left_s = plan.start, sorties.take_off_s, (charge - reserve) / rate_per_s
    for node in nodes:
        stop_s = sorties.stop_s(node)
        needed_s = air_s + sorties.on_s(here, node) + stop_s + sorties.way_back(node).seconds
        if needed_s > left_s and (flies or (batteries == 1 and charge < 1.0)):
            back = sorties.way_back(here)
            if flies:
                landed_s += air_s + back.seconds
                here = back.pad
            batteries += 1
            air_s, left_s = sorties.take_off_s, (1.0 - reserve) / rate_per_s
        air_s += sorties.on_s(here, node) + stop_s
        here, flies = node, True
    return Flown(landed_s + air_s + sorties.on_s(here, plan.home) + sorties.land_s, batteries)
