"""A night shift with a drone on paper, over a file, with a clock that a test sets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, date, datetime
from itertools import count
from pathlib import Path

import msgspec

from flightd.adapters.ground_link.floor_status import floor_status
from flightd.adapters.ground_link.messages.answers import Accepted, Planned, Welcome
from flightd.adapters.ground_link.messages.base import Role
from flightd.adapters.ground_link.messages.published import StatusReport
from flightd.core.errors import InputError, RunError, UnavailableError
from flightd.core.types import CommandKind, Phase
from flightd.fleet.traffic.valued_work import PlaceFacts
from flightd.ground.access.roles import Identity
from flightd.ground.ground_store.store import GroundStore
from flightd.ground.messages import Act
from flightd.ground.missions.mission_book import MissionBook
from flightd.ground.schedules.kept import CountAisles, Kept
from flightd.ground.schedules.night_shift import NightShift, StationClock
from flightd.ground.schedules.schedule_book import Run, RunState, ScheduleBook
from flightd.site.site_file import load_site
from tests.rigs.event_loops import real
from tests.unit.ground.request_handler_rig import report

SITE = load_site(Path(__file__).parents[3] / "configs" / "site-demo.toml")
FLOOR = floor_status(replace(SITE, unattended_start=True))
READY = msgspec.structs.replace(
    report(Phase.PREFLIGHT), session="s-0", possible=(CommandKind.PLAN, CommandKind.START)
)
WELCOME = Welcome(
    request="",
    flightd="",
    session="s-0",
    role=Role.OPERATOR,
    client="",
    picture_fps=0.0,
    floor=FLOOR,
    events=(),
)
NIGHTLY = Kept(
    site="demo",
    name="Nightly",
    drone="demo",
    count=CountAisles(("A",)),
    at="22:00",
    zone="UTC",
    late_minutes=90,
)
T0 = datetime(2026, 3, 1, 12, tzinfo=UTC)


class Drone:
    """Stands there and does each order once, by its id; its answers may be lost, it may refuse, and its
    flightd may be started anew."""

    def __init__(self, book: ScheduleBook) -> None:
        self.name = "demo"
        self.attends_run = False
        self.by_person_at_s = -math.inf
        self.mode = "well"
        self.starts: list[date] = []
        self._book = book
        self._sessions = count(1)
        self._done: set[str] = set()
        self.welcome: Welcome | None = WELCOME
        self.status: StatusReport = READY

    @property
    def heard(self) -> StatusReport | None:
        return None if self.mode == "unheard" else self.status

    def begin_anew(self) -> None:
        session = f"s-{next(self._sessions)}"
        self._done.clear()
        self.welcome = msgspec.structs.replace(WELCOME, session=session)
        self.status = msgspec.structs.replace(READY, session=session)

    async def plan_flight(
        self, nodes: Sequence[str], levels: Sequence[int], order_id: str = "", *, best_order: bool = False,
        dry: bool = False, session: str = "", seen_ns: int = 0, by_person: bool = True,
    ) -> Planned:  # fmt: skip
        assert (best_order, dry, by_person) == (False, False, False)
        del seen_ns
        if self._is_new(order_id, session):
            self.status = msgspec.structs.replace(self.status, plan=order_id)
        self._answer()
        return Planned(
            request="", nodes=tuple(nodes), levels=tuple(levels), way=(), places=0, way_m=0.0, seconds=0.0,
            batteries=1, charge=1.0, battery_s=1.0,
        )  # fmt: skip

    async def act(self, act: Act, *, by_person: bool = True) -> Accepted:
        assert (act.command, by_person) == (CommandKind.START, False)
        if self._is_new(act.id, act.session):
            runs = self._book.runs("schedule-1")
            (run,) = [one for one in runs if (one.plan, one.state) == (act.plan, RunState.ORDERED)]
            self.starts.append(run.day)
            self.status = msgspec.structs.replace(self.status, phase=Phase.FOLLOW)
        self._answer()
        return Accepted(request="")

    def _is_new(self, order_id: str, session: str) -> bool:
        if self.mode == "lost before":
            raise UnavailableError("no answer")
        if self.mode in {"anew at its start", "anew"} and (self.mode == "anew" or order_id.endswith("-go")):
            self.begin_anew()
        if session != self.status.session:
            raise RunError("refused: flightd was started anew")
        if order_id in self._done:
            return False
        if self.mode == "refuses":
            raise RunError("refused: not now")
        self._done.add(order_id)
        return True

    def _answer(self) -> None:
        if self.mode == "lost after":
            raise UnavailableError("no answer")


class Facts:
    """What is known of places; without any there is no ground store."""

    def __init__(self, *places: PlaceFacts) -> None:
        self._places = places
        self.asked = 0

    async def of(self, site: str) -> Sequence[PlaceFacts]:
        assert site == "demo"
        self.asked += 1
        if not self._places:
            raise InputError("there is no ground store")
        return self._places


class Station:
    """A night shift over a file, with a clock that a test sets."""

    def __init__(
        self,
        folder: Path,
        kept: Kept = NIGHTLY,
        rest_s: float = 30.0,
        facts: Facts | None = None,
        store: GroundStore | None = None,
    ) -> None:
        self.store = store
        self.rest_s = rest_s
        self.facts = facts or Facts()
        self.folder = folder
        self.now = T0
        self.book = ScheduleBook(folder)
        self.drone = Drone(self.book)
        self.lines: list[tuple[str, str]] = []
        self.book.keep("schedule-1", kept, self._ns())
        self.reboot()

    def _ns(self) -> int:
        return int(self.now.timestamp()) * 10**9

    def write_down(self, who: Identity | None, address: str, act: str, target: str, **outcome: str) -> None:
        del who, address, act, target
        self.lines.append((outcome["outcome"], outcome["text"]))

    def keep(self, kept: Kept, schedule: str = "schedule-1") -> None:
        """A schedule, as of now."""
        self.book.keep(schedule, kept, self._ns())

    def reboot(self) -> None:
        clock = StationClock(self._ns, rest_s=self.rest_s)
        drones, missions = {"demo": self.drone}, MissionBook(self.folder)
        self._shift = NightShift(self.book, missions, self.store, self.facts, drones, self, clock=clock)

    def at(self, text: str) -> Station:
        self.now = datetime.fromisoformat(f"2026-03-{text}").replace(tzinfo=UTC)
        return self

    def attends(self) -> bool:
        return self.drone.attends_run

    def look(self) -> Run | None:
        """Look at the schedules once; the newest run."""
        real(self._shift.step())
        runs = self.book.runs("schedule-1")
        return runs[0] if runs else None
