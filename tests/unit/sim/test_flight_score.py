"""What the simulator's judge counts, and what it calls bad."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flightd.core.types import AttitudeSetpoint, Event, EventLevel, Phase
from flightd.sim.judge.clearance import clearances
from flightd.sim.judge.flight_evidence import FlightEvidence
from flightd.sim.judge.flight_score import score
from flightd.sim.judge.motion import TrueMotion
from flightd.sim.judge.verdict import KINDS, OFF_LEG_M, judged, off_leg_bound_m
from flightd.sim.plant.kinematics import ArmedChange
from flightd.site.site_file import load_site
from flightd.site.ways import BODY_RADIUS_M, KeepOut
from tests.rigs.flight_evidence import MS, SITE, S, at, evidence, landed, status


def kinds(flight: FlightEvidence) -> dict[str, float]:
    return {fault.kind: fault.value for fault in judged(flight, score(flight))}


DONE = status(8 * S, Phase.DONE, "A1", "A1")


@pytest.mark.parametrize("phase", [Phase.HOVER, Phase.CLIMB, Phase.SCAN])
def test_a_stop_that_scans_is_measured_like_one_that_hovers(phase: Phase) -> None:
    truth = [at(stamp * MS, y_m=0.2) for stamp in range(0, 1000, 100)]
    visited = Event(950 * MS, EventLevel.INFO, "visited", "A2")
    result = score(evidence(truth, [status(0, phase)], [visited]))
    assert result.hover_error_p95_m == pytest.approx(0.2)
    assert result.cross_track_max_m == pytest.approx(0.2)


def test_a_look_from_aside_is_measured_from_the_place_of_that_look() -> None:
    """Half a metre aside as ordered, and 5 cm off that: no error of 50 cm, as it is without an order."""
    aside = replace(status(1, Phase.SCAN), view_x_m=2.0, view_y_m=0.0)
    back = replace(status(600 * MS, Phase.CLIMB), view_x_m=1.5, view_y_m=0.0)
    over = replace(status(900 * MS, Phase.SCAN), view_x_m=1.5, view_y_m=0.0)
    truth = [at(stamp * MS, x_m=2.0, y_m=0.05) for stamp in range(50, 600, 50)]
    truth += [at(stamp * MS, x_m=1.75, y_m=0.05) for stamp in range(650, 900, 50)]
    truth += [at(stamp * MS, x_m=1.5, y_m=0.05) for stamp in range(950, 1300, 50)]
    visited = [Event(1290 * MS, EventLevel.INFO, "visited", "A2")]
    assert score(evidence(truth, [aside, back, over], visited)).hover_error_p95_m == pytest.approx(0.05)
    untold = [replace(told, view_x_m=None) for told in (aside, back, over)]
    assert score(evidence(truth, untold, visited)).hover_error_p95_m == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize("phase", [Phase.HOLD, Phase.TAKE_OFF, Phase.LAND])
def test_no_phase_is_passed_over(phase: Phase) -> None:
    truth = [at(stamp * MS, y_m=0.4) for stamp in range(0, 1000, 100)]
    result = score(evidence(truth, [status(0, phase)]))
    assert result.cross_track_max_m == pytest.approx(0.4)
    assert result.hover_error_p95_m is None


def test_a_line_of_the_wrong_aisle_is_as_far_off_as_the_aisles_are_apart() -> None:
    """It flies to A4 as it believes, exactly above the line of aisle B."""
    truth = [at(stamp * MS, 1.8 + stamp / 1000, 3.0) for stamp in range(0, 1000, 100)]
    flight = evidence(truth, [status(0, node="A2", goal="A4")])
    assert score(flight).cross_track_rms_m == pytest.approx(3.0)
    assert kinds(flight)["left_leg"] == pytest.approx(3.0)


def test_while_it_says_that_it_does_not_know_its_place_any_line_is_right() -> None:
    truth = [at(stamp * MS, 1.8 + stamp / 1000, 3.0) for stamp in range(0, 1000, 100)]
    assert score(evidence(truth, [status(0, Phase.RELOCATE, goal="A4")])).cross_track_rms_m == 0.0


def test_no_line_is_right_for_ever_because_it_says_that_it_does_not_know() -> None:
    """From the aisle that it is in it has to come down, or to know."""
    statuses = [status(second * S, Phase.RELOCATE, node="A2", goal="A4") for second in range(45)]
    truth = [at(second * S, 2.5, 3.0) for second in range(45)]
    assert "left_leg" not in kinds(evidence(truth[:29], statuses[:29]))
    assert kinds(evidence(truth, statuses))["left_leg"] == pytest.approx(3.0)


def test_who_turns_back_on_the_way_is_still_on_its_leg() -> None:
    """Half-way from A2 to A4 it is sent home; the way from its nearest node begins behind it."""
    statuses = [status(0, node="A2", goal="A4"), status(S, node="A3", goal="A1")]
    truth = [at(0, 1.5), at(S - 1, 3.2), at(S + 1, 3.2), at(2 * S, 1.0), at(9 * S, 0.2)]
    assert score(evidence(truth, statuses)).cross_track_max_m == pytest.approx(0.0)


def test_who_goes_on_from_the_pad_on_which_it_was_given_a_battery_is_on_its_leg() -> None:
    """B1's: it is told no node while the drone stands on its pad."""
    truth = [at(S, 0.0, 3.0), *(at(3 * S + k * 100 * MS, 0.0, 3.0 - 0.3 * k) for k in range(10))]
    statuses = [status(0, node="B1", goal="B1"), status(100 * MS, Phase.SWAP, node="", goal="A2")]
    assert score(evidence(truth, statuses)).cross_track_max_m == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("aside_m", "believed"), [(0.5, True), (1.4, False)])
def test_a_look_from_aside_is_on_the_leg_and_so_is_the_way_to_it_and_back(
    aside_m: float, believed: bool
) -> None:
    """Half a metre beside the node and line; further than a scan goes it is not believed."""
    truth = [at(0), at(200 * MS, y_m=aside_m / 2), at(400 * MS, y_m=aside_m), at(1100 * MS, y_m=aside_m / 2)]
    truth += [at(1400 * MS), at(4000 * MS, y_m=0.3)]
    aside = replace(status(MS, Phase.SCAN), view_x_m=1.5, view_y_m=aside_m)
    statuses = [status(0), aside, status(S, Phase.SCAN)]
    off_m = score(evidence(truth, statuses)).cross_track_max_m
    assert off_m == pytest.approx(0.3 if believed else aside_m)
    assert score(evidence(truth[:-1], statuses)).cross_track_max_m == pytest.approx(
        0.0 if believed else aside_m
    )


def test_what_a_pilot_does_is_not_judged() -> None:
    truth = [at(0), at(S, y_m=1.1), at(2 * S, y_m=2.0, height_m=5.0)]
    flight = evidence(truth, [status(0), status(S, Phase.PILOT)])
    assert score(flight).cross_track_max_m == pytest.approx(0.0)
    assert kinds(flight) == {"aborted": 1.0}


def landing(event_text: str, level: EventLevel, goal: str = "A1") -> float | None:
    """The landing error told of a drone that comes down 0.3 m beside the pad's node."""
    pad_x_m, pad_y_m = SITE.pad_centre(SITE.home)
    heights_m = [0.0, 1.6, 1.6, 0.0]
    truth = [at(i * MS, pad_x_m + 0.3, pad_y_m, height_m) for i, height_m in enumerate(heights_m)]
    said = [status(2 * MS, Phase.LAND, "A1", goal)]
    return score(evidence(truth, said, [Event(2 * MS, level, "phase", event_text)])).landed_error_m


def test_a_landing_on_the_pad_is_measured_from_its_centre() -> None:
    assert landing("hover -> land: route done", EventLevel.INFO) == pytest.approx(0.3)


@pytest.mark.parametrize("goal", ["A1", "A3"])
def test_a_landing_that_was_ordered_elsewhere_is_not_measured_from_the_pad(goal: str) -> None:
    assert landing("follow -> land: land command", EventLevel.WARNING, goal) is None


def test_the_body_is_measured_with_its_propellers() -> None:
    """The shelf fronts stand 1.2 m beside the line, 3 m high; the body reaches 0.3 m to the side."""
    assert score(evidence([at(0, y_m=0.5)], [status(0)])).min_clearance_m == pytest.approx(0.4)
    assert kinds(evidence([at(0, y_m=0.95)], [status(0)]))["hit_rack"] == pytest.approx(0.05)
    assert "hit_rack" not in kinds(evidence([at(0, y_m=0.95, height_m=3.2)], [status(0)]))
    assert score(evidence([at(0, y_m=1.2, height_m=3.4)], [status(0)])).min_clearance_m == pytest.approx(0.3)


RACKS = load_site(Path(__file__).parents[3] / "configs" / "site-racks.toml")


@pytest.mark.parametrize(("x_m", "free_m"), [(0.3, 0.0), (0.5, -0.2), (0.8, -BODY_RADIUS_M)])
def test_beside_a_cross_way_stand_the_ends_of_racks(x_m: float, free_m: float) -> None:
    """On the way from A1 to B1, between the fronts at y 1.2 and 2.2, which begin 0.6 m beside it."""
    flight = replace(evidence([at(0, x_m, 1.7, 1.5)], [status(0)]), site=RACKS)
    assert score(flight).min_clearance_m == pytest.approx(free_m)
    assert kinds(flight).get("hit_rack", 0.0) == pytest.approx(-free_m)


def test_the_nearest_rack_of_a_large_hall_is_the_nearest_of_all() -> None:
    """A flight of 20 minutes over the whole hall, at each sample held against each rack alone."""
    n = np.arange(6000)
    x_m, y_m = 5.0 + 5.5 * np.sin(n / 150), 31.0 * n / len(n)
    flown = TrueMotion(n / 5.0, x_m, y_m, 1.5 + 2.0 * np.sin(n / 400), np.zeros(len(n)))
    alone = [clearances(replace(RACKS, shelves=(shelf,)), flown)[1].free_m for shelf in RACKS.shelves]
    ceiling, racks = clearances(RACKS, flown)
    assert (ceiling.obstacle, racks.obstacle) == ("ceiling", "rack")
    assert racks.free_m == pytest.approx(np.min(alone, axis=0))


def test_the_ceiling_and_a_keep_out_are_hit_by_the_body_not_its_centre() -> None:
    assert kinds(evidence([at(0, height_m=5.95)], [status(0)]))["hit_ceiling"] == pytest.approx(0.05)
    hung = replace(SITE, keep_outs=(KeepOut(1.0, -0.2, 2.0, 0.2, from_m=1.65, to_m=2.5),))
    flight = replace(evidence([at(0)], [status(0)]), site=hung)
    assert kinds(flight)["hit_keep_out"] == pytest.approx(0.05)
    assert "hit_keep_out" not in kinds(replace(flight, truth=[at(0, height_m=1.5)]))


def test_a_climb_beyond_the_command_is_told_and_a_descent_to_it_is_none() -> None:
    down = [status(0, height_m=2.2), status(S, height_m=1.0)]
    descent = [
        at(S // 2, height_m=2.2),
        at(S + 1, height_m=2.2),
        at(2 * S, height_m=1.4),
        at(3 * S, height_m=1.0),
    ]
    assert score(evidence(descent, down)).max_overshoot_m == pytest.approx(0.0)
    again = [*descent, at(4 * S, height_m=2.1)]
    assert kinds(evidence(again, down))["too_high"] == pytest.approx(1.1)


@pytest.mark.parametrize(
    ("silent_s", "cut_off", "wrong"),
    [(1.3, False, False), (3.0, False, True), (3.0, True, False), (12.0, True, True)],
)
def test_a_computer_that_is_alive_sends_or_has_it_landed_within_a_second(
    silent_s: float, cut_off: bool, wrong: bool
) -> None:
    truth = [at(stamp * 100 * MS) for stamp in range(200)]
    sent = [AttitudeSetpoint(stamp * 20 * MS) for stamp in range(1000)]
    sent = [one for one in sent if not 2 * S <= one.stamp_ns < 2 * S + silent_s * S]
    flight = evidence(truth, [status(0)], setpoints=sent)
    faults = {fault.kind for fault in judged(flight, score(flight), cut_off=cut_off)}
    assert ("out_of_control" in faults) is wrong


def test_a_drone_left_to_itself_in_the_air_is_out_of_control_unless_it_is_landing() -> None:
    truth = [at(stamp * 100 * MS) for stamp in range(200)]
    sent = [AttitudeSetpoint(stamp * 20 * MS) for stamp in range(100)]
    assert kinds(evidence(truth, [status(0)], setpoints=sent))["out_of_control"] > 10.0
    sinking = [replace(t, height_m=5.0 - 0.2 * t.stamp_ns / S) for t in truth]
    assert "out_of_control" not in kinds(evidence(sinking, [status(0)], setpoints=sent))


@pytest.mark.parametrize("period_s", [0.5, 2.0, 7.0])
def test_a_drone_left_to_itself_that_bobs_is_not_landing(period_s: float) -> None:
    """It falls by up to 0.5 m time and again, and sags by 1 cm/s, but comes back."""
    sent = [AttitudeSetpoint(stamp * 20 * MS) for stamp in range(100)]
    turn = math.tau / period_s
    truth = [
        at(
            stamp * 50 * MS,
            height_m=2.0 + 0.25 * math.cos(turn * stamp / 20) - stamp / 2000,
            climb=-0.25 * turn * math.sin(turn * stamp / 20),
        )
        for stamp in range(500)
    ]
    alone_s = score(evidence(truth, [status(0)], setpoints=sent)).uncontrolled_s
    assert alone_s is not None
    assert alone_s > 15.0


@pytest.mark.parametrize(
    ("lean_deg", "after_s", "wrong"), [(10.0, 1.2, True), (10.0, 0.5, False), (4.0, 1.2, False)]
)
def test_who_is_commanded_to_lean_while_it_stands_is_bad(
    lean_deg: float, after_s: float, wrong: bool
) -> None:
    truth = [at(n * 100 * MS, height_m=1.6 if n < 50 else 0.1) for n in range(100)]
    lean = AttitudeSetpoint(5 * S + round(after_s * S), roll_rad=math.radians(lean_deg))
    sent = [AttitudeSetpoint(4 * S, roll_rad=0.2), lean]
    faults = kinds(evidence(truth, [status(0)], setpoints=sent))
    assert ("leaned_on_floor" in faults) is wrong
    assert not wrong or faults["leaned_on_floor"] == pytest.approx(lean_deg)


def test_armed_on_the_floor_for_long_and_in_the_air_at_the_end_are_bad() -> None:
    down = landed(at(S), at(7 * S))
    late = [*down, at(60 * S, 0.0, height_m=0.1)]
    armed = ArmedChange(0, armed=True)
    assert "stayed_armed" not in kinds(evidence(late, [DONE], armed=[armed, ArmedChange(9 * S, armed=False)]))
    assert kinds(evidence(late, [DONE], armed=[armed]))["stayed_armed"] == pytest.approx(52.0)
    assert kinds(evidence([at(0), at(S)], [DONE]))["stayed_up"] == pytest.approx(1.6)


def test_one_that_disarms_as_the_truth_ends_has_disarmed() -> None:
    down = landed(at(S), at(7 * S))
    last_s = down[-1].stamp_ns * 1e-9
    late_s = last_s + 30.0
    cases = ((last_s - 0.2, False), (last_s, False), (last_s + 0.01, False), (late_s, True), (None, True))
    for off_s, stays in cases:
        off = [] if off_s is None else [ArmedChange(round(off_s * S), armed=False)]
        found = kinds(evidence(down, [DONE], armed=[ArmedChange(0, armed=True), *off]))
        assert ("stayed_armed" in found) is stays


@pytest.mark.parametrize(
    ("armed_s", "worst_s"),
    [
        ([(9.0, 48.0), (60.0, 108.0)], None),
        ([(0.0, 110.0)], 20.0),
        ([(0.0, 44.0), (60.0, 110.0)], None),
        ([(9.0, 60.0), (61.0, 110.0)], 16.0),
        ([(9.0, 46.0), (47.0, 108.0)], 17.0),
        ([(9.0, 48.0), (64.0, 200.0)], 96.0),
    ],
    ids=["soon", "never disarmed", "a while before", "at the swap", "before it flies on", "at the end"],
)
def test_armed_for_long_on_any_floor_is_bad(
    armed_s: list[tuple[float, float]], worst_s: float | None
) -> None:
    """It flies from 10 to 44 s, has its battery changed until 64 s (or is flown on), and flies to 104 s."""
    flies = [(10.0, 44.0), (64.0, 104.0)]
    truth = [
        at(n * S, 0.0, height_m=1.6 if any(up_s <= n < down_s for up_s, down_s in flies) else 0.1)
        for n in range(121)
    ]
    armed = [
        ArmedChange(round(stamp_s * S), armed=on)
        for since_s, until_s in armed_s
        for stamp_s, on in ((since_s, True), (until_s, False))
    ]
    found = kinds(evidence(truth, [status(0), status(110 * S, Phase.DONE)], armed=armed))
    assert found.get("stayed_armed") == (None if worst_s is None else pytest.approx(worst_s))


def test_a_hard_touch_down_is_bad() -> None:
    truth = [at(S, 0.0, climb=-2.0), at(2 * S, 0.0, height_m=0.1)]
    assert kinds(evidence(truth, [DONE]))["hard_landing"] == pytest.approx(2.0)


def test_below_the_height_of_a_flight_it_is_judged_too() -> None:
    slid = [at(S), at(2 * S, y_m=0.9, height_m=0.15), at(3 * S, y_m=0.95, height_m=0.1)]
    assert kinds(evidence(slid, [DONE]))["hit_rack"] == pytest.approx(0.05)
    dropped = [
        at(S, 0.0, climb=-0.3),
        at(2 * S, 0.0, height_m=0.25, climb=-1.8),
        at(3 * S, 0.0, height_m=0.1),
    ]
    assert kinds(evidence(dropped, [DONE]))["hard_landing"] == pytest.approx(1.8)


def test_counts_that_are_wrong_are_bad_and_a_flight_without_fault_is_good() -> None:
    visited = Event(4 * S, EventLevel.INFO, "visited", "A2")
    good = evidence(
        landed(at(S, 0.0), at(4 * S, 1.5), at(7 * S, 0.0)), [status(0, node="A1", goal="A2"), DONE], [visited]
    )
    assert judged(good, score(good)) == []
    wrong = judged(good, score(good), codes_wrong=2, empty_wrong=1)
    assert [(fault.kind, fault.value) for fault in wrong] == [("codes_wrong", 2.0), ("empty_wrong", 1.0)]
    assert kinds(replace(good, lost=3)) == {"record_lost": 3.0}


def test_a_completed_mission_answers_for_each_place_and_another_end_for_none() -> None:
    visited = Event(4 * S, EventLevel.INFO, "visited", "A2")
    flown, statuses = landed(at(S, 0.0), at(4 * S, 1.5), at(7 * S, 0.0)), [status(0, node="A1", goal="A2")]
    for phase, told in ((Phase.DONE, {"unanswered": 3.0}), (Phase.ABORTED, {"aborted": 1.0})):
        flight = evidence(flown, [*statuses, replace(DONE, phase=phase)], [visited])
        found = judged(flight, score(flight), not_looked_at=3)
        assert {fault.kind: fault.value for fault in found} == told


def test_a_node_that_was_not_planned_stands_for_none_that_was() -> None:
    visited = Event(4 * S, EventLevel.INFO, "visited", "A1")
    statuses = [status(0, node="A1", goal="A2"), DONE]
    flown = evidence(landed(at(S, 0.0), at(4 * S, 0.0), at(7 * S, 0.0)), statuses, [visited])
    assert score(flown).nodes_visited == 0
    assert kinds(flown)["not_visited"] == 1.0


@pytest.mark.parametrize(("x_m", "miscounted"), [(0.95, 0.0), (2.1, 0.0), (2.3, 1.0), (2.7, 1.0)])
def test_a_node_is_visited_rightly_from_aside_while_no_other_is_nearer(x_m: float, miscounted: float) -> None:
    visited = Event(4 * S, EventLevel.INFO, "visited", "A2")
    statuses = [status(0, node="A1", goal="A2"), DONE]
    flown = evidence(landed(at(S, 0.0), at(4 * S, x_m), at(7 * S, 0.0)), statuses, [visited])
    assert kinds(flown).get("miscounted", 0.0) == miscounted


def test_across_the_aisle_it_is_no_farther_than_without() -> None:
    visited = Event(4 * S, EventLevel.INFO, "visited", "A2")
    statuses = [status(0, node="A1", goal="A2"), DONE]
    flown = evidence(landed(at(S, 0.0), at(4 * S, 1.6, y_m=0.6), at(7 * S, 0.0)), statuses, [visited])
    assert kinds(flown)["miscounted"] == 1.0


def test_each_kind_of_fault_says_what_it_is() -> None:
    assert all(KINDS.values())


def test_the_narrowest_aisle_bounds_how_far_off_its_leg_a_drone_may_be() -> None:
    near = replace(SITE, shelves=tuple(replace(s, y_m=math.copysign(0.7, s.y_m)) for s in SITE.shelves[:2]))
    truth = [at(stamp * MS, y_m=0.5) for stamp in range(0, 1000, 100)]
    flight = evidence(truth, [status(0)])
    assert "left_leg" not in kinds(flight)
    assert kinds(replace(flight, site=near))["left_leg"] == pytest.approx(0.5)
    wide = replace(SITE, shelves=tuple(replace(s, y_m=math.copysign(9.0, s.y_m)) for s in SITE.shelves[:1]))
    assert off_leg_bound_m(wide) == off_leg_bound_m(replace(SITE, shelves=())) == OFF_LEG_M


def test_who_flies_where_no_leg_was_meant_is_off_it() -> None:
    truth = [at(stamp * MS) for stamp in range(0, 2000, 100)]
    assert "left_leg" in kinds(evidence(truth, [status(1000 * MS)])), "before the daemon said anything"
    assert "left_leg" not in kinds(evidence(truth, [status(0)]))


def test_a_flight_without_any_setpoint_is_out_of_control() -> None:
    truth = [at(stamp * S) for stamp in range(20)]
    assert kinds(evidence(truth, [status(0)], setpoints=()))["out_of_control"] == pytest.approx(19.0)
    assert "out_of_control" not in kinds(evidence(truth, [status(0)])), "a log that does not tell of them"


def test_a_pilot_answers_for_what_comes_after_him_not_after_a_failsafe() -> None:
    """The autopilot takes the drone at 5 s and flies it into a rack, the pilot comes at 8 s."""
    truth = [at(stamp * MS, y_m=1.4 if stamp > 6000 else 0.0) for stamp in range(0, 12000, 100)]
    flight = evidence(truth, [status(0), status(5 * S, Phase.PILOT)])
    assert "hit_rack" not in kinds(replace(flight, piloted_ns=4 * S))
    assert "hit_rack" in kinds(replace(flight, piloted_ns=8 * S))
    assert "hit_rack" in kinds(replace(flight, piloted_ns=math.inf))
    assert replace(flight, piloted_ns=8 * S).handed_over_ns == 8 * S
