"""A mission that flies past its shelves, fed by hand: what follows what, and what interrupts it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import pytest

from flightd.app.build import scanner_of
from flightd.config.battery import BatteryConfig
from flightd.config.schema import Config
from flightd.config.sweep import ScanMode
from flightd.core.geometry import wrap_pi
from flightd.core.inventory import LocationState
from flightd.core.scanning import BodyPose, CodeSet, Finding, Light, Place, Settled
from flightd.core.types import CommandKind, Event, LandedState, Phase
from flightd.mission import chosen_plan
from flightd.mission.plan.flight_plan import HeadingPolicy, runs_of
from flightd.mission.plan.leg_times import Pace, profile_s
from flightd.mission.plan.sweep_leg import SweepLeg
from flightd.mission.scan.scanner import Scanner
from flightd.sim.plant.kinematics import Kinematics
from flightd.site.site import Site
from tests.sim.ideal.ideal_front import IdealFront, Label, Stock
from tests.unit.mission import shelves
from tests.unit.mission.configured import configured
from tests.unit.mission.driven import Flight
from tests.unit.mission.shelves import BARE_ENDS, FITTED, SIGHT, SITE, one_aisle
from tools.sweep_time import spent

PLACES = tuple(SITE.locations)
PICTURE_NS = 240_000_000
PASSING = {Phase.TURN, Phase.FOLLOW, Phase.HOVER}


def config() -> Config:
    """The drone that is fed by hand flies a decimetre above its reference."""
    return configured().with_values(
        front_camera=FITTED,
        scan={"mode": ScanMode.SWEEP},
        mission={"expert": {"view_height_m": 0.15}},
    )


class Sweep(Flight):
    """All of a site, the small one unless told otherwise, with an ideal front camera before a known stock."""

    def __init__(self, params: Config | None = None, stock: Stock | None = None, site: Site = SITE) -> None:
        params = params or config()
        scanner = scanner_of(params, site)
        assert isinstance(scanner, Scanner)
        super().__init__(params, site, scanner, HeadingPolicy.of(params, site))
        self.scanner = scanner
        self.front = IdealFront(site, SIGHT, stock or Stock(labels_of(site)))
        self.legs: list[SweepLeg] = []
        self.turned: list[tuple[str, float]] = []
        """Each turn by more than a right angle: the goal that it is for, and by how much."""
        self.findings: list[Finding] = []
        self.settled: list[Settled] = []
        self.events: list[Event] = []
        self.phases: list[Phase] = []
        self.scanned: set[str] = set()

    def fly(self, seconds: float = 240.0, until: Callable[[], bool] = lambda: False) -> None:
        """Until then, or until it lands."""
        self.run(seconds, lambda: self._tick() or until() or self.phase is Phase.LAND)

    def down(self) -> None:
        """It stands on the pad."""
        self.set(landed=LandedState.ON_GROUND, armed=False)
        self.run(0.02, follow=False)

    def _tick(self) -> bool:
        self._note_turn()
        self.phases.append(self.phase)
        if self.phase is Phase.SCAN:
            self.scanned.add(self.mission.goal.node)
        self.events += self.mission.drain_events()
        findings, settled = self.scanner.drain()
        self.findings += findings
        self.settled += settled
        pose = self.inputs.pose
        if pose is not None and self.now_ns % PICTURE_NS == 0 and self.scanner.looking:
            here = BodyPose(
                self.now_ns,
                pose.x_m,
                pose.y_m,
                pose.height_m,
                0.0,
                0.0,
                pose.yaw_rad,
                0.01,
                0.01,
                0.003,
                True,
            )
            k = Kinematics(
                self.now_ns,
                pose.x_m,
                pose.y_m,
                pose.height_m,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                pose.yaw_rad,
                0.0,
                0.0,
                0.0,
            )
            places = self.scanner.places(here)
            if places:
                self.scanner.take(self.front.see(k, places, self.now_ns), here)
        return False

    def _note_turn(self) -> None:
        pose, goal = self.inputs.pose, self.mission.goal
        if goal.sweep is not None and goal.sweep not in self.legs:
            self.legs.append(goal.sweep)
        if pose is not None and self.phase is Phase.TURN and self.phases[-1:] != [Phase.TURN]:
            angle_rad = abs(wrap_pi(goal.yaw_rad - pose.yaw_rad))
            self.turned += [(goal.node, angle_rad)] * (angle_rad > 1.6)

    @property
    def on_leg(self) -> bool:
        """Half-way along a leg past a shelf."""
        pose, sweep = self.inputs.pose, self.mission.goal.sweep
        return self.phase is Phase.FOLLOW and sweep is not None and pose is not None and 1.8 < pose.x_m < 2.0

    @property
    def states(self) -> dict[str, LocationState]:
        return {finding.location: finding.state for finding in self.findings}

    def said(self, name: str) -> list[str]:
        return [event.text for event in self.events if event.name == name]


def labels_of(site: Site) -> dict[str, list[Label]]:
    """A code at each place."""
    return {code: [Label(f"PALLET {code}", 0.1, 0.1)] for code in site.locations}


def lit(codes: CodeSet, places: set[str]) -> CodeSet:
    """The picture with these places burnt out."""
    looks = (replace(look, light=Light.BURNT) if look.location in places else look for look in codes.places)
    return replace(codes, places=tuple(looks))


def test_an_aisle_is_counted_in_passing_and_all_its_nodes_are_visited() -> None:
    flight = Sweep()
    flight.fly()
    assert flight.phase is Phase.LAND, flight.mission.reason
    assert flight.mission.state.on_pad
    assert flight.states == dict.fromkeys(PLACES, LocationState.READ)
    assert Phase.SCAN not in flight.phases
    assert set(flight.said("visited")) == {"A1", "A2", "A3", "A4"}
    assert len(flight.mission.visited) == flight.mission.plan.visits
    assert {code for one in flight.settled if one.confirmed for code in one.locations} == set(PLACES)


def test_what_views_leave_open_is_visited_by_stopping_in_the_best_order() -> None:
    """Two places are badly lit, and one pallet is at two places far from each other."""
    burnt, twice = {"AL-02-1-1", "AL-04-2-2"}, {"AL-02-2-2", "AR-04-1-1"}
    labels = {code: [Label(f"PALLET {code}", 0.1, 0.1)] for code in PLACES if code not in burnt}
    flight = Sweep(stock=Stock(labels | {code: [Label("PALLET 1")] for code in twice}))
    see = flight.front.see
    flight.front.see = lambda k, places, stamp_ns: lit(see(k, places, stamp_ns), burnt)  # type: ignore[method-assign]
    flight.fly()
    assert flight.mission.state.on_pad, flight.mission.reason
    assert set(flight.states) == set(PLACES)
    assert {flight.states[code] for code in burnt} == {LocationState.UNREADABLE}
    assert {flight.states[code] for code in twice} == {LocationState.READ}
    assert flight.said("contradiction") == [
        "one code at AL-02-2-2 and AR-04-1-1: to be looked at again",
        "one code at AL-02-2-2 and AR-04-1-1: counted at each",
    ]
    found = [finding.location for finding in flight.findings]
    assert [found.count(code) for code in sorted(twice)] == [2, 2], "in passing, and at a stop"
    assert {finding.location for finding in flight.findings if finding.again} == burnt | twice
    withdrawn = [code for one in flight.settled if not one.confirmed for code in one.locations]
    assert sorted(withdrawn) == sorted(twice)
    # it ends its legs over A1, where the pad is: there is no way but out and back
    assert "A2, A4 to stop at" in flight.said("sweep")
    assert flight.scanned == {"A2", "A4"}
    # and that is where its time went
    times = spent(flight.events)
    began, *_, ended = (event.stamp_ns for event in flight.events if event.name == "phase")
    assert sum(seconds for seconds, _ in times.values()) == pytest.approx((ended - began) * 1e-9, abs=1.0)
    assert times["legs past shelves"][1] == 4
    assert times["stops before what was left open"][1] >= 4
    assert "nodes that are not flown past" not in times


def test_a_second_label_that_one_picture_showed_in_passing_is_told_after_the_stop() -> None:
    place, labels = "AL-02-1-1", labels_of(SITE)
    flight = Sweep(stock=Stock(labels))
    both = IdealFront(SITE, SIGHT, Stock(labels | {place: [*labels[place], Label("SECOND", -0.2, 0.1)]}))
    see, shown = flight.front.see, Counter[str]()

    def once(k: Kinematics, places: Sequence[Place], stamp_ns: int) -> CodeSet:
        codes = both.see(k, places, stamp_ns)
        texts = {read.text for read in codes.reads}
        if not {"SECOND", f"PALLET {place}"} <= texts or shown["SECOND"]:
            return see(k, places, stamp_ns)
        shown["SECOND"] += 1
        return codes

    flight.front.see = once  # type: ignore[method-assign]
    flight.fly()
    assert flight.mission.state.on_pad, flight.mission.reason
    assert flight.states == dict.fromkeys(PLACES, LocationState.READ)
    assert "1 places to stop before: 1 a code that only one view gives" in flight.said("swept")
    told = {found.location: found.undecided for found in flight.findings if found.undecided}
    assert [(code, [str(one) for one in undecided]) for code, undecided in told.items()] == [
        (place, ["SECOND (1 look)"])
    ]


def test_what_is_booked_is_withdrawn_at_once_where_its_code_is_found_elsewhere() -> None:
    """Location labels prove each place in passing; the flight ends before both are looked at again."""
    one, other = "AL-02-2-2", "AR-04-1-1"
    labels = labels_of(SITE) | {code: [Label("PALLET 1")] for code in (one, other)}
    stock = Stock({code: [*found, Label(code, -0.15)] for code, found in labels.items()})
    flight = Sweep(stock=stock)
    flight.fly(until=lambda: bool(flight.said("contradiction")))
    booked = booked_of(flight)
    assert len(booked) > 4
    assert not {one, other} & set(booked)


def booked_of(flight: Sweep) -> list[str]:
    """What is proven and not withdrawn, once for each time."""
    booked: list[str] = []
    for settled in flight.settled:
        if settled.confirmed:
            booked += settled.locations
        elif settled.booked:
            booked = [code for code in booked if code not in settled.locations]
    return booked


@pytest.mark.parametrize("mode", ScanMode)
def test_one_pallet_at_two_places_is_counted_at_neither_before_both_are_looked_at_again(
    mode: ScanMode,
) -> None:
    """Whichever way they are counted, and in whichever aisle."""
    one, other = "AL-02-2-2", "CR-04-1-1"
    labels = labels_of(BARE_ENDS) | {code: [Label("PALLET 9")] for code in (one, other)}
    flight = Sweep(config().with_values(scan={"mode": mode}), Stock(labels), BARE_ENDS)
    flight.fly(900.0, until=lambda: bool(flight.said("contradiction")))
    assert not {one, other} & set(booked_of(flight))
    flight.fly(900.0)
    assert flight.mission.state.on_pad, flight.mission.reason
    assert flight.said("contradiction") == [
        f"one code at {one} and {other}: to be looked at again",
        *(f"one code at {a} and {b}: counted at each" for a, b in [flight_order(flight, one, other)]),
    ]
    assert flight.states == dict.fromkeys(BARE_ENDS.locations, LocationState.READ)
    assert sorted(booked_of(flight)) == sorted(BARE_ENDS.locations)
    found = Counter(finding.location for finding in flight.findings)
    assert {code for code, count in found.items() if count > 1} == {one, other}
    assert len(flight.mission.visited) == flight.mission.plan.visits


def flight_order(flight: Sweep, *places: str) -> list[str]:
    """These places in the order of their last looks."""
    found = [finding.location for finding in flight.findings]
    return sorted(places, key=lambda code: -found[::-1].index(code))


def test_a_pallet_that_is_moved_during_the_count_is_counted_where_it_is() -> None:
    one, other = "AL-02-2-2", "AR-04-1-1"
    labels = labels_of(SITE) | {one: [Label("PALLET 9")]}
    flight = Sweep(config().with_values(scan={"mode": ScanMode.STOP}), Stock(labels))
    flight.fly(until=lambda: one in flight.states)
    moved = labels | {one: [Label("PALLET 8")], other: [Label("PALLET 9")]}
    flight.front = IdealFront(SITE, SIGHT, Stock(moved))
    flight.fly(900.0)
    assert len(flight.said("contradiction")) == 1
    last = {finding.location: finding.reads[0].text for finding in flight.findings}
    assert (last[one], last[other]) == ("PALLET 8", "PALLET 9")
    assert sorted(booked_of(flight)) == sorted(PLACES)


def test_aisle_after_aisle_is_flown_past_with_one_half_turn_each_and_no_way_out_to_bare_ends() -> None:
    flight = Sweep(config().with_values(camera={"mount_yaw_deg": 90.0}), site=BARE_ENDS)
    flight.fly(600.0)
    assert flight.mission.state.on_pad, flight.mission.reason
    assert flight.states == dict.fromkeys(BARE_ENDS.locations, LocationState.READ)
    assert set(flight.said("visited")) == set(BARE_ENDS.nodes)
    assert len(flight.said("sweep")) == 3
    assert not flight.scanned
    assert [node[0] for node, _ in flight.turned] == ["A", "B", "C"], "from one side to the other"
    assert len(flight.legs) == 12


@pytest.mark.parametrize("shut", [("A1", "A2"), ("A4", "A5")], ids=["its first line", "its last"])
def test_an_aisle_of_which_one_line_is_one_way_is_flown_past_as_far_as_the_plan_says(
    shut: tuple[str, str],
) -> None:
    edges = (replace(edge, one_way=(edge.a, edge.b) == shut) for edge in BARE_ENDS.edges)
    site = replace(BARE_ENDS, edges=tuple(edges))
    flight = Sweep(site=site)
    sweeps = flight.scanner.told_sweeps(runs_of(site, flight.mission.plan.stops))
    flight.fly(900.0)
    assert flight.mission.state.on_pad, flight.mission.reason
    flown = {code for leg in flight.legs for code in leg.locations}
    assert sum(told.places for told in sweeps if told.swept) == len(flown)
    assert sum(told.places for told in sweeps) == len(site.locations)
    assert {told.swept for told in sweeps if "A" in told.aisles} == {True, False}


@pytest.mark.parametrize(
    ("levels_m", "flown"),
    [
        pytest.param((0.5, 0.75, 1.7), [(1, 2), (1, 2), (3,), (3,)], id="at one height"),
        pytest.param((0.5, 0.95), [(1,), (1,), (2,), (2,)], id="nearer than it strays"),
    ],
)
def test_levels_that_the_lowest_height_brings_together_are_counted_on_their_own_legs(
    levels_m: tuple[float, ...], flown: list[tuple[int, ...]]
) -> None:
    """It flies a decimetre above each leg."""
    site = one_aisle(levels_m)
    flight = Sweep(site=site, stock=Stock({code: [Label(f"PALLET {code}", 0.1)] for code in site.locations}))
    flight.fly()
    assert flight.mission.state.on_pad, flight.mission.reason
    assert sorted(leg.levels for leg in flight.legs) == flown
    assert flight.states == dict.fromkeys(site.locations, LocationState.READ)
    assert len(flight.findings) == len(site.locations), "nothing is counted twice"
    assert not flight.scanned, flight.said("swept")


def test_a_picture_that_is_read_late_counts_for_the_leg_on_which_it_was_taken() -> None:
    scanner = scanner_of(config(), one_aisle((0.5, 0.95)))
    legs = scanner.legs(("A1", "A2", "A3", "A4"), "A1", -math.pi / 2, 0.8)
    scanner.begin_sweep(legs)
    scanner.begin_leg(0)
    for k, leg in enumerate(legs[:2]):
        scanner.step_sweep(k * 10 * PICTURE_NS, leg, 0.8)
    between_m = (legs[0].height_m + legs[1].height_m) / 2
    for k in (9, 11):
        here = shelves.pose(k * PICTURE_NS, height_m=between_m)
        seen = {place.location for place in scanner.places(here)}
        assert seen
        assert seen <= set(legs[k // 10].locations)


def test_between_two_legs_it_waits_for_nothing_but_height_and_heading() -> None:
    """Where it comes to rest, and where it gathers speed, the places at the end are seen long enough."""
    params = config()
    flight = Sweep(params)
    flight.fly()
    pace = Pace.of(params.mission)
    changes = [
        (event.stamp_ns * 1e-9, event.text) for event in flight.events if event.name in {"phase", "swept"}
    ]
    begun = next(k for k, (_, text) in enumerate(changes) if "follow -> hover" in text)
    over = next(k for k, (_, text) in enumerate(changes) if "to stop before" in text)
    between = list(pairwise(changes[begun:over]))
    turns_s = [end - start for (start, text), (end, _) in between if "-> turn" in text]
    legs_s = [end - start for (start, text), (end, _) in between if "-> follow" in text]
    assert len(turns_s) == len(legs_s) == 4
    assert sorted(turns_s)[1] < pace.climb_s(0.9) - 0.2, "settled, from a decimetre before its height on"
    assert sorted(legs_s)[1] < profile_s(3.9, pace.speed_mps, pace.accel_mps2) + 0.6


@pytest.mark.parametrize("kind", [CommandKind.PAUSE, CommandKind.HOME, CommandKind.LAND])
def test_an_order_on_a_leg_acts_as_anywhere_else(kind: CommandKind) -> None:
    flight = Sweep()
    flight.fly(until=lambda: flight.on_leg)
    assert flight.on_leg
    flight.order(kind)
    flight.fly(2.0)
    if kind is CommandKind.PAUSE:
        assert flight.phase is Phase.HOLD
        assert not flight.scanner.looking
        flight.order(CommandKind.RESUME)
        flight.fly()
        assert flight.mission.state.on_pad
        assert set(flight.states) == set(PLACES)
        assert set(flight.said("visited")) == {"A1", "A2", "A3", "A4"}
    elif kind is CommandKind.LAND:
        assert flight.phase is Phase.LAND
    else:
        pose = flight.inputs.pose
        assert pose is not None
        assert flight.mission.goal.node in {"A1", "A2", "A3", "A4"}
        assert abs(flight.mission.goal.x_m - pose.x_m) < 1.6, "not on to the end of the leg"
        flight.fly()
        assert flight.mission.state.on_pad
        assert flight.findings, "what was decided on the way stays"


def test_a_battery_that_runs_low_on_the_way_leaves_the_rest_for_the_next() -> None:
    flight = Sweep(config().with_values(battery=BatteryConfig(swap=True)))
    flight.fly(until=lambda: flight.on_leg and len(flight.findings) > 6)
    flight.set(battery_frac=0.19)
    flight.fly()
    flight.down()
    assert flight.phase is Phase.SWAP, flight.mission.reason
    before = set(flight.states)
    assert 0 < len(before) < len(PLACES)
    assert set(flight.mission.remaining)
    flight.set(battery_frac=0.9, height_m=0.1)
    flight.fly()
    assert set(flight.states) == set(PLACES)
    assert len(flight.findings) == len(PLACES), "nothing is counted twice"
    assert len(flight.said("sweep")) == 2 + (len(flight.scanned) > 0), "what was not flown past is flown past"


def test_a_doubt_on_a_leg_undoes_what_is_open_and_stops_before_it_later() -> None:
    flight = Sweep()
    flight.fly(until=lambda: flight.on_leg)
    flight.scanner.doubt()
    flight.fly(until=lambda: flight.phase is Phase.RELOCATE)
    assert flight.phase is Phase.RELOCATE
    flight.fly()
    assert flight.mission.state.on_pad, flight.mission.reason
    assert set(flight.states) == set(PLACES)
    assert any("the position was doubted" in text for text in flight.said("swept"))
    assert Phase.SCAN in flight.phases


def test_without_a_single_picture_the_count_is_none() -> None:
    scanner = scanner_of(config(), SITE)
    scanner.begin_sweep(scanner.legs(("A1", "A2"), "A1", 0.0, 1.0))
    assert scanner.blind is None
    scanner.begin_leg(1)
    assert scanner.blind is not None


def test_a_camera_that_looks_aside_flies_nose_along_and_past_the_same() -> None:
    aside = config().with_values(front_camera={"mount_yaw_deg": 90.0})
    scanner = scanner_of(aside, SITE)
    legs = scanner.legs(("A1", "A2", "A3", "A4"), "A1", 0.0, 1.6)
    assert {abs(round(math.degrees(leg.yaw_rad))) for leg in legs} == {0, 180}
    assert HeadingPolicy.of(aside, SITE).heading is configured().mission.heading


def test_a_plan_that_is_led_on_from_node_to_node_is_counted_by_stopping() -> None:
    """In passing the drone would fly along the aisle where nobody has released it to."""
    flight = Sweep(config().with_values(mission={"autostart": False}))
    flight.run(0.2)
    passing = flight.mission.planned(("A2", "A3"), best_order=False)
    flight.order(CommandKind.PLAN, nodes=("A2", "A3"), waits=True)
    flight.order(CommandKind.START)
    flight.fly(until=lambda: flight.phase is Phase.HOLD)
    assert (flight.phase, flight.mission.goal.node) == (Phase.HOLD, "A3")
    assert not flight.legs
    assert flight.scanned == {"A2", "A3"} == set(flight.said("visited"))
    assert set(flight.states) == {code for code in PLACES if SITE.locations[code].node in flight.scanned}
    flight.order(CommandKind.HOME)
    flight.fly()
    flight.down()
    stopping = flight.mission.planned(("A2", "A3"), best_order=False, waits=True)
    assert passing.sweeps
    assert not stopping.sweeps
    assert stopping.seconds > passing.seconds


def test_what_is_configured_is_told_by_stopping_however_many_nodes_it_has(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A manager asks every drone for it, and flies none that does not answer."""
    monkeypatch.setattr(chosen_plan, "MOST_NODES", 1)
    mission = Sweep().mission
    passing = mission.planned((), best_order=False)
    stopping = mission.planned((), best_order=False, waits=True)
    assert passing.sweeps
    assert not stopping.sweeps
    assert (stopping.nodes, stopping.places) == (passing.nodes, passing.places)
    assert stopping.seconds > passing.seconds
