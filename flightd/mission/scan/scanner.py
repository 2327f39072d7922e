"""Scanning over a whole flight: which nodes still have locations to count, and which findings are proven.

What is found at a node stays pending until the drone's place is proven: by a location label read there, or
by arriving at `confirm_stops` further nodes without a doubt.  On a doubt nothing more is assigned; where it
ends elsewhere or not at all, or a label contradicts the place, everything pending is withdrawn, so that
nothing is ever booked on a wrong location; its locations are left to count, and its node is due again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from flightd.config.scan import ScanConfig
from flightd.core.count_choice import ALL, CountChoice
from flightd.core.planned_flight import PlannedSweep
from flightd.core.scanning import BodyPose, CodeSet, CountedPlace, Finding, PictureWorth, Place, Settled
from flightd.core.types import Event, EventLevel
from flightd.mission.plan.leg_times import Pace
from flightd.mission.plan.sweep_leg import SweepLeg
from flightd.mission.reasons import NothingRead
from flightd.mission.scan.code_assignment import Assigner, FrontSight, ShelfLook, Sighting
from flightd.mission.scan.code_owners import CodeOwners
from flightd.mission.scan.code_votes import SeenRead
from flightd.mission.scan.label_checks import LabelChecks
from flightd.mission.scan.leg_exposure import LegExposure
from flightd.mission.scan.node_scan import ScanTask
from flightd.mission.scan.passing_time import PassingTime
from flightd.mission.scan.pending_findings import PendingFindings
from flightd.mission.scan.sweep_planner import SweepPlanner
from flightd.mission.scan.sweep_speed import SweepOptics
from flightd.mission.scan.sweep_task import SweepTask
from flightd.mission.scan.sweep_votes import Undecided
from flightd.mission.scan.told_sweeps import told_runs
from flightd.mission.scan.unanswered import Unanswered
from flightd.mission.scan.views import View, ViewPlanner, views_s
from flightd.site.site import Site

_BLIND_NODES = 3
"""Scans in a row without a single picture after which the reader is taken to be dead."""


class Scanner:
    """The scan phase of a flight, for the mission to ask and for pictures to be given to; `highest_m` and
    `aside_per_height` are those of `ViewPlanner`; with `optics` shelves are counted in passing first."""

    def __init__(
        self,
        site: Site,
        sight: FrontSight,
        params: ScanConfig,
        highest_m: float = math.inf,
        aside_per_height: float = 0.35,
        optics: SweepOptics | None = None,
    ) -> None:
        self._params = params
        self._site = site
        self._assigner = Assigner(site, sight, params.expert.least_probability)
        self._planner = ViewPlanner(site, sight, self._assigner, params, highest_m, aside_per_height)
        self._node_of = {location.code: location.node for location in site.locations.values()}
        self._sweeps: SweepPlanner | None = None
        self._aisle_of = {node.id: node.aisle for node in site.nodes.values()}
        self._passing_time: PassingTime | None = None
        if optics is not None:
            self._sweeps = SweepPlanner(site, self._planner, self._assigner, optics)
            self._passing_time = PassingTime(self._sweeps, self._node_of, self._aisle_of)
        self._sweep: SweepTask | None = None
        self._exposure = LegExposure(site, params)
        self._swept: set[str] = set()
        self._passed: dict[str, tuple[SeenRead, ...]] = {}
        self._owners = CodeOwners()
        self._planned = self._wanted = frozenset(site.locations)
        self._done: set[str] = set()
        self._task: ScanTask | None = None
        self._pending = PendingFindings(params.confirm_stops, params.expert.revisits)
        self._unanswered = Unanswered(self._pending)
        self._labels = LabelChecks()
        self._found: list[Finding] = []
        self._events: list[Event] = []
        self._sightings: list[Sighting] = []
        self._begun = self._begun_blind = 0
        self._by_stopping = False
        self.doubted = False
        self.looks = 0
        """How many findings were made, also those that count no more."""

    # What the mission asks

    @property
    def counts(self) -> bool:
        """Whether this flight counts anything."""
        return True

    @property
    def least_integrity(self) -> float:
        """The integrity from which a place counts as certain."""
        return self._params.least_integrity

    @property
    def look_s(self) -> float:
        """The most that one view is looked from."""
        return self._params.view_s

    @property
    def view(self) -> View | None:
        """Where to look from now, None when the present node has nothing left."""
        return self._task.view if self._task else None

    @property
    def exposure(self) -> tuple[float, float]:
        """What the front camera's pictures are wanted with, as parts of its usual exposure and gain."""
        if self._passing is not None:
            return self._exposure.taken_with
        return self.view.exposure if self.view is not None else 1.0, 1.0

    @property
    def blind(self) -> NothingRead | None:
        """Why the count is none, if it is: no picture was read at the last nodes, nor is it yet."""
        if not self._begun or self._begun_blind < min(_BLIND_NODES, self._begun):
            return None
        return NothingRead(self._begun_blind, self._begun)

    def wants(self, node: str) -> bool:
        """Whether locations of a node are left to count."""
        return not self.doubted and bool(self._left(node))

    def stop_s(
        self, node: str, pace: Pace, choice: CountChoice | None = None, *, by_stopping: bool = False
    ) -> float:
        """How long the count of what is left at a node takes, each view looked from once; with a `choice`
        that of what it takes, counted already or not, in passing or only `by_stopping`.  0 where nothing is
        to be counted."""
        if choice is None:
            if not self.wants(node):
                return 0.0
            by_stopping = self._by_stopping
        swept_s = 0.0 if by_stopping else self._passed_s(node, pace, choice)
        if swept_s:
            return swept_s
        places = self._left(node) if choice is None else self.places_at(node, choice)
        views = self._planner.views(node, places, pace.height_m, 0.0) if places else ()
        return views_s(views, pace, self._params.view_s) if views else 0.0

    def places_at(self, node: str, choice: CountChoice = ALL) -> frozenset[str]:
        """The locations that are counted from a node, as far as the choice takes them."""
        return self._chosen(self._planner.locations(node), choice)

    def choose(self, choice: CountChoice, *, by_stopping: bool = False) -> None:
        """Count only what it takes.  `by_stopping`: nothing in passing, which chooses its way itself."""
        self._by_stopping = by_stopping
        self._wanted = frozenset(code for node in self._aisle_of for code in self.places_at(node, choice))

    def choose_at(self, node: str, choice: CountChoice) -> None:
        """Count at one node only what it takes, and elsewhere what was chosen before."""
        self._wanted = self._wanted - self.places_at(node) | self.places_at(node, choice)

    def go_on_with(self, counted: Iterable[CountedPlace]) -> None:
        """Earlier flights of the same count have booked these: they need no look unless a code of theirs is
        found elsewhere."""
        booked = [place for place in counted if place.location in self._planned]
        self._done.update(place.location for place in booked)
        self._owners.book(booked)

    def count_anew(self) -> None:
        """Whatever was counted until now needs another look in the next flight."""
        self.leave()
        self._done.clear()
        self._swept.clear()
        self._passed.clear()
        self._owners.begin()
        self._pending.begin()
        self._unanswered.begin()
        self._begun = self._begun_blind = 0

    def arrive(self, node: str, height_m: float, yaw_rad: float) -> None:
        """Begin or continue the scan of a node that is reached."""
        self.leave()
        views = [
            # with the exposure that was right when its rack front was flown past
            replace(view, exposure=self._exposure.of_places(view.locations))
            for view in self._planner.views(node, self._left(node), height_m, yaw_rad)
        ]
        relights = not self._exposure.fixed
        self._task = ScanTask(node, views, self._planner, self._params, relights, self._passed)
        self._begun, self._begun_blind = self._begun + 1, self._begun_blind + 1
        self._pending.arrive(node)

    def begin(self, now_ns: int) -> None:
        """The view is reached and the drone at rest."""
        if self._task is not None:
            self._task.begin(now_ns)

    def miss(self, now_ns: int) -> None:
        """The view cannot be reached; `view` is then the next one that still may be."""
        if self._task is not None:
            missed = self._task.miss()
            self._gather()
            if missed:
                text = f"no look at {len(missed)} places from {self._task.node}: not reached in time"
                self._events.append(Event(now_ns, EventLevel.WARNING, "view_missed", text))
                self._events += self._unanswered.note(self._task, now_ns, blind=self.blind is not None)

    def step(self, now_ns: int) -> bool:
        """True when the view is over; `view` is then the next one."""
        if self._task is None:
            return True
        over = self._task.step(now_ns)
        if not self._task.relights:
            self._events += self._exposure.fix(now_ns)
        self._gather()
        if over:
            self._events += self._unanswered.note(self._task, now_ns, blind=self.blind is not None)
        return over

    def leave(self) -> None:
        """The node is left; what was not decided there stays to count."""
        self._gather()
        self._task = None

    def reached(self, node: str, certain: bool) -> None:
        """A node is reached: earlier findings are the surer for it, if the place is `certain`."""
        if certain and not self.doubted:
            self._pending.reached(node, self._present)

    def home(self, certain: bool) -> None:
        """The flight has come back to its pad over known lines: everything is where it should be."""
        if certain and not self.doubted:
            self._pending.confirm_all(self._present)

    def end(self, now_ns: int) -> None:
        """The flight is over: tell what has no answer, and what is not proven."""
        self._events += (*self._unanswered.tell(self._done, now_ns), *self._pending.tell(now_ns))

    def doubt(self) -> None:
        """The place may be another one: assign nothing, and keep what is pending, until `trust`."""
        self._break_off()
        self.doubted = True

    def withdraw(self, now_ns: int, reason: str) -> None:
        """The place was or may have been another one: what is pending counts no more."""
        self._break_off()
        codes = self._pending.withdraw()
        self._done.difference_update(codes)
        self._owners.forget(codes)
        if codes or (self._labels.contradict and not self.doubted):
            text = f"{reason}; {len(codes)} findings withdrawn"
            self._events.append(Event(now_ns, EventLevel.WARNING, "map_contradiction", text))

    def _break_off(self) -> None:
        """The place is no more what was assumed: what is not decided yet counts for nothing."""
        self.leave()
        if self._sweep is not None:
            self._sweep.forget()
            self._gather_sweep()
        self._passed.clear()

    def trust(self, *, moved: bool = False) -> None:
        """The place is known again, `moved`: as another one; else labels that contradict it hang wrong."""
        self.doubted = False
        self._labels.trust(moved=moved)

    def take_due(self) -> tuple[str, ...]:
        """The nodes with something to count to fly to once more, their findings having been withdrawn or no
        picture having come there, in the order of their first visit; each at most `revisits` times in a
        flight."""
        return tuple(node for node in self._pending.take_due() if self._left(node))

    @property
    def unproven(self) -> tuple[str, ...]:
        """The nodes that another flight has to count where this one ends now, though it visited them."""
        return self._pending.nodes

    # Counting in passing

    @property
    def sweeps(self) -> bool:
        """Whether shelves are counted in passing first."""
        return self._sweeps is not None

    def told_sweeps(
        self, runs: Iterable[Sequence[str]], choice: CountChoice = ALL
    ) -> tuple[PlannedSweep, ...]:
        """How what hangs at the nodes of `runs`, each in one aisle and begun at its first node, is flown past
        as far as the choice takes it, and why where it is not; empty where nothing ever is."""
        if self._sweeps is None:
            return ()
        return told_runs(self._sweeps, runs, lambda node: self.places_at(node, choice))

    def legs(self, run: Sequence[str], here: str, yaw_rad: float, height_m: float) -> tuple[SweepLeg, ...]:
        """The legs past what is left to count at the nodes `run` of an aisle, for a drone over its node
        `here`; none where all is counted by stopping."""
        if self._sweeps is None or self._by_stopping or self.doubted:
            return ()
        left = frozenset(code for node in run for code in self._left(node)) - self._swept
        return self._sweeps.legs(run, left, here, yaw_rad, height_m) if left else ()

    def begin_sweep(self, legs: Sequence[SweepLeg]) -> None:
        """These legs are flown now."""
        assert self._sweeps is not None
        self.leave()
        cells, node_of = self._assigner.cells, self._node_of.__getitem__
        self._sweep = SweepTask(legs, cells, node_of, self._params, self._sweeps.share)

    def begin_leg(self, now_ns: int) -> None:
        """A leg is flown to, begins, or goes on."""
        if self._sweep is not None and not self.doubted and not self._sweep.looking:
            self._begun, self._begun_blind = self._begun + 1, self._begun_blind + 1
            self._sweep.begin(now_ns)

    def end_leg(self, leg: SweepLeg) -> None:
        """The end of a leg is reached."""
        if self._sweep is not None:
            self._sweep.flown(leg)

    def pause_leg(self) -> None:
        """The leg is interrupted."""
        if self._sweep is not None:
            self._sweep.pause()

    @property
    def passing_mps(self) -> float:
        """No faster may be flown past a shelf for want of light; infinite where nothing is."""
        return self._exposure.most_mps if self._passing is not None else math.inf

    def step_sweep(self, now_ns: int, leg: SweepLeg | None, flown_mps: float) -> None:
        """Decide what has been flown past by now, and how `leg` is to be taken at the speed `flown_mps`."""
        if self._sweep is not None and self._sweeps is not None:
            if leg is not None:
                self._exposure.aim(leg, self._sweeps.sharp_mps, flown_mps)
                self._sweep.fly(now_ns, leg)
            if not self._exposure.follows:
                self._events += self._exposure.fix(now_ns)
            self._sweep.step(now_ns)
            self._gather_sweep()

    def end_sweep(self, now_ns: int) -> None:
        """The legs are over, flown or not: what they left open is counted by stopping."""
        if self._sweep is None:
            return
        self._sweep.end()
        self._gather_sweep()
        self._events.append(Event(now_ns, EventLevel.INFO, "swept", self._sweep.outcome))
        self._events += self._exposure.drain_events(now_ns)
        self._sweep = None

    # What pictures bring

    @property
    def _passing(self) -> SweepTask | None:
        """The count in passing, while pictures are wanted for it."""
        return self._sweep if self._sweep is not None and self._sweep.looking else None

    @property
    def looking(self) -> bool:
        """Whether the front camera's pictures are wanted now."""
        return self._passing is not None or (self._task is not None and bool(self._task.looking))

    def places(self, pose: BodyPose) -> tuple[Place, ...]:
        """The places wanted in a picture taken at `pose`; none for one that would not count."""
        passing = self._passing
        if passing is not None:
            return self._places(pose, passing.near(pose), passing.kept) if pose.certain else ()
        task = self._task
        if task is None or task.since_ns is None or pose.stamp_ns < task.since_ns or not pose.certain:
            return ()
        return self._places(pose, task.looking, task.kept)

    def _places(
        self, pose: BodyPose, codes: Iterable[str], kept: Callable[[str], PictureWorth]
    ) -> tuple[Place, ...]:
        places = self._assigner.places(pose, codes)
        return tuple(replace(place, kept=kept(place.location)) for place in places)

    def take(self, codes: CodeSet, pose: BodyPose) -> None:
        """One picture and the pose at its exposure."""
        if self.doubted:
            return
        passing = self._passing
        if passing is not None:
            leg = passing.leg_at(pose)
            if leg is None:
                return
            self._exposure.take(leg, codes)
            look = self._assigner.look(codes, pose, (leg.aisle, leg.side))
            agreeing = self._proven(look, f"aisle {leg.aisle}")
            if agreeing is not None:
                passing.take(look)
                for node in dict.fromkeys(self._node_of[code] for code in agreeing):
                    self._pending.confirm_at(node)
            return
        view = self.view
        if self._task is None or view is None:
            return
        look = self._assigner.look(codes, pose, (view.aisle, view.side))
        agreeing = self._proven(look, self._task.node)
        if agreeing is None:
            return
        self._task.take(look)
        self._gather()
        if agreeing:
            self._pending.confirm_at(self._task.node)

    def _proven(self, look: ShelfLook, where: str) -> list[str] | None:
        """The location labels in a picture that agree with the map; None where one contradicts it, and
        nothing of the picture may count."""
        self._sightings += look.sightings
        stamp_ns = look.pose.stamp_ns
        self._events += self._labels.unknown(look, where)
        against = self._labels.against(look.sightings)
        if against is not None:
            text = f"label {against.location} seen {against.off_m:+.2f} m from its place"
            self.withdraw(stamp_ns, f"at {where}: {text}")
            self.doubted = True
            return None
        self._begun_blind = 0
        agreeing = [seen.location for seen in look.sightings if not seen.contradicts]
        self._labels.agree(agreeing)
        return agreeing

    # What goes out

    def drain(self) -> tuple[tuple[Finding, ...], tuple[Settled, ...]]:
        """New findings, and what has become of earlier ones."""
        found, self._found = tuple(self._found), []
        return found, self._pending.drain()

    @property
    def evidence(self) -> frozenset[str]:
        """The pictures that a finding names, or may name yet; no other one that was taken will be."""
        named = [found.evidence for found in self._found]
        for task in (self._task, self._sweep):
            named += task.evidence if task is not None else ()
        return frozenset(named)

    def drain_events(self) -> list[Event]:
        events, self._events = self._events, []
        return events

    def drain_sightings(self) -> tuple[Sighting, ...]:
        """Location labels seen, for the localiser."""
        sightings, self._sightings = tuple(self._sightings), []
        return sightings

    @property
    def _present(self) -> str:
        """The node that is scanned now, empty if none is."""
        return self._task.node if self._task else ""

    def _left(self, node: str) -> frozenset[str]:
        return frozenset(self._planner.locations(node)) & self._wanted - self._done

    def _gather(self) -> None:
        if self._task is None:
            return
        for found in self._task.drain():
            self._pending.add(found.location)
            self._count(replace(found, again=found.location in self._swept))

    def _gather_sweep(self) -> None:
        """Take what was decided in passing."""
        assert self._sweep is not None
        for found in self._sweep.drain():
            self._swept.add(found.location)
            self._pending.add_at(found.node, found.location)
            again = self._count(found)
            self._sweep.undecided.update(dict.fromkeys(again, Undecided.ELSEWHERE))
        self._swept.update(self._sweep.undecided)
        self._passed |= self._sweep.passed

    def _count(self, found: Finding) -> frozenset[str]:
        """A finding, whichever way it came.  The places that it takes back, maybe its own: they are counted
        again, by stopping."""
        self._found.append(found)
        self.looks += 1
        self._done.add(found.location)
        against = self._owners.take(found)
        if against is None:
            return frozenset()
        if against.again:
            self._done -= against.again
            self._swept |= against.again
            self._pending.recall({place: self._node_of[place] for place in sorted(against.again)})
        self._events.append(Event(found.stamp_ns, EventLevel.WARNING, "contradiction", str(against)))
        return against.again

    def _passed_s(self, node: str, pace: Pace, choice: CountChoice | None) -> float:
        """A node's share of the time in which its aisle is counted in passing; 0 where it is not."""

        def left_at(other: str) -> frozenset[str]:
            left = self._left(other) - self._swept
            return left if choice is None else self._chosen(left, choice)

        return 0.0 if self._passing_time is None else self._passing_time.share_s(node, left_at, pace)

    def _chosen(self, codes: Iterable[str], choice: CountChoice) -> frozenset[str]:
        places = map(self._site.locations.__getitem__, codes)
        return frozenset(at.code for at in places if choice.takes(at.node, at.side, at.level))
