"""One drone: the task that keeps its link, tells the hub what it says, attends it, and hands acts on."""

from __future__ import annotations

import asyncio
import logging
import math
from collections import Counter, deque
from collections.abc import Awaitable, Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Protocol, TypeVar

from flightd.adapters.ground_link.client import Address, GroundClient
from flightd.adapters.ground_link.messages.answers import Accepted, PlanAnswer, Planned, Welcome
from flightd.adapters.ground_link.messages.base import Role
from flightd.adapters.ground_link.messages.counts import Counts
from flightd.adapters.ground_link.messages.published import EventReport, StatusReport
from flightd.core.errors import FlightdError, InputError, RunError, TransientError, UnavailableError
from flightd.core.preview import CameraName
from flightd.core.types import CommandKind, Phase
from flightd.ground.bounded import Room, Shared
from flightd.ground.messages import Act, LinkPicture, LinkState, PictureKey

_LOG = logging.getLogger(__name__)
_T = TypeVar("_T")
ATTEND_S = 0.5
_STATE_S = 0.5
_ANSWER_S = 2.0
_AGAIN_S = 0.5
_NO_PICTURE_S = 1.0
_NO_PLAN_S = 5.0
_EVENTS_KEPT = 100
_TRACK_STEP_M = 0.05
_TRACK_KEPT = 4000
MOST_ACTS = 16
"""So many acts may wait for their answer at once; what lands the drone is never turned away."""
_MOST_QUESTIONS = 4
_SILENT_S = 3.0
"""A drone that has told nothing for so long is not heard."""
_LANDED_S = 3600.0
"""No drone flies so long after it was heard last."""
_VISITED = "visited"
"""The event of a node that was visited: its name is the text."""
_BEGINS = f"{Phase.PREFLIGHT} -> {Phase.ARMING}:"
"""The text of the event of a flight that begins; one that goes on with another battery does not."""
_URGENT = frozenset({CommandKind.STOP, CommandKind.LAND})


class Pages(Protocol):
    """Everybody who looks on."""

    @property
    def is_attended(self) -> bool:
        """Some page is open whose person may fly."""
        ...

    def tell(self, drone: str, topic: str, value: Any) -> None:
        """Tell every page a topic's newest value, and those that are opened later."""
        ...

    def keep(self, drone: str, topic: str, value: Any) -> None:
        """Tell it only to the pages that are opened from now on."""
        ...

    def show(self, key: PictureKey, picture: LinkPicture) -> None:
        """Show a picture to every page that wants it."""
        ...

    async def wanted(self, key: PictureKey) -> None:
        """Wait until some page has use for a picture of that camera."""
        ...


class DroneLink:
    """`run` keeps connecting until cancelled; meanwhile `act` hands an act to the drone."""

    def __init__(self, name: str, address: Address, pages: Pages) -> None:
        self.name = name
        self._address = address
        self._pages = pages
        self._client: GroundClient | None = None
        self._welcome: Welcome | None = None
        self._session = ""
        self._events: deque[EventReport] = deque(maxlen=_EVENTS_KEPT)
        self._visited: dict[str, None] = {}
        self._track: deque[tuple[float, float]] = deque(maxlen=_TRACK_KEPT)
        self._heard_at_s: float | None = None
        self._clock_s = math.inf
        """The drone's clock behind ours, with the quickest status so far."""
        self._seq: dict[type, int] = {}
        self._missed: Counter[type] = Counter()
        self._round_trip_ms: float | None = None
        self._attends = False
        self._status: StatusReport | None = None
        self._armed = False
        self._trouble = "connecting"
        self._acting = 0
        self._questions = Room(_MOST_QUESTIONS, f"{name} is looked after already")
        self._inventory = Shared(self._asked_inventory)
        self.on_plan: Callable[[PlanAnswer], Awaitable[None]] | None = None
        """Hears what is left of the drone's plan, whenever that changes."""
        self.on_person: Callable[[], None] = lambda: None
        """Hears that a person commands the drone, before it does."""
        self.attends_run = False
        """The station attends by itself: a flight of its schedules is due, or on."""
        self.by_person_at_s = -math.inf
        """When a person of this station commanded the drone last, by the loop's clock."""
        self._plan_changed = asyncio.Event()
        self._plan_seen: tuple[object, ...] = ()

    @property
    def flies(self) -> bool:
        """Its motors were armed when it was heard last; silence is no landing, but for an hour of it."""
        now_s = asyncio.get_running_loop().time()
        return self._armed and self._heard_at_s is not None and now_s - self._heard_at_s < _LANDED_S

    @property
    def welcome(self) -> Welcome | None:
        """Who answers there, what the station may do, and the map; None before it was reached."""
        return self._welcome

    @property
    def heard(self) -> StatusReport | None:
        """Its newest status; None where it is not heard now."""
        at_s, now_s = self._heard_at_s, asyncio.get_running_loop().time()
        is_heard = self._client is not None and at_s is not None and now_s - at_s < _SILENT_S
        return self._status if is_heard else None

    async def run(self) -> None:
        """Connect, and again after whatever went wrong."""
        while True:
            try:
                await self._connected()
            except FlightdError as err:
                self._trouble = str(err)
            except ExceptionGroup as group:
                known, unknown = group.split(FlightdError)
                if unknown is not None:  # an error of ours must not end the station for the other drones
                    _LOG.error("%s: the link failed", self.name, exc_info=unknown)
                self._trouble = "the link failed" if known is None else str(known.exceptions[0])
            self._client, self._attends, self._round_trip_ms = None, False, None
            self._tell_state()
            await asyncio.sleep(_AGAIN_S)

    async def act(self, act: Act, *, by_person: bool = True, counts: Counts = None) -> Accepted:
        """Hand an act to the drone, a goto with what is counted at its node; its answer.  As
        `GroundClient` raises; RunError where too many wait."""
        if by_person:
            self._note_person()
        with self._one_more_act(urgent=act.command in _URGENT) as client:
            if act.command in _URGENT:  # whatever flies there now
                return await client.order(act.command, act.node, act.id, session="", seen_ns=0)
            session, seen_ns = act.session or None, act.seen_ns or None
            return await client.order(
                act.command,
                act.node,
                act.id,
                session=session,
                seen_ns=seen_ns,
                plan=act.plan,
                waits=act.waits,
                lands=act.lands,
                counts=counts,
            )

    async def plan_flight(
        self,
        nodes: Sequence[str],
        levels: Sequence[int],
        order_id: str = "",
        *,
        best_order: bool = False,
        dry: bool = False,
        session: str = "",
        seen_ns: int = 0,
        waits: bool = False,
        by_person: bool = True,
        counts: Counts = None,
    ) -> Planned:
        """Hand the drone the nodes of its next flight, or ask what that would be.  As `act` raises."""
        if by_person and not dry:
            self._note_person()
        with self._one_more_act() as client:
            return await client.plan_flight(
                nodes,
                levels,
                order_id,
                best_order=best_order,
                dry=dry,
                session=session or None,
                seen_ns=seen_ns or None,
                waits=waits,
                counts=counts,
            )

    @contextmanager
    def _one_more_act(self, *, urgent: bool = False) -> Iterator[GroundClient]:
        """Who hands it over, while it waits for its answer."""
        client = self._reached
        if self._acting >= MOST_ACTS and not urgent:
            raise RunError(f"{MOST_ACTS} acts wait for an answer of {self.name} already")
        self._acting += 1
        try:
            yield client
        finally:
            self._acting -= 1

    @property
    def _reached(self) -> GroundClient:
        if self._client is None:
            raise UnavailableError(f"{self.name} cannot be reached: {self._trouble}")
        return self._client

    def _note_person(self) -> None:
        self.by_person_at_s = asyncio.get_running_loop().time()
        self.on_person()

    async def ask(self, question: Callable[[GroundClient], Awaitable[_T]]) -> _T:
        """What the drone answers to a question of who looks after it.  As `GroundClient` raises;
        UnavailableError where it cannot be reached, or too many ask at once."""
        client = self._reached
        with self._questions.taken():
            return await question(client)

    async def inventory(self) -> tuple[dict[str, str], ...]:
        """What it has counted on this flight, place by place: asked once for all that want to know now.
        As `GroundClient` raises."""
        return await self._inventory.answer()

    async def _asked_inventory(self) -> tuple[dict[str, str], ...]:
        return await self._reached.inventory()

    async def _connected(self) -> None:
        """Everything on one connection, until something of it fails."""
        async with GroundClient(self._address, "flightd ground", _ANSWER_S) as client:
            welcome = await self._greet(client)
            self._client = client
            async with asyncio.TaskGroup() as tasks:
                tasks.create_task(self._listen(client), name=f"{self.name} listens")
                tasks.create_task(self._attend(client), name=f"{self.name} attends")
                tasks.create_task(self._tell_states(), name=f"{self.name} state")
                tasks.create_task(self._follow_plan(client), name=f"{self.name} plan")
                for camera in welcome.cameras if welcome.picture_fps > 0 else ():
                    name = f"{self.name} {camera} pictures"
                    tasks.create_task(self._look(client, camera), name=name)

    async def _greet(self, client: GroundClient) -> Welcome:
        welcome = await client.hello()
        self._welcome, self._trouble = welcome, ""
        self._events.clear()
        self._events.extend(welcome.events)
        if welcome.session != self._session:
            self._session = welcome.session
            self._track.clear()
            self._visited.clear()
            self._seq.clear()
            self._clock_s = math.inf
        self._pages.tell(
            self.name,
            "welcome",
            {
                "flightd": welcome.flightd,
                "session": welcome.session,
                "role": welcome.role,
                "client": welcome.client,
                "cameras": welcome.cameras if welcome.picture_fps > 0 else (),
                "floor": welcome.floor,
                "optics": welcome.optics,
            },
        )
        self._pages.tell(self.name, "events", tuple(self._events))
        self._pages.tell(self.name, "track", tuple(self._track))
        self._note_visits(welcome.events)
        return welcome

    async def _listen(self, client: GroundClient) -> None:
        async for message in client.published():
            if message.session != client.session:
                raise TransientError("flightd was started anew: another flight, perhaps another map")
            self._missed[type(message)] += max(message.seq - self._seq.get(type(message), message.seq) - 1, 0)
            self._seq[type(message)] = message.seq
            if isinstance(message, EventReport):
                self._take_event(message)
            else:
                self._take_status(message)

    def _take_event(self, event: EventReport) -> None:
        if any(known.seq == event.seq for known in self._events):
            return  # told with the welcome already
        self._events.append(event)
        self._note_visits([event])
        self._pages.tell(self.name, "events", tuple(self._events))

    def _note_visits(self, events: Iterable[EventReport]) -> None:
        """Of the newest flight: a drone may fly several while its daemon runs."""
        for event in events:
            if event.name == "phase" and event.text.startswith(_BEGINS):
                self._visited.clear()
            elif event.name == _VISITED:
                self._visited[event.text] = None
        self._pages.tell(self.name, "visited", tuple(self._visited))

    def _take_status(self, report: StatusReport) -> None:
        now_s = asyncio.get_running_loop().time()
        silent = self._heard_at_s is None or now_s - self._heard_at_s > _STATE_S
        self._heard_at_s, self._status = now_s, report
        self._clock_s = min(self._clock_s, now_s - report.stamp_ns * 1e-9)
        if report.vehicle is not None:  # a daemon that was started anew in flight has not heard it yet
            self._armed = report.vehicle.armed
        at = report.position
        if at is not None and (
            not self._track or math.dist(self._track[-1], (at.x_m, at.y_m)) > _TRACK_STEP_M
        ):
            self._track.append((round(at.x_m, 3), round(at.y_m, 3)))
            self._pages.keep(self.name, "track", tuple(self._track))
        self._pages.tell(self.name, "status", report)
        seen = (report.session, report.plan, report.nodes_done, report.nodes_planned, report.phase)
        if seen != self._plan_seen:
            self._plan_seen = seen
            self._plan_changed.set()
        if silent:
            self._tell_state()

    async def _follow_plan(self, client: GroundClient) -> None:
        """Ask for the plan whenever it, or what is left of it, may be another."""
        self._plan_changed.set()
        while True:
            await self._plan_changed.wait()
            self._plan_changed.clear()
            try:
                plan = await client.plan()
            except (RunError, InputError):  # an older drone knows no plans
                await asyncio.sleep(_NO_PLAN_S)
                continue
            except UnavailableError:
                await asyncio.sleep(_AGAIN_S)
                self._plan_changed.set()
                continue
            self._pages.tell(self.name, "plan", plan)
            if self.on_plan is not None:
                await self.on_plan(plan)

    async def _attend(self, client: GroundClient) -> None:
        """Attend while the page of somebody is open who may fly, or a run of a schedule is on; else only
        measure the way.  A run that did not come to fly is left again, and nobody is missed.  With a viewer's
        key it cannot attend."""
        loop = asyncio.get_running_loop()
        for_run = False
        while True:
            began_s = loop.time()
            try:
                may = self._welcome is not None and self._welcome.role is Role.OPERATOR
                by_page = self._pages.is_attended
                if may and (by_page or self.attends_run):
                    await client.attend()
                    self._attends, for_run = True, not by_page
                elif for_run and not self.flies:
                    await client.attend(leave=True)
                    self._attends = for_run = False
                else:
                    self._attends = False
                    await client.status()
                self._round_trip_ms, self._trouble = (loop.time() - began_s) * 1e3, ""
            except UnavailableError as err:
                self._round_trip_ms, self._attends, self._trouble = None, False, str(err)
            except RunError as err:
                self._attends, self._trouble = False, str(err)
            await asyncio.sleep(max(ATTEND_S - (loop.time() - began_s), 0.05))

    async def _tell_states(self) -> None:
        while True:
            self._tell_state()
            await asyncio.sleep(_STATE_S)

    def _tell_state(self) -> None:
        now_s = asyncio.get_running_loop().time()
        trip_ms = self._round_trip_ms
        state = LinkState(
            connected=self._client is not None and not self._trouble,
            heard_s=None if self._heard_at_s is None else round(now_s - self._heard_at_s, 2),
            round_trip_ms=None if trip_ms is None else round(trip_ms, 1),
            missed=self._missed.total(),
            attends=self._attends,
            flies=self.flies,
            trouble=self._trouble,
        )
        self._pages.tell(self.name, "link", state)

    async def _look(self, client: GroundClient, camera: CameraName) -> None:
        """Fetch pictures as long as some page has use for them."""
        key, loop = PictureKey(self.name, camera), asyncio.get_running_loop()
        trouble = f"{camera} trouble"
        self._pages.tell(self.name, trouble, "")
        failed = False
        while True:
            await self._pages.wanted(key)
            try:
                answer, jpeg = await client.picture(camera)
            except FlightdError as err:
                failed = True
                self._pages.tell(self.name, trouble, str(err))
                await asyncio.sleep(_NO_PICTURE_S)
                continue
            if failed:
                failed = False
                self._pages.tell(self.name, trouble, "")
            behind_s = loop.time() - answer.stamp_ns * 1e-9
            age_ms = round(max(behind_s - self._clock_s, 0.0) * 1e3, 1) if self._seq else None
            self._pages.show(key, LinkPicture(answer, age_ms, jpeg))
