"""A flight over nodes and shelves that somebody chose: checked, ordered, planned and estimated.  Pure."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

from flightd.config.schema import Config
from flightd.core.count_choice import ALL, CountChoice
from flightd.core.errors import InputError
from flightd.core.planned_flight import MOST_NODES, PlannedFlight
from flightd.mission.battery.outings import Supply, WaysOfPlan, flown_on
from flightd.mission.battery.sorties import Sorties
from flightd.mission.plan.flight_plan import FlightPlan, HeadingPolicy, make_plan, runs_of
from flightd.mission.plan.leg_times import Legs, Pace
from flightd.mission.plan.route_optimiser import ordered_best
from flightd.mission.scan.legibility import unread_labels
from flightd.mission.scan.no_scan import AnyScanner
from flightd.site.site import Site

_BEST_OF = 60
"""More nodes are flown aisle by aisle: to look for a better order would hold up the ticks."""
_SHOWN = 3


class ChosenPlans:
    """Plans of one drone on one site, from the pad on which `first` begins.  Flies nothing."""

    def __init__(
        self, site: Site, first: FlightPlan, policy: HeadingPolicy, config: Config, scanner: AnyScanner
    ) -> None:
        self._site = site
        self._first = first
        self._policy = policy
        self._pace = Pace.of(config.mission)
        self._legs = Legs(site, policy, self._pace)
        self._config = config
        self._scanner = scanner

    def begin_at(self, node: str, yaw_rad: float) -> None:
        """From the pad of another node from now on."""
        self._first = replace(self._first, start=node, start_yaw_rad=yaw_rad)

    def plan(
        self,
        nodes: Sequence[str],
        choice: CountChoice = ALL,
        *,
        best_order: bool = False,
        waits: bool = False,
    ) -> FlightPlan:
        """The plan over these nodes, each once, home or (`waits`) to hold at the last, its shelves counted by
        stopping: who leads it on from node to node has to know its way.  InputError, one line, for a node
        that the site lacks, that no open line leads to or that a full battery does not reach and come back
        from, and for levels, or a shelf of the choice, that nothing is counted on."""
        wanted = tuple(dict.fromkeys(nodes))
        self._check(wanted, choice)
        first = self._first
        if best_order and len(wanted) <= _BEST_OF:
            ends, yaw = (first.start, first.home), first.start_yaw_rad
            wanted = ordered_best(self._site, wanted, ends, self._policy, self._pace, yaw)
        elif best_order:
            place = {node: i for i, node in enumerate(self._site.serpentine_route())}
            wanted = tuple(sorted(wanted, key=lambda node: place.get(node, len(place))))
        ends, yaw_rad = (first.start, first.home), first.start_yaw_rad
        plan = make_plan(self._site, wanted, *ends, self._policy, yaw_rad, waits=waits)
        far = self._sorties(choice, by_stopping=waits).out_of_reach(wanted)
        if far:
            raise InputError(
                f"a full battery does not reach {_listed(far)}, last for the stop there and come back with"
                " its reserve; leave it out"
            )
        return plan

    def estimate(
        self,
        plan: FlightPlan,
        choice: CountChoice,
        charge: float,
        rate_per_s: float,
        *,
        by_stopping: bool = False,
    ) -> PlannedFlight:
        """What flying a plan takes, from a battery of that `charge` (0..1) on, `rate_per_s` of a full one
        being used in each second in the air, and nothing counted in passing if `by_stopping`.  Each view of a
        shelf is looked from once, for its longest."""
        nodes = tuple(stop.node for stop in plan.stops if stop.visit)
        sorties = self._sorties(choice, by_stopping=by_stopping)
        way, site = [plan.start, *(stop.node for stop in plan.stops)], self._site
        metres = sum(site.length_m(site.path(a, b)) for a, b in itertools.pairwise(way))
        ways_s = WaysOfPlan.of(site, plan, self._pace)
        places = [
            code for node in dict.fromkeys(nodes) for code in sorted(self._scanner.places_at(node, choice))
        ]
        flown = flown_on(sorties, plan, ways_s, Supply(charge, rate_per_s, self._config.battery.reserve))
        return PlannedFlight(
            nodes=nodes,
            levels=choice.levels,
            way=tuple(way),
            places=len(places),
            way_m=metres,
            seconds=flown.seconds,
            batteries=flown.batteries,
            charge=charge,
            battery_s=(1.0 - self._config.battery.reserve) / rate_per_s,
            sweeps=() if by_stopping else self._scanner.told_sweeps(runs_of(site, plan.stops), choice),
            unread=unread_labels(site, self._config, places),
        )

    def _sorties(self, choice: CountChoice, *, by_stopping: bool) -> Sorties:
        return Sorties(
            self._site, self._legs, self._config.battery, self._scanner, choice, by_stopping=by_stopping
        )

    def _check(self, nodes: Sequence[str], choice: CountChoice) -> None:
        if not nodes:
            raise InputError("no node is chosen")
        if len(nodes) > MOST_NODES:
            raise InputError(
                f"{len(nodes)} nodes are more than the {MOST_NODES} of one flight; fly it in parts"
            )
        if unknown := [node for node in nodes if node not in self._site.nodes]:
            raise InputError(f"no node {_listed(unknown)} on site {self._site.name}")
        if choice.levels and not self._scanner.counts:
            raise InputError("this flight counts no shelves: leave the levels out")
        if choice.levels and not any(self._scanner.places_at(node, choice) for node in nodes):
            texts = ", ".join(map(str, choice.levels))
            raise InputError(f"nothing is counted on level {texts} at any of these nodes")
        bare = [one for one in choice.shelves or () if not self._scanner.places_at(one.node, one.alone)]
        if bare and self._scanner.counts:
            raise InputError(f"there is no place {bare[0]}")


def _listed(nodes: Sequence[str]) -> str:
    more = f" and {len(nodes) - _SHOWN} more" if len(nodes) > _SHOWN else ""
    return ", ".join(nodes[:_SHOWN]) + more
