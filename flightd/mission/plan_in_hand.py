"""The plan that the next start flies: the configured one, until somebody chose nodes and shelves.  Pure."""

from __future__ import annotations

from collections.abc import Sequence

from flightd.config.schema import Config
from flightd.core.count_choice import ALL, CountChoice, ShelfCount
from flightd.core.planned_flight import PlannedFlight, StandingPlan
from flightd.core.types import Command
from flightd.mission.chosen_plan import ChosenPlans
from flightd.mission.plan.flight_plan import FlightPlan, HeadingPolicy, make_plan
from flightd.mission.scan.no_scan import AnyScanner
from flightd.site.site import Site


class PlanInHand:
    """Holds one plan at a time; `scanner` is told what is counted."""

    def __init__(
        self, site: Site, configured: FlightPlan, policy: HeadingPolicy, config: Config, scanner: AnyScanner
    ) -> None:
        self._site, self._policy = site, policy
        self.plan = self._configured = configured
        self.id = ""
        """Of the command that chose it; empty: it is the configured one."""
        self._choice = ALL
        self._chosen = ChosenPlans(site, configured, policy, config, scanner)
        self._scanner = scanner

    def take(self, command: Command) -> str:
        """Hold the plan over the nodes and shelves of a command, or again the configured one (no nodes), and
        say which in words.  InputError where it cannot be flown: nothing changes."""
        if command.nodes:
            choice = CountChoice.of(command.levels, command.counts)
            plan = self._chosen.plan(command.nodes, choice, waits=command.waits)
            self.plan, self.id, self._choice = plan, command.id, choice
        else:
            self.plan, self.id, self._choice = self._configured, "", ALL
        self._scanner.choose(self._choice, by_stopping=self.plan.waits)
        text = f"{self.plan.nodes} nodes" if command.nodes else "as configured again"
        if self._choice.levels:
            text += f", counted on level {', '.join(map(str, self._choice.levels))}"
        if self._choice.shelves is not None:
            text += f", counted at {len({one.node for one in self._choice.shelves})} of them"
        return f"{text}, to hold at the last" if self.plan.waits else text

    def count_at(self, node: str, shelves: tuple[ShelfCount, ...] | None) -> None:
        """Count at a node that is flown to by order what is of these; by the plan's levels where none are
        told."""
        self._scanner.choose_at(node, CountChoice.of(self._choice.levels, shelves))

    def begin_at(self, node: str, yaw_rad: float) -> FlightPlan:
        """Stand on the pad of another node from now on; what is flown from there until another plan is
        chosen: home, counting as before."""
        home = self._configured.home
        self._configured = make_plan(self._site, (), node, home, self._policy, yaw_rad)
        self._chosen.begin_at(node, yaw_rad)
        self.plan, self.id = self._configured, ""
        return self.plan

    def standing(self, visited: Sequence[str], remaining: tuple[str, ...]) -> StandingPlan:
        """What is told of it."""
        nodes = tuple(stop.node for stop in self.plan.stops if stop.visit)
        choice = self._choice
        return StandingPlan(self.id, nodes, choice.levels, tuple(visited), remaining, choice.shelves)

    def planned(
        self,
        nodes: Sequence[str],
        choice: CountChoice,
        charge: tuple[float, float],
        *,
        best_order: bool,
        waits: bool,
    ) -> PlannedFlight:
        """What a flight over the nodes (none: as configured, of any length), home or (`waits`) counted by
        stopping and to hold at the last, would be from a battery of `charge`: its share (0..1) and the share
        used in each second of flight.  InputError where it cannot be flown."""
        plan, choice = self._configured, choice if nodes else ALL
        if nodes:
            plan = self._chosen.plan(nodes, choice, best_order=best_order, waits=waits)
        return self._chosen.estimate(plan, choice, *charge, by_stopping=waits)
