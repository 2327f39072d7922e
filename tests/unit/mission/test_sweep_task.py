"""A flight past the shelves: what its pictures decide, place by place, and what they leave for a stop."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from flightd.core.inventory import LocationState
from flightd.core.scanning import BodyPose, CodeSet, PlaceLook
from flightd.mission.scan.code_assignment import Assigner, PlacedRead, ShelfLook
from flightd.mission.scan.sweep_planner import SweepPlanner
from flightd.mission.scan.sweep_task import SweepTask
from flightd.mission.scan.sweep_votes import Undecided
from tests.unit.mission.shelves import SIGHT, SITE, pose, read
from tests.unit.mission.test_sweep_planner import ALL, NODES, PLANNER
from tests.unit.mission.test_sweep_votes import GOODS, PARAMS, QUAD


class Passing:
    """A flight past the lower left level, its pictures made by hand."""

    def __init__(self, planner: SweepPlanner = PLANNER) -> None:
        self.legs = legs = planner.legs(NODES, ALL, "A1", -math.pi / 2, 0.9)
        cells = Assigner(SITE, SIGHT).cells
        nodes = {code: place.node for code, place in SITE.locations.items()}
        self.task = SweepTask(legs, cells, nodes.__getitem__, PARAMS, planner.share)
        self.task.begin(0)
        self.now_ns = 0
        self.seq = 0

    def see(self, reads: Mapping[str, Sequence[str]], **changes: float) -> None:
        """A picture 0.1 m further on, which shows these codes at their places."""
        self.now_ns += 250_000_000
        self.seq += 1
        where = {"x_m": 0.1 * self.seq, "height_m": 0.9} | changes
        here: BodyPose = pose(self.now_ns, **where)
        shown = tuple(
            PlaceLook(code, QUAD, 1.0, GOODS, "e") for code in self.task.near(here) if code in reads
        )
        found = tuple(
            PlacedRead(read(text), code, code, SITE.locations[code].x_m, 0.9, 0.06, 1.0)
            for code, texts in reads.items()
            for text in texts
        )
        self.task.take(ShelfLook(CodeSet(self.seq, self.now_ns, 1280, 800, (), shown), here, found, ()))

    def found(self) -> dict[str, LocationState]:
        self.now_ns += 2_000_000_000
        self.task.step(self.now_ns)
        return {finding.location: finding.state for finding in self.task.drain()}


ONE, TWO = "AL-02-1-1", "AL-02-1-2"


def test_a_place_is_decided_once_it_has_been_flown_past() -> None:
    passing = Passing()
    for _ in range(4):
        passing.see({ONE: ["P1"], TWO: ["P2"]})
    passing.task.step(passing.now_ns)
    assert not passing.task.drain(), "it is still in the picture"
    assert passing.found() == {ONE: LocationState.READ, TWO: LocationState.READ}
    assert ONE not in passing.task.near(pose(passing.now_ns, height_m=0.9))


def test_a_place_that_was_only_glimpsed_may_still_be_flown_past() -> None:
    """On a turn before its leg, or while the drone gathers speed."""
    flight = Passing()
    flight.see({ONE: ["P1"]})
    assert flight.found() == {}
    for _ in range(4):
        flight.see({ONE: ["P1"]})
    assert flight.found() == {ONE: LocationState.READ}
    assert ONE not in flight.task.undecided
    flight.see({TWO: ["P2"]})
    assert flight.found() == {}
    flight.task.end()
    assert flight.task.undecided[TWO] is Undecided.UNSEEN


def test_what_is_left_for_a_stop_keeps_what_was_read_in_passing() -> None:
    passing = Passing()
    passing.see({ONE: ["P1", "P2"], TWO: ["P3", "P2"]})
    for _ in range(3):
        passing.see({ONE: ["P1"], TWO: ["P4"]})
    passing.task.end()
    assert passing.task.undecided == {ONE: Undecided.TORN, TWO: Undecided.TORN}
    reads = {
        code: [(seen.read.text, looks) for seen, looks in at] for code, at in passing.task.passed.items()
    }
    assert reads == {ONE: [("P1", 4)], TWO: [("P3", 1), ("P4", 3)]}, "P2 is at both"
    passing.task.forget()
    assert passing.task.passed == {}


def test_one_code_at_two_neighbours_is_decided_at_neither() -> None:
    passing = Passing()
    for code in (ONE, ONE, ONE, TWO, TWO, TWO):
        passing.see({code: ["P1"], ONE if code == TWO else TWO: []})
    assert passing.found() == {}
    assert passing.task.undecided == {ONE: Undecided.ELSEWHERE, TWO: Undecided.ELSEWHERE}


def test_one_article_beside_itself_in_one_picture_has_two_labels() -> None:
    passing = Passing()
    for _ in range(4):
        passing.see({ONE: ["4006381333931"], TWO: ["4006381333931"]})
    assert set(passing.found()) == {ONE, TWO}


def test_pictures_from_another_height_or_heading_or_after_a_pause_count_for_nothing() -> None:
    passing = Passing()
    for changes in ({"height_m": 1.2}, {"yaw_rad": -1.0}):
        passing.see({ONE: ["P1"]}, **changes)
    passing.task.pause()
    passing.see({ONE: ["P1"]})
    passing.task.end()
    assert not passing.task.undecided, "the leg was not flown to its end: it is flown anew"
    passing.task.flown(passing.legs[0])
    passing.task.end()
    assert not passing.task.drain()
    assert passing.task.undecided[ONE] is Undecided.UNSEEN


def test_a_doubt_about_the_place_undoes_what_is_not_decided() -> None:
    passing = Passing()
    for _ in range(4):
        passing.see({ONE: ["P1"]})
    passing.task.forget()
    passing.task.begin(passing.now_ns)
    assert passing.found() == {}
    assert passing.task.undecided == {ONE: Undecided.DOUBTED}
