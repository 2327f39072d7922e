"""The station's own fleet as schedules see it: whichever drone has the time does what is due."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from flightd.adapters.ground_link.messages.answers import Welcome
from flightd.adapters.ground_link.messages.base import Role
from flightd.adapters.ground_link.messages.floor import FloorStatus
from flightd.adapters.ground_link.messages.published import StatusReport
from flightd.core.types import Phase
from flightd.fleet.traffic.valued_work import Worth
from flightd.ground.schedules.start_rules import Cause, Objection
from flightd.ground.valued_nodes import ByValue


class ScheduledFleet(Protocol):
    """What `OwnFleet` is to a schedule."""

    @property
    def names(self) -> frozenset[str]:
        """Of its drones."""
        ...

    @property
    def map(self) -> FloorStatus:
        """By which they fly.  UnavailableError where none told it yet."""
        ...

    @property
    def trouble(self) -> str:
        """Why it does not fly; empty where it does."""
        ...

    def flies(self, name: str) -> bool:
        """No person has the drone."""
        ...

    def has_run(self, run: str) -> bool:
        """It was given the work of a run, which may not be written down yet."""
        ...

    def knows_run(self, run: str) -> bool:
        """The work of a run is written down as given, with the run's id."""
        ...

    def valued(self, worth: Mapping[str, Worth], asked: ByValue) -> tuple[str, ...]:
        """The most valuable nodes that may be asked for now.  UnavailableError where the fleet does not
        fly."""
        ...

    def take_run(
        self, run: str, worth: Mapping[str, Worth], *, until_s: float, levels: Sequence[int]
    ) -> None:
        """Have the nodes of a run visited, once, and these levels counted there (none: all); `knows_run` says
        when that is written down.  Until `until_s` (UTC) it outlives a station that ends.  InputError for a
        node that is not there, UnavailableError where the fleet does not fly."""
        ...

    @property
    def runs_left(self) -> frozenset[str]:
        """Those of which something waits, or is given to a drone."""
        ...

    def has_begun(self, nodes: Sequence[str]) -> bool:
        """Whether one of these was visited, or a drone is to visit it, since they were asked for."""
        ...

    def let_runs(self, why_not: Mapping[str, str], over: Mapping[str, str]) -> None:
        """Of these runs why nothing is begun now, empty where it may be; what waits of those that are `over`
        is given up, for these reasons."""
        ...

    def left_of(self, nodes: Sequence[str]) -> tuple[str, ...]:
        """Which of these it has not visited, or was asked for since."""
        ...


class HeardDrone(Protocol):
    """What a drone told last."""

    @property
    def welcome(self) -> Welcome | None: ...

    @property
    def heard(self) -> StatusReport | None: ...


def fleet_objection(site: str, fleet: ScheduledFleet, drones: Mapping[str, HeardDrone]) -> Objection | None:
    """What comes first of all that speaks against work of the fleet on `site` without a person."""
    if fleet.trouble:
        return Objection(Cause.UNREACHABLE, f"the fleet does not fly: {fleet.trouble}")
    own = {name: drones[name] for name in sorted(fleet.names) if name in drones}
    welcomes = [drone.welcome for drone in own.values() if drone.welcome is not None]
    checks = (
        (fleet.map.name != site, Cause.SITE, f"the drone is on site {fleet.map.name}"),
        (
            not all(welcome.floor.unattended_start for welcome in welcomes),
            Cause.RULES,
            f"the site file of {site} does not say unattended_start = true",
        ),
        (
            any(welcome.role is not Role.OPERATOR for welcome in welcomes),
            Cause.ROLE,
            "the station's key is a viewer's: it may start nothing",
        ),
    )
    found = next((Objection(cause, why) for applies, cause, why in checks if applies), None)
    return found or _none_ready(fleet, own)


def _none_ready(fleet: ScheduledFleet, own: Mapping[str, HeardDrone]) -> Objection | None:
    """Why no drone would fly now: of those that are the fleet's one has to fly, or nothing to keep it on the
    ground."""
    heard = {name: drone.heard for name, drone in own.items() if drone.heard is not None}
    if not heard:
        return Objection(Cause.UNREACHABLE, "the drone is not heard")
    why = Objection(Cause.PERSON, "a person has it")
    for name, status in heard.items():
        if not fleet.flies(name):
            continue
        if status.phase is not Phase.PREFLIGHT and status.possible:
            return None
        if status.phase is Phase.PREFLIGHT and not status.obstacles:
            return None
        keeps = "; ".join(status.obstacles) or f"the drone is in phase {status.phase}"
        why = Objection(Cause.NOT_READY, keeps)
    return why
