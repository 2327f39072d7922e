"""A drone as a vehicle of somebody else's fleet, in virtual time: what it tells, and what it is asked."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

from flightd.adapters.ground_link.floor_status import floor_status
from flightd.adapters.ground_link.messages.published import EventReport, LinkReport, StatusReport
from flightd.core.errors import FlightdError, UnavailableError
from flightd.core.types import CommandKind, EventLevel, Phase
from flightd.fleet.vda5050.codec import Version
from flightd.fleet.vda5050.state import State
from flightd.fleet.vehicle.drone_factsheet import Measures
from flightd.ground.messages import LinkState
from flightd.ground.mqtt.managed_drone import ManagedDrone, OrderRules
from flightd.site.site_file import load_site

SITE = load_site(Path(__file__).parents[3] / "configs" / "site-demo.toml")
IN_AIR = (CommandKind.PAUSE, CommandKind.RESUME, CommandKind.GOTO, CommandKind.HOME)


def status(phase: Phase, way: str = "", **more: Any) -> StatusReport:
    """A drone in this phase, with this way ahead."""
    nodes = tuple(way.split())
    waits = phase is Phase.PREFLIGHT
    possible = (CommandKind.PLAN, CommandKind.START) if waits else IN_AIR
    return StatusReport(
        version=1, session="s", phase=phase, reason="", node="", goal=(nodes or ("",))[0],
        nodes_done=0, nodes_planned=0, height_m=None, lines=(), lines_age_s=None,
        frames=0, frames_dropped=0, fps=0.0, latency_ms={}, link=LinkReport(0, 0, 0, 0, 0), way=nodes,
        **{"seq": 1, "stamp_ns": 1, "possible": possible, "plan": "p", "position": None,
           "vehicle": None, **more},
    )  # fmt: skip


class Link:
    """A drone's link that takes everything, and notes it."""

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.counts: list[Any] = []
        self.levels: tuple[int, ...] = ()
        self.places = 1
        """Of any plan."""
        self.fails: dict[CommandKind, FlightdError] = {}
        """What is not taken, and how that shows."""
        self.rows: tuple[dict[str, str], ...] = ()
        self.untold = 0
        """So often it does not tell what it counted."""

    async def plan_flight(
        self,
        asked: tuple[str, ...],
        levels: tuple[int, ...] = (),
        *_: Any,
        dry: bool = False,
        waits: bool = False,
        counts: Any = None,
        **__: Any,
    ) -> Any:
        self.counts.append(counts)
        self.levels = self.levels if dry else levels
        self.asked += [] if dry else [f"plan {' '.join(asked)}{', to wait there' * waits}"]
        told = {
            "batteries": 1, "way": ("A1", "A2"), "places": self.places, "sweeps": (), "seconds": 9.0,
            "way_m": 9.0, "nodes": asked, "levels": (),
        }  # fmt: skip
        return type("Planned", (), told)

    async def act(self, act: Any, *, counts: Any = None, **_: Any) -> None:
        self.asked.append(act.command.value)
        if act.command in self.fails:
            raise self.fails[act.command]
        self.counts.append(counts)

    async def inventory(self) -> tuple[dict[str, str], ...]:
        if self.untold:
            self.untold -= 1
            raise UnavailableError("no answer")
        return self.rows


class Managed:
    """It waits on its pad at A1; `tell` has it be otherwise, `heard` or not."""

    def __init__(self, version: Version = Version.V3_0) -> None:
        self.written: list[tuple[str, str, str, str]] = []
        rules = OrderRules(600.0, lambda *line: self.written.append(line))
        self.drone = ManagedDrone("demo", version, Measures(3, 1, 1, 1, 1, 1), rules)
        self.link = Link()
        self._seq = 0

    @contextlib.asynccontextmanager
    async def flown(self) -> AsyncIterator[None]:
        """Its manager flies it meanwhile."""
        running = asyncio.create_task(self.drone.run(self.link))  # type: ignore[arg-type]
        try:
            self.heard()
            await self.begins("s")
            yield
        finally:
            running.cancel()
            await asyncio.wait([running])

    async def begins(self, session: str) -> None:
        """Its daemon does, and is asked where it stands; what it tells is counted from the beginning."""
        self._seq = 0
        self.drone.tell("welcome", {"session": session, "role": "operator", "floor": floor_status(SITE)})
        self.drone.tell("events", ())
        self.tell(Phase.PREFLIGHT)
        await asyncio.sleep(3.0)

    def heard(self, heard: bool = True) -> None:
        self.drone.tell("link", LinkState(heard, 0.0 if heard else 10.0, 1.0, 0, False, False, ""))

    def tell(self, phase: Phase, way: str = "", **more: Any) -> None:
        """As its status says, flying the newest plan that it was given."""
        self._seq += 100
        plan = ("", *self.drone.kept().plans)[-1]
        told = {"waits_at": "", "plan": plan, "seq": self._seq, "stamp_ns": self._seq * 10**7, **more}
        self.drone.tell("status", status(phase, way, **told))

    def happens(self, name: str, text: str, level: EventLevel = EventLevel.INFO) -> None:
        """It tells of an event."""
        self._seq += 1
        event = EventReport(1, "s", self._seq, self._seq * 10**7, level, name, text)
        self.drone.tell("events", (event,))

    @property
    def state(self) -> State:
        """As it is told its manager."""
        found = self.drone.vehicle.state(self.drone.now())
        assert found is not None
        return found

    @property
    def errors(self) -> list[str]:
        """Their types."""
        return [one.error_type for one in self.state.errors]

    @property
    def actions(self) -> dict[str, str]:
        """How far each is."""
        told = (*self.state.action_states, *self.state.instant_action_states)
        return {one.action_id: one.action_status.value for one in told}
