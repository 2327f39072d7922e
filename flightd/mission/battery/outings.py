"""How many batteries a plan takes, and how long it is in the air: the rule by which a flight turns back,
applied to the plan before it is flown.  Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flightd.core.geometry import wrap_pi
from flightd.mission.battery.sorties import Sorties
from flightd.mission.plan.flight_plan import FlightPlan
from flightd.mission.plan.leg_times import Pace
from flightd.site.site import Site


@dataclass(frozen=True, slots=True)
class Flown:
    """Seconds in the air over all batteries, and how many of these."""

    seconds: float
    batteries: int


@dataclass(frozen=True, slots=True)
class Supply:
    """What the battery has, what a second in the air takes of it, and what is to be left; shares of full."""

    charge: float
    rate_per_s: float
    reserve: float

    def left_s(self, charge: float) -> float:
        """Seconds in the air until only the reserve of that charge is left."""
        return (charge - self.reserve) / self.rate_per_s


def flown_on(sorties: Sorties, plan: FlightPlan, ways_s: WaysOfPlan, supply: Supply) -> Flown:
    """What a plan takes whose nodes are each in reach of a full battery, from the battery on that is in it.

    As in flight it goes on to a node only with what brings it from there to a charge pad with its reserve,
    by the times that a flight turns back by; otherwise it turns back and goes on from the pad with a full
    battery.  The time in the air is that of the ways as they are planned."""
    batteries, landed_s, flies = 1, 0.0, False
    here, air_s, left_s = plan.start, sorties.take_off_s, supply.left_s(supply.charge)
    for node, planned_s in ways_s.visits:
        way_s = planned_s
        stop_s = sorties.stop_s(node)
        needed_s = air_s + sorties.on_s(here, node) + stop_s + sorties.way_back(node).seconds
        if needed_s > left_s and (flies or (batteries == 1 and supply.charge < 1.0)):
            if flies:
                back = sorties.way_back(here)
                landed_s += air_s + back.seconds
                here, way_s = back.pad, sorties.on_s(back.pad, node)
            batteries += 1
            air_s, left_s = sorties.take_off_s, supply.left_s(1.0)
        air_s += way_s + stop_s
        here, flies = node, True
    return Flown(landed_s + air_s + ways_s.home_s + sorties.land_s, batteries)


@dataclass(frozen=True, slots=True)
class WaysOfPlan:
    """`visits` are the visited nodes of a plan, each with the seconds of the way to it, `home_s` those of the
    way from the last one to above the pad."""

    visits: tuple[tuple[str, float], ...]
    home_s: float

    @classmethod
    def of(cls, site: Site, plan: FlightPlan, pace: Pace) -> WaysOfPlan:
        """Turns and legs of the plan, one after the other."""
        visits, seconds = [], 0.0
        at, yaw_rad = site.nodes[plan.start], plan.start_yaw_rad
        for stop in plan.stops:
            leg_m = math.hypot(stop.x_m - at.x_m, stop.y_m - at.y_m)
            if leg_m > 0.0:
                seconds += pace.turn_s(abs(wrap_pi(stop.yaw_rad - yaw_rad))) + pace.leg_s(leg_m)
            at, yaw_rad = site.nodes[stop.node], stop.yaw_rad
            if stop.visit:
                visits.append((stop.node, seconds))
                seconds = 0.0
        return cls(tuple(visits), seconds)
