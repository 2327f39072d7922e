"""The plan that the next start flies: the configured one, until somebody chose nodes and levels.  Pure."""

from __future__ import annotations

from collections.abc import Sequence

from flightd.config.schema import Config
from flightd.core.planned_flight import PlannedFlight, StandingPlan
from flightd.core.types import Command
from flightd.mission.chosen_plan import ChosenPlans
from flightd.mission.plan.flight_plan import FlightPlan, HeadingPolicy, make_plan
from flightd.mission.scan.no_scan import AnyScanner
from flightd.site.site import Site


class PlanInHand:
    """Holds one plan at a time; `scanner` is told the levels that are counted."""

    def __init__(
        self, site: Site, configured: FlightPlan, policy: HeadingPolicy, config: Config, scanner: AnyScanner
    ) -> None:
        self._site, self._policy = site, policy
        self.plan = self._configured = configured
        self.id = ""
        """Of the command that chose it; empty: it is the configured one."""
        self._levels: tuple[int, ...] = ()
        self._chosen = ChosenPlans(site, configured, policy, config, scanner)
        self._scanner = scanner

    def take(self, command: Command) -> str:
        """Hold the plan over the nodes and levels of a command, or again the configured one (no nodes), and
        say which in words.  InputError where it cannot be flown: nothing changes."""
        if command.nodes:
            plan = self._chosen.plan(command.nodes, command.levels, waits=command.waits)
            self.plan, self.id, self._levels = plan, command.id, command.levels
        else:
            self.plan, self.id, self._levels = self._configured, "", ()
        self._scanner.choose(self._levels, by_stopping=self.plan.waits)
        text = f"{self.plan.nodes} nodes" if command.nodes else "as configured again"
        text += f", counted on level {', '.join(map(str, self._levels))}" if self._levels else ""
        return f"{text}, to hold at the last" if self.plan.waits else text

    def begin_at(self, node: str, yaw_rad: float) -> FlightPlan:
        """Stand on the pad of another node from now on; what is flown from there until another plan is
        chosen: home."""
        home = self._configured.home
        self._configured = make_plan(self._site, (), node, home, self._policy, yaw_rad)
        self._chosen.begin_at(node, yaw_rad)
        self.plan, self.id, self._levels = self._configured, "", ()
        return self.plan

    def standing(self, visited: Sequence[str], remaining: tuple[str, ...]) -> StandingPlan:
        """What is told of it."""
        nodes = tuple(stop.node for stop in self.plan.stops if stop.visit)
        return StandingPlan(self.id, nodes, self._levels, tuple(visited), remaining)

    def planned(
        self,
        nodes: Sequence[str],
        levels: Sequence[int],
        charge: tuple[float, float],
        *,
        best_order: bool,
        waits: bool,
    ) -> PlannedFlight:
        """What a flight over the nodes (none: as configured, of any length), home or (`waits`) counted by
        stopping and to hold at the last, would be from a battery of `charge`: its share (0..1) and the share
        used in each second of flight.  InputError where it cannot be flown."""
        plan, levels = self._configured, tuple(levels) if nodes else ()
        if nodes:
            plan = self._chosen.plan(nodes, levels, best_order=best_order, waits=waits)
        return self._chosen.estimate(plan, levels, *charge, by_stopping=waits)
