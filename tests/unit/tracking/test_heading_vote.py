"""How the lines of a frame vote on the heading: several that say the same outvote it and strays."""

from __future__ import annotations

import math

import pytest

from flightd.core.geometry import Mount
from flightd.core.types import Attitude, LineSet
from flightd.sim.plant.kinematics import Kinematics
from flightd.tracking.heading_vote import HeadingVote, heading_vote
from flightd.tracking.line_tracker import LineTracker
from flightd.tracking.tilt_compensation import GroundLine
from tests.sim.ideal.ideal_sight import EyeErrors, IdealEye
from tests.unit.tracking.test_lines import FRAME_NS, HEIGHT_M, LENS, SITE

SIGMA_RAD = math.radians(0.5)
TURN = 20.0


def line(said_deg: float, rho_m: float = 0.0, long_m: float = 2.0) -> GroundLine:
    """One that says so much against a heading of 0 and lies so far beside the drone."""
    theta = math.radians(-said_deg)
    cos, sin = math.cos(theta), math.sin(theta)
    forward, right = -rho_m * sin, rho_m * cos
    ends = [(forward + sign * long_m / 2 * cos, right + sign * long_m / 2 * sin) for sign in (-1.0, 1.0)]
    return GroundLine(rho_m, theta, forward, right, 0.01, math.radians(0.3), 0.05, (ends[0], ends[1]))


def vote(*lines: GroundLine, before_deg: float = 0.0) -> HeadingVote | None:
    return heading_vote(lines, 0.0, SIGMA_RAD, math.radians(before_deg))


def held(found: HeadingVote | None) -> bool:
    assert found is not None
    return found.holds


def against(found: HeadingVote | None) -> tuple[float, int]:
    """What the winners say, degrees, and by how many they lead."""
    assert found is not None
    assert not found.holds
    return math.degrees(found.error_rad), found.lead


def test_no_line_says_nothing() -> None:
    assert vote() is None


def test_a_lone_line_that_contradicts_leads_by_itself() -> None:
    assert against(vote(line(TURN))) == pytest.approx((TURN, 1))


def test_several_lines_outvote_one_that_agrees() -> None:
    several = line(TURN), line(TURN + 0.4, 0.7), line(TURN + 90.2, 0.3)
    error_deg, lead = against(vote(line(1.0, -0.5), *several))
    assert error_deg == pytest.approx(TURN + 0.2, abs=0.01)
    assert lead == 2


def test_one_against_one_leaves_the_heading_as_it_is() -> None:
    assert held(vote(line(1.0), line(TURN, 0.5)))


def test_strays_do_not_add_up_nor_pull_at_what_the_others_say() -> None:
    strays = line(-9.0, 0.4), line(33.0, -0.4)
    assert held(vote(line(1.0), *strays))
    assert against(vote(line(TURN), line(TURN + 1.0, 0.7), *strays)) == pytest.approx((TURN + 0.5, 1))


@pytest.mark.parametrize("before_deg", [TURN, -15.0])
def test_among_equals_those_win_that_won_before(before_deg: float) -> None:
    found = vote(line(TURN), line(-15.0, 0.5), before_deg=before_deg)
    assert against(found) == pytest.approx((before_deg, 0))


def test_pieces_of_one_line_and_both_edges_of_a_strip_are_one_witness() -> None:
    pieces = line(TURN), line(TURN, 0.02, long_m=0.3), line(TURN + 0.5, 0.1)
    assert held(vote(line(1.0, -0.5), *pieces))


def test_half_a_right_angle_off_some_lines_say_more_and_some_less() -> None:
    error_deg, lead = against(vote(line(44.5), line(45.5, 0.7)))
    assert abs(error_deg) == pytest.approx(45.0, abs=0.01)
    assert lead == 2


def test_a_false_line_that_agrees_with_a_turned_camera_does_not_keep_the_tracker_from_finding_it() -> None:
    """Above a node, two right ones against a false one that lies as the told heading has it."""
    tracker = LineTracker(LENS, Mount(), SITE.line_width_m, 0.0)
    start = SITE.nodes["A1"]
    turned_rad = math.radians(TURN)
    eye = IdealEye(SITE, LENS, Mount(), EyeErrors(0.1, 0.0002), 1)
    turned = IdealEye(SITE, LENS, Mount(turned_rad), EyeErrors(0.1, 0.0002), 1)
    errors = []
    for frame in range(1, 120):
        stamp_ns = frame * FRAME_NS
        tracker.attitude(Attitude(stamp_ns, 0.0, 0.0, 0.0))
        k = Kinematics(stamp_ns, start.x_m, start.y_m, HEIGHT_M, 0, 0, 0, 0, 0, 0, 0, 0, 0)
        seen = eye.see(k, frame, stamp_ns)
        if frame > 30:
            right = turned.see(k, frame, stamp_ns).lines
            seen = LineSet(frame, stamp_ns, 640, 360, (*right, seen.lines[0]), (), "test")
        tracker.frame(seen, HEIGHT_M)
        errors.append(abs(tracker.heading_error_rad))
    assert max(errors) == pytest.approx(turned_rad, abs=math.radians(1.0))
    assert tracker.learnt() is None, "the camera was knocked"
