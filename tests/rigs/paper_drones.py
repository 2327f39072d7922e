"""Drones on paper: they take the ground link's commands and fly straight from node to node, in virtual time.

Each has a pad of its own on a spur of one hall."""

from __future__ import annotations

import asyncio
import itertools
import math
import random
from collections.abc import Callable, Sequence
from typing import Any

from flightd.adapters.ground_link.floor_status import floor_status
from flightd.adapters.ground_link.messages.answers import Accepted, Planned
from flightd.adapters.ground_link.messages.published import (
    EventReport,
    LinkReport,
    Position,
    StatusReport,
    VehicleReport,
)
from flightd.core.errors import FlightdError, RunError
from flightd.core.types import CommandKind, EventLevel, Phase
from flightd.ground.messages import Act, LinkState
from flightd.sim.fleet.world import FleetDrone
from flightd.site.layout import lay_out
from flightd.site.site import Aisle, Pad, Rack, Site

PADS = {"a": "A1", "b": "B1", "c": "B5"}
STEP_S = 0.1
_STEPS_M = (2.0, 1.6, 1.6, 2.0)
_SPEED_MPS = 1.0
_IN_AIR = (
    CommandKind.PAUSE,
    CommandKind.RESUME,
    CommandKind.GOTO,
    CommandKind.HOME,
    CommandKind.LAND,
    CommandKind.STOP,
)
_COUNTS_S = 6.0
_LASTS_S = {Phase.TAKE_OFF: 3.0, Phase.HOVER: 1.0, Phase.LAND: 3.0, Phase.RECOVER: 3.0}


def hall(
    drone: str, name: str = "hall", pad: str = "", docks: Sequence[str] = (), *, unattended: bool = False
) -> Site:
    """Two aisles of three nodes between the spurs at their ends, as this drone knows it; its own `pad` may be
    at another node.  Where there are `docks`, at these nodes, batteries are charged there alone."""
    at = PADS | ({drone: pad} if pad else {})
    pads = [
        Pad("home" if each == drone else f"pad-{each}", node, 0.5, charge=each == drone and not docks)
        for each, node in at.items()
        if node not in docks
    ]
    pads += [Pad(f"dock-{node}", node, 0.5, start=False, shared=True) for node in docks]
    aisles = [
        Aisle(aisle, 0.0, y_m, _STEPS_M, shelf_distance_m=1.2, shelf_height_m=2.5)
        for aisle, y_m in (("A", 0.0), ("B", 3.0))
    ]
    racks = [Rack(("A", "B"), 1.6, (0.3, 1.5), positions=1)]
    crosses = [("A2", "B2"), ("A4", "B4")]
    return lay_out(name, aisles, crosses, pads, ceiling_m=6.0, racks=racks, unattended_start=unattended)


class PaperDrone:
    """What of `DroneLink` flies a drone, and the drone; `tell` has what a hub would say of it."""

    def __init__(self, name: str, site: Site, tell: Callable[[str, str, Any], None]) -> None:
        self.name = name
        self.site = site
        self._tell = tell
        self.on_person: Callable[[], None] = lambda: None
        self.heard = self.sees = True
        self.sigmas_m: tuple[float | None, float | None] = (0.02, 0.02)
        """Along x and y; None is told where one is infinite."""
        self.counts = self.never_starts = False
        self.obstacles: tuple[str, ...] = ()
        """What keeps it on the ground."""
        self.battery_frac = 0.9
        self.knows_docks = True
        self.charges_per_s = 0.0
        """Where it stands on a shared pad."""
        self.refuses: dict[CommandKind, FlightdError] = {}
        """Commands that have no effect, and how that shows."""
        self.plan = ""
        self._plan_waits = False
        self._nodes: tuple[str, ...] = ()
        self._session = self._now_ns = 0
        self._events: list[EventReport] = []
        self._events_seq = itertools.count(1)
        self._seq = itertools.count(1)
        self.commands: list[str] = []
        self.truth = FleetDrone(name, 0, random.Random(0))
        self.way: list[str] = []
        self._waits_before = 0
        self.begin_anew()

    def begin_anew(self, *, on_pad: bool = True) -> None:
        """Its daemon begins anew, believing to be on its pad."""
        self._session += 1
        self.phase, self.way, self.paused, self.left_s = Phase.PREFLIGHT, [], False, 900.0
        self.plan, self._plan_waits = "", False
        self._events, self._events_seq, self._seq = [], itertools.count(1), itertools.count(1)
        self.waits = False
        self.stand = self.site.home.node
        """The node on whose pad it believes to stand before a flight."""
        self._end, self.ends_as = self.stand, Phase.DONE
        self._timer_s = 0.0
        self._begins_in_air = self.truth.z_m > 0.0 and not on_pad
        if self._begins_in_air:
            self.phase = Phase.RECOVER
        if on_pad:
            self.truth.x_m, self.truth.y_m = self._pad
            self.truth.z_m = 0.0
        self.welcome()

    def welcome(self) -> None:
        """A station connects to it."""
        welcome = {"session": f"{self.name} {self._session}", "floor": floor_status(self.site)}
        self._tell(self.name, "welcome", {**welcome, "role": "operator"})

    @property
    def _pad(self) -> tuple[float, float]:
        at = self.site.nodes[self.site.home.node]
        return at.x_m, at.y_m

    def come_down(self) -> None:
        """Its own rules land it where it is."""
        self.phase, self._timer_s, self.way, self.ends_as = Phase.LAND, 0.0, [], Phase.ABORTED

    def turn_home(self) -> None:
        """Its battery, or an order, sends it home: nobody sends it anywhere any more."""
        self.plan, self.paused = "", False
        self._fly_over(self.way[:1], waits=False)

    # as DroneLink

    @property
    def flies(self) -> bool:
        return self.phase in _LASTS_S or self.phase in {Phase.FOLLOW, Phase.HOLD, Phase.RELOCATE}

    async def act(self, act: Act, *, by_person: bool = True, **_: Any) -> Accepted:
        if by_person:
            self.on_person()
        if act.command in self.refuses:
            raise self.refuses[act.command]
        stays = self.never_starts and act.command is CommandKind.START
        if stays or act.command not in self._possible:
            raise RunError(f"{act.command} refused: not in phase {self.phase}")
        self.commands.append(f"{act.command} {act.node}".strip())
        self._event("command", self.commands[-1])
        here = self.way[0] if self.way else ""
        match act.command:
            case CommandKind.START:
                self.phase, self._timer_s = Phase.TAKE_OFF, 0.0
                self._fly_over(self._nodes, waits=self._plan_waits)
            case CommandKind.GOTO if self.waits_at == act.node == here and not (act.waits or act.lands):
                self._fly_over([here], waits=False)
            case CommandKind.GOTO:
                rests = self._is_at_end and self.phase is Phase.HOLD
                end = act.node if act.lands else ""
                self._fly_over([act.node] if rests else [here, act.node], waits=act.waits, end=end)
            case CommandKind.PAUSE | CommandKind.RESUME:
                self.paused = act.command is CommandKind.PAUSE
            case CommandKind.HOME:
                self.turn_home()
            case CommandKind.LAND | CommandKind.STOP:
                self.come_down()
        return Accepted(version=1, request=act.id)

    async def plan_flight(
        self, nodes: Sequence[str], levels: Sequence[int], order_id: str = "", **how: Any
    ) -> Planned:
        if not how.get("dry"):
            self.plan, self._nodes, self._plan_waits = order_id, tuple(nodes), how.get("waits", False)
            self._event("command", "plan")
        way = (self.stand, *nodes, self.site.home.node)
        return Planned(
            version=1, request=order_id, nodes=tuple(nodes), levels=tuple(levels), way=way,
            places=4 * self.counts, way_m=40.0, seconds=80.0, batteries=1, charge=1.0, battery_s=900.0,
        )  # fmt: skip

    async def inventory(self) -> tuple[dict[str, str], ...]:
        return ()

    # the drone

    async def run(self) -> None:
        """Fly until cancelled."""
        while True:
            await asyncio.sleep(STEP_S)
            self._now_ns += round(STEP_S * 1e9)
            self._fly()
            heard_s = 0.0 if self.heard else 10.0
            self._tell(self.name, "link", LinkState(True, heard_s, 1.0, 0, True, self.flies, ""))
            if self.heard:
                self._tell(self.name, "events", tuple(self._events))
                self._tell(self.name, "status", self.status)

    def _fly_over(self, nodes: Sequence[str], *, waits: bool, end: str = "") -> None:
        self._end = end or self.site.home.node
        home = self._home_from(nodes[-1])
        self.way = [*nodes, *([nodes[-1]] if waits else []), *home]
        self.waits, self._waits_before = waits, len(home)

    @property
    def _is_at_end(self) -> bool:
        return self.waits and len(self.way) == self._waits_before + 1

    @property
    def waits_at(self) -> str:
        return self.way[-self._waits_before - 1] if self.waits and self.way else ""

    def _home_from(self, node: str) -> list[str]:
        """Onto the pad: its node comes twice where the drone is there."""
        return [*self.site.path(node, self._end)[1:], self._end]

    def _fly(self) -> None:
        self._timer_s += STEP_S
        if self.phase is Phase.PREFLIGHT and self.stand != self.site.home.node:
            self.battery_frac = min(self.battery_frac + STEP_S * self.charges_per_s, 1.0)
        lasts_s = _COUNTS_S if self.counts and self.phase is Phase.HOVER else _LASTS_S.get(self.phase, 0.0)
        if self._timer_s < lasts_s and not self._holds:
            return
        match self.phase:
            case Phase.TAKE_OFF:
                self.truth.z_m = 1.5
                self._begin(Phase.FOLLOW)
            case Phase.HOVER if self._holds or self._is_at_end:
                self._begin(Phase.HOLD)
            case Phase.HOVER:
                self._event("visited", self.way.pop(0))
                self._begin(Phase.FOLLOW if self.way else Phase.LAND)
            case Phase.FOLLOW if self._holds:
                self._begin(Phase.HOLD)
            case Phase.FOLLOW:
                self._go()
            case Phase.HOLD if not self.paused and not self._is_at_end:
                self._begin(Phase.FOLLOW)
            case Phase.LAND:
                self.truth.z_m = 0.0
                as_told = self.ends_as is Phase.DONE and self._end != self.site.home.node
                self.stand = self._end if as_told else self.stand
                self.plan = "" if as_told else self.plan
                self._begin(Phase.PREFLIGHT if as_told else self.ends_as)
            case Phase.RECOVER:
                self.come_down()
            case _:
                pass

    @property
    def _holds(self) -> bool:
        return self.paused and self.phase in {Phase.HOVER, Phase.FOLLOW}

    def _go(self) -> None:
        goal = self.site.nodes[self.way[0]]
        dx, dy = goal.x_m - self.truth.x_m, goal.y_m - self.truth.y_m
        left_m, step_m = math.hypot(dx, dy), _SPEED_MPS * STEP_S
        part = 1.0 if left_m <= step_m else step_m / left_m
        self.truth.x_m, self.truth.y_m = self.truth.x_m + part * dx, self.truth.y_m + part * dy
        if part == 1.0:
            self._begin(Phase.HOVER)

    def _begin(self, phase: Phase) -> None:
        self.phase, self._timer_s = phase, 0.0

    def _event(self, name: str, text: str) -> None:
        seq = next(self._events_seq)
        self._events.append(EventReport(1, "s", seq, self._now_ns, EventLevel.INFO, name, text))

    def ordered_elsewhere(self, command: str) -> None:
        """Somebody at another station commands it."""
        self._event("command", command)

    @property
    def _possible(self) -> tuple[CommandKind, ...]:
        if self.phase is Phase.PREFLIGHT:
            return (CommandKind.PLAN,) if self.obstacles else (CommandKind.PLAN, CommandKind.START)
        if self.phase is Phase.LAND:
            return (CommandKind.LAND, CommandKind.STOP)
        back = not self.plan
        return (
            tuple(kind for kind in _IN_AIR if not (back and kind is CommandKind.GOTO)) if self.flies else ()
        )

    @property
    def status(self) -> StatusReport:
        """What it tells now."""
        armed = self.flies
        x_m, y_m = self._pad if self._begins_in_air else (self.truth.x_m, self.truth.y_m)
        at = Position(x_m, y_m, 0.0, 0.0, 1.0, *self.sigmas_m) if armed and self.sees else None
        landed = "in_air" if armed else "on_ground"
        vehicle = VehicleReport(
            "GUIDED", armed, True, landed, 0.0, 0.0, self.battery_frac, 12.0, 0.0, 0.0, ""
        )
        return StatusReport(
            version=1, session=f"{self.name} {self._session}", seq=next(self._seq), stamp_ns=self._now_ns,
            phase=self.phase, reason="", node="", goal=self.way[0] if self.way else "", nodes_done=0,
            nodes_planned=0, height_m=self.truth.z_m, position=at, lines=(), lines_age_s=0.0, vehicle=vehicle,
            frames=0, frames_dropped=0, fps=30.0, latency_ms={}, link=LinkReport(0, 0, 0, 0, 0),
            way=tuple(self.way), possible=self._possible, plan=self.plan, battery_left_s=self.left_s,
            obstacles=self.obstacles, waits_at=self.waits_at,
            lands_at=self._end if self.knows_docks else None,
        )  # fmt: skip
