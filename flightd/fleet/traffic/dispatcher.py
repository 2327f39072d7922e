"""Keeps a fleet at work: gives tours that fit the batteries, hears what drones report, and answers with
what each may fly next.  Pure: a step from reports to commands."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from flightd.fleet.traffic.closures import Closure
from flightd.fleet.traffic.distances import Distances
from flightd.fleet.traffic.dock_queue import DockQueue, Standing
from flightd.fleet.traffic.docks import Dock
from flightd.fleet.traffic.endurance import Endurance
from flightd.fleet.traffic.motions import Act
from flightd.fleet.traffic.open_ways import OpenWays
from flightd.fleet.traffic.plan import Action, Stop
from flightd.fleet.traffic.reach import BEYOND, NO_WAY, TRIES, Reach
from flightd.fleet.traffic.traffic_control import TrafficControl
from flightd.fleet.traffic.work_queue import TourTimes, WorkQueue

_DOUBT_LASTS_MS: Final = 20_000
SILENT_MS: Final = 90_000
"""Who is not heard for so long may not come back."""
_PATIENCE_MS: Final = 45_000
"""Who waits so long for others is planned anew."""
_RETRY_MS: Final = 15_000
_SPARE_FRAC: Final = 0.25
"""Of a tour's time: kept for delays."""
_SPARE_MS: Final = 45_000
_SLOWER: Final = 1.15
"""What a flight takes beside what was planned, at most on average."""
_WITH_SPARE: Final = _SLOWER * (1 + _SPARE_FRAC)


@dataclass(frozen=True, slots=True)
class DroneReport:
    """What a drone tells: how many actions of its life are done, its charge, by how much its position is
    doubted, and whether it is unable to fly on; `not_counted` has the nodes at which a count failed, and
    why.  `charging`: whether it is charged where it stands, None where it does not say; `level`: how full
    its battery is for a dock, where `charge` tells something else; `may_start`: somebody may send it on from
    where it stands."""

    drone: str
    done: int
    charge: float
    doubt_m: float = 0.0
    failed: bool = False
    not_counted: Mapping[str, str] = field(default_factory=dict)
    charging: bool | None = None
    level: float | None = None
    may_start: bool = True


@dataclass(frozen=True, slots=True)
class Commands:
    """`base` is what each drone may fly on beyond what it was told; the `paused` stand where they are."""

    base: Mapping[str, Sequence[Action]]
    paused: frozenset[str]


class Dispatcher:
    """The fleet of one floor.  Where there are `docks`, batteries are filled there alone, up to `full_at`
    (None: as `endurance` says).  With `shares` no drone is given more than its part of what waits, for all
    that could fly now, and a step plans one tour at most: the next one follows soon.  Drones that `keep_home`
    always keep what brings them to their own pads, and are sent to a dock from the air whatever waits."""

    def __init__(
        self,
        control: TrafficControl,
        queue: WorkQueue,
        endurance: Endurance,
        *,
        shares: bool = False,
        docks: Sequence[Dock] = (),
        full_at: float | None = None,
        keep_home: bool = False,
    ) -> None:
        self._shares, self._keep_home = shares, keep_home
        self.control = control
        self.queue = queue
        self._endurance = endurance
        self._distances = Distances(control.net)
        self._open_ways = OpenWays(control)
        full = endurance.starts_at if full_at is None else full_at
        self.docks = DockQueue(control, self._distances, self._open_ways, docks, full, returns=keep_home)
        self._level: dict[str, float] = {}
        self._grounded: set[str] = set()
        self._charging: dict[str, bool | None] = {}
        self._charge: dict[str, float] = {}
        self._tours: dict[str, set[str]] = {}
        self._waits_since_ms: dict[str, int] = {}
        self._next_try_ms: dict[str, int] = {}
        self._avoided: set[str] = set()
        self._heard_ms: dict[str, int] = {}
        self._held: set[str] = set()
        self._comes_back: set[str] = set()
        """Those that were taken up in the air, and have told nothing since."""
        self._tries: dict[str, int] = {}
        self.closed: dict[str, Closure] = {}
        """What nobody flies, by name."""
        self._refusals: dict[str, int] = {}
        self._reach = Reach()
        queue.retry(queue.not_done_for(BEYOND))
        self.holding = 0

    def step(self, now_ms: int, reports: Iterable[DroneReport]) -> Commands:
        """Take what drones reported since the last step, those without a link left out."""
        for report in reports:
            self._hear(report, now_ms)
        for drone in self.control.drones:
            self._watch(drone, now_ms)
        if self._held:
            self._unhold(now_ms)
        if now_ms >= self._next_try_ms.get("urgent", 0):
            self._next_try_ms["urgent"] = now_ms + _RETRY_MS
            self._bring_home(now_ms)
        self._fly_on(now_ms)
        self._give_tours(now_ms)
        self._fill_batteries(now_ms)
        return Commands(self.control.release(now_ms, self._comes_home), self.control.paused())

    def close(self, closures: Iterable[Closure], now_ms: int) -> None:
        """Keep these closed, and nothing else."""
        wanted = {closure.name: closure for closure in closures}
        gone = [closure for name, closure in self.closed.items() if wanted.get(name) != closure]
        for closure in gone:
            del self.closed[closure.name]
            self.control.open(closure.name)
            self._free({*closure.nodes, *self.queue.not_done_for(NO_WAY)})
        new = [closure for name, closure in wanted.items() if name not in self.closed]
        for closure in new:
            self.closed[closure.name] = closure
            lanes = self.control.lanes.lanes_between(closure.ways)
            self._held |= set(self.control.close(closure.name, lanes, now_ms))
        if new:
            self._settle_tours()

    def withdraw(
        self,
        drone: str,
        place: int,
        air: Collection[int],
        doubt_m: float,
        now_ms: int,
        refused: str = "",
    ) -> None:
        """A drone is flown by somebody else, near `place` and anywhere in `air`, or so far beside:
        what it had to count is given to others, who fly round it (`TrafficControl.roam`).  Again whenever its
        air has changed.  `refused` is why it did not fly on; what it was on its way to count is given up for
        that where nobody else may do it, or several have tried."""
        before, next_node = self._near(drone), self._next_of(drone)
        self._held |= set(self.control.roam(drone, place, air, doubt_m, now_ms))
        self._held.discard(drone)
        self._comes_back.discard(drone)
        self._avoided.discard(drone)
        self._waits_since_ms.pop(drone, None)
        if lost := self._tours.pop(drone, set()):
            self._next_try_ms[drone] = now_ms + _RETRY_MS  # others first
            self.queue.hand_back(lost)
        if refused and next_node in lost:
            self._blame(next_node, drone, refused)
        self._settle_tours()
        self._free(before - self._near(drone))

    def readmit(
        self, drone: str, place: int, pad: int, now_ms: int, holding: Mapping[str, int] | None = None
    ) -> bool:
        """It is the fleet's again, where it stands or hovers, and comes home to `pad`.  False, with nothing
        changed, as long as somebody else is to come there (`TrafficControl.may_enter`)."""
        if not self.control.may_enter(drone, place, holding):
            return False
        freed = self._near(drone)
        self.control.enter(drone, place, ends=(pad,))
        self._heard_ms[drone] = now_ms
        self._charge.pop(drone, None)  # nothing is decided by what it told before
        if not self.docks.flies_on(drone, pad) and place != pad:
            self._comes_back.add(drone)
        self._free(freed)
        return True

    def _next_of(self, drone: str) -> str:
        """The node that it is to count next; empty where there is none."""
        course = self.control.drones[drone]
        counts = [action.vertex for action in course.base if action.act is Act.COUNT]
        ahead = [*counts, *(stop.vertex for stop in course.stops)]
        return self.control.lanes.vertices[ahead[0]].node if ahead else ""

    def _blame(self, node: str, drone: str, why: str) -> None:
        tries = self._refusals[node] = self._refusals.get(node, 0) + 1
        if self.queue.work(node).drone or tries >= TRIES:
            self._refusals.pop(node)
            self.queue.give_up(node, f"{drone}: {why}")

    def _free(self, nodes: Collection[str]) -> None:
        """Drones may come there again, and by there to what no battery reached."""
        if nodes:
            self._tries.clear()
            self._reach = Reach()
            self.queue.retry(self.queue.not_done_for(BEYOND))
        self.queue.retry(nodes)

    def _hear(self, report: DroneReport, now_ms: int) -> None:
        drone, course = report.drone, self.control.drones[report.drone]
        self._charge[drone], self._charging[drone] = report.charge, report.charging
        self._level[drone] = report.charge if report.level is None else report.level
        (self._grounded.discard if report.may_start else self._grounded.add)(drone)
        self._heard_ms[drone] = now_ms
        if drone in self._avoided and not course.failed:
            counts = [action.vertex for action in course.base if action.act is Act.COUNT]
            self._free(self._near(drone) - {self.control.lanes.vertices[c].node for c in counts})
        vertices = self.control.lanes.vertices
        for vertex in self.control.done(drone, report.done, now_ms):
            node = vertices[vertex].node
            self._tours.get(drone, set()).discard(node)
            if node in report.not_counted:
                self.queue.give_up(node, f"{drone}: {report.not_counted[node]}")
            else:
                self.queue.finish(node)
        if course.failed:
            return
        self.control.doubt(drone, report.doubt_m, now_ms)
        if report.doubt_m <= 0.0:
            self._avoided.discard(drone)
        if report.failed:
            air = [course.place, *(action.resource for action in course.base[:1])]
            self._held |= set(self.control.fail(drone, now_ms, air))
            self._held.discard(drone)
            self._settle_tours()
            self._hand_back_near(drone, f"{drone} failed there")

    def _hand_back_near(self, drone: str, reason: str) -> None:
        """What nobody counts on account of a drone: what lies near it, and what it was about to count."""
        own = self._tours.pop(drone, set())
        near = self._near(drone)
        self.queue.hand_back([*own, *(node for node in self.queue.open if node in near)], reason)

    def _near(self, drone: str) -> set[str]:
        """The nodes over which nobody flies on account of a drone that failed."""
        lanes = self.control.lanes
        air = self.control.avoided(drone)
        return {node for node, column in lanes.column_of.items() if column in air}

    def _settle_tours(self) -> None:
        """Hand back what drones do not visit any more."""
        lanes = self.control.lanes
        for drone, nodes in list(self._tours.items()):
            course = self.control.drones[drone]
            counts = (action.vertex for action in course.base if action.act is Act.COUNT)
            visits = (*(stop.vertex for stop in course.stops), *counts)
            kept = {lanes.vertices[vertex].node for vertex in visits}
            lost = nodes - kept
            if lost:
                self.queue.hand_back(lost)
                self._tours[drone] = nodes & kept

    def held_back(self) -> dict[str, str]:
        """What waits for something to be opened: where nobody flies, or behind that for every drone; and
        why."""
        if not self.closed:
            return {}
        behind = set(self.queue.open).intersection(*map(self._behind_closed, self.control.drones))
        whys = {node: one.why for one in self.closed.values() for node in one.nodes}
        return {node: whys.get(node, NO_WAY) for node in self.queue.open if node in behind or node in whys}

    def _behind_closed(self, drone: str) -> set[str]:
        """The nodes that wait, and from which this drone would not come home."""
        if not self.closed:
            return set()
        lanes, leads_home = self.control.lanes, self.control.closed.leads_to(self.docks.home(drone))
        return {node for node in self.queue.open if lanes.over(node) not in leads_home}

    def _closed_to(self, drone: str) -> set[str]:
        """The nodes that wait and that it is not to visit now, for what people closed."""
        return self._behind_closed(drone).union(*(one.nodes for one in self.closed.values()))

    def _watch(self, drone: str, now_ms: int) -> None:
        """Home in time, round who is in doubt for long, another way for who waits for long."""
        course = self.control.drones[drone]
        if course.failed:
            return
        if course.doubt_m > 0.0:
            if drone not in self._avoided and now_ms - course.doubt_since_ms >= _DOUBT_LASTS_MS:
                self._avoided.add(drone)
                self._held |= set(self.control.avoid(drone, now_ms))
                self._settle_tours()
            return
        silent_ms = now_ms - self._heard_ms.setdefault(drone, now_ms)
        if silent_ms >= SILENT_MS and course.ahead and drone not in self._avoided:
            self._avoided.add(drone)
            course.stops = ()
            self._held |= {*self.control.avoid(drone, now_ms), *self.control.replan([drone], now_ms)}
            self._settle_tours()
            self._hand_back_near(drone, f"{drone} is silent there")
            return
        if course.ahead and course.stops and self._is_short(drone):
            course.stops = ()
            self._replanned([drone], now_ms)
        if drone in self._charge:
            spared_ms = self._endurance.left_ms(self._charge[drone]) - _SPARE_MS
            self.docks.turn_back(drone, int(spared_ms / _SLOWER), now_ms)
        if course.base or not self.control.waits(drone):
            self._waits_since_ms.pop(drone, None)
        elif now_ms - self._waits_since_ms.setdefault(drone, now_ms) >= _PATIENCE_MS:
            self._waits_since_ms.pop(drone)
            self._held |= set(self.control.overtake(self.control.waits(drone), now_ms))
            self._settle_tours()

    def _is_short(self, drone: str) -> bool:
        """Whether it has to leave out what it has left to count to be home with its reserve."""
        course = self.control.drones[drone]
        left_ms = self._left_ms(drone)
        if self.control.lanes.vertices[course.place].pad is not None:
            return False
        base_ms = sum(action.duration_ms for action in course.base)
        home_ms = self._open_ways.ms(drone, course.base_end, course.ends)
        return left_ms < _SLOWER * (base_ms + home_ms) * (1 + _SPARE_FRAC) + _SPARE_MS

    def _bring_home(self, now_ms: int) -> None:
        """Let the drones whose way home, with all that they will wait for, leaves little of the battery go
        before the others."""
        urgent = False
        flying: list[str] = []
        for drone, actions in self.control.projected(now_ms).items():
            if actions:
                flying.append(drone)
                left_ms = self._left_ms(drone)
                in_air = self.control.lanes.vertices[self.control.drones[drone].place].pad is None
                short = left_ms < _SLOWER * (actions[-1].end_ms - now_ms) + _SPARE_MS
                if in_air and short and self.control.drones[drone].stops:
                    self.control.drones[drone].stops = ()
                    urgent = True
                urgent |= in_air and short and bool(self.control.waits(drone))
        if urgent:
            self._replanned(flying, now_ms)

    def _comes_home(self, drone: str, vertex: int, after_ms: int) -> bool:
        """Whether a drone may start, and its battery brings it home from the end of a base; who has nothing
        left to count goes on, home or to a dock (`DockQueue.turn_back`)."""
        course = self.control.drones[drone]
        if not course.stops:
            return True
        if drone in self._grounded:
            return False
        home_ms = self._open_ways.ms(drone, vertex, course.ends)
        return _SLOWER * (after_ms + home_ms) <= self._left_ms(drone)

    def _left_ms(self, drone: str) -> int:
        """In the air, down to the reserve and the way to a dock."""
        keep_ms = self.docks.keep_ms(drone)
        spare_ms = int(_WITH_SPARE * keep_ms) + _SPARE_MS if keep_ms else 0
        return self._endurance.left_ms(self._charge.get(drone, 1.0)) - spare_ms

    def _budget_ms(self, drone: str) -> int:
        """What a tour may take by the shortest ways."""
        return int(self._left_ms(drone) / _WITH_SPARE)

    def _fill_batteries(self, now_ms: int) -> None:
        """As long as there is something to count with them, on the ground at least."""
        works = bool(self.queue.ready or self.queue.given)
        if not self.docks.are_there or not (works or self._keep_home):
            return
        vertices, holders = self.control.lanes.vertices, self.docks.holders.values()
        known: dict[str, Standing] = {}
        left_ms: dict[str, int] = {}
        for drone, course in self.control.drones.items():
            if (
                drone in self._charge
                and not course.failed
                and course.doubt_m <= 0.0
                and (drone not in self._held or self.control.is_cut_off(drone))
                and (works or drone in holders or vertices[course.place].pad is None)
            ):
                may_start = drone not in self._grounded
                known[drone] = Standing(self._level[drone], self._charging[drone], may_start)
                spared_ms = self._endurance.left_ms(self._charge[drone]) - _SPARE_MS
                left_ms[drone] = int(spared_ms / _WITH_SPARE)
        self.docks.step(now_ms, known, left_ms)

    def _replanned(self, drones: Sequence[str], now_ms: int) -> None:
        for drone in drones:
            self.control.drones[drone].priority = 1.0 - self._charge.get(drone, 1.0)
        self._held |= set(self.control.replan(drones, now_ms))
        self._settle_tours()

    def _unhold(self, now_ms: int) -> None:
        """Try again for those for which there was no way."""
        if now_ms >= self._next_try_ms.get("", 0):
            self._next_try_ms[""] = now_ms + _RETRY_MS
            held, self._held = sorted(self._held), set()
            self.holding += 1
            self._replanned(held, now_ms)

    def _fly_on(self, now_ms: int) -> None:
        """Those that were taken up in the air: with something to do, as far as their batteries last, or
        home."""
        for drone in sorted(self._comes_back & self._charge.keys()):
            if self.control.drones[drone].doubt_m > 0.0:
                continue
            self._tries.clear()  # others may still come back, whose air is closed until then
            self._comes_back.discard(drone)
            may_work = bool(self.queue.ready) and now_ms >= self._next_try_ms.get(drone, 0)
            if not (may_work and self._give_tour(drone, now_ms, len(self.control.drones))):
                self._held |= set(self.control.replan([drone], now_ms))
                self._settle_tours()

    def _give_tours(self, now_ms: int) -> None:
        ready = [drone for drone in self.control.drones if self._may_begin(drone)]
        for i, drone in enumerate(ready):
            self.queue.retry(self._reach.regained(drone, self._charge[drone]))
            if not self.queue.ready or now_ms < self._next_try_ms.get(drone, 0):
                continue
            plans = self.control.replans
            if not self._give_tour(drone, now_ms, len(ready) - i):
                self._next_try_ms[drone] = now_ms + _RETRY_MS
                self._tell_beyond(drone)
            if self._shares and self.control.replans > plans:
                return

    def _may_begin(self, drone: str) -> bool:
        """Whether a drone has nothing to do, and a battery to do something."""
        course = self.control.drones[drone]
        idle = not course.ahead and not course.failed and course.doubt_m <= 0.0
        idle &= drone not in self._held | self._comes_back | self._grounded
        return idle and self._charge.get(drone, 0.0) >= self._endurance.starts_at

    def _give_tour(self, drone: str, now_ms: int, among: int) -> bool:
        """If the work is shared, one drone's part `among` so many."""
        course, home = self.control.drones[drone], self.docks.home(drone)
        left_ms, budget_ms = self._left_ms(drone), self._budget_ms(drone)
        busy = {self.queue.work(node).aisle for node in self.queue.given}
        out, times = self._closed_to(drone), self._times(course.place, home)
        # one alone takes all that fits: the order by value takes longer than the shortest
        shares = self._shares and among > 1
        share_ms = self.queue.takes_ms(times, drone, out) // among if shares else None
        nodes = self.queue.tour(times, budget_ms, busy, share_ms, drone, out)
        ends = (home,)
        while nodes:
            if not self.control.give(drone, [self._stop(node) for node in nodes], ends, now_ms):
                self._refused(nodes)
                nodes = nodes[: len(nodes) // 2]
                continue
            flight_ms = course.ahead[-1].end_ms - course.ahead[0].start_ms
            if flight_ms <= left_ms / (1 + _SPARE_FRAC):
                self.queue.take(drone, nodes)
                for node in nodes:
                    self._reach.forget(node)
                self._tours.setdefault(drone, set()).update(nodes)
                return True
            self.control.give(drone, (), ends, now_ms)
            if len(nodes) == 1:
                self._reach.fails(nodes[0], drone, self._charge[drone])
            nodes = nodes[: len(nodes) * 3 // 4]
        return False

    def _tell_beyond(self, drone: str) -> None:
        """Of what waits and lies too far for every drone, now that this one was ready and went nowhere."""
        home, control = self.docks.home(drone), self.control
        times, budget_ms = self._times(control.drones[drone].place, home), self._budget_ms(drone)
        drones = [each for each, course in control.drones.items() if not course.failed]
        for node in {*self.queue.ready} - self._closed_to(drone):
            work = self.queue.work(node)
            way_ms = times.out_ms(node) + work.dwell_ms + times.home_ms(node)
            if work.drone in {"", drone} and way_ms > budget_ms:
                self._reach.fails(node, drone, self._charge[drone])
            if why := self._reach.why(node, way_ms, drones, work.drone):
                self.queue.hand_back([node], why)

    def _refused(self, nodes: Sequence[str]) -> None:
        """Tell of a node to which there is no way, once that was so several times."""
        if len(nodes) == 1:
            tries = self._tries[nodes[0]] = self._tries.get(nodes[0], 0) + 1
            if tries >= TRIES:
                self.queue.hand_back(nodes, NO_WAY)

    def _stop(self, node: str) -> Stop:
        lanes = self.control.lanes
        return Stop(lanes.over(node), lanes.column_of[node], self.queue.work(node).dwell_ms)

    def _times(self, place: int, pad: int) -> TourTimes:
        lanes, distances, net = self.control.lanes, self._distances, self.control.net
        stop_ms = net.launch_ms + net.stop_ms
        home = distances.to(pad)

        def between_ms(a: str, b: str) -> int:
            return distances.to(lanes.over(b))[lanes.over(a)] + stop_ms

        def out_ms(node: str) -> int:
            return distances.to(lanes.over(node))[place] + 4 * stop_ms

        return TourTimes(out_ms, between_ms, lambda node: home[lanes.over(node)] + 4 * stop_ms)
