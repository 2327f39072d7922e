"""Who has turned where lines and heading contradict each other: shown by who leapt."""

from __future__ import annotations

import math

import pytest

from flightd.core.types import Attitude
from flightd.tracking.heading_dispute import HeadingDispute, Turned
from flightd.tracking.heading_vote import HeadingVote

FRAME_NS = 33_000_000
ERROR_RAD = math.radians(20.0)


def fly(  # type: ignore[no-untyped-def]
    told_yaw, lines_error, seconds: float = 3.0, lead: int = 2
) -> tuple[Turned | None, float]:
    """What was found and when, s: `told_yaw` and what so many lines say against it, by time; agreement is
    less than four degrees."""
    dispute = HeadingDispute()
    for frame in range(round(seconds * 1e9 / FRAME_NS)):
        stamp_ns = frame * FRAME_NS
        at_s = stamp_ns * 1e-9
        dispute.told(Attitude(stamp_ns, 0.0, 0.0, told_yaw(at_s)))
        error = lines_error(at_s)
        holds = abs(error) < math.radians(4.0)
        found = dispute.step(HeadingVote(error, holds, 0 if holds else lead), stamp_ns)
        if found is not None:
            return found, at_s
    return None, math.inf


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_picture_that_leaps_while_the_heading_goes_on_is_a_knocked_camera(sign: float) -> None:
    found, at_s = fly(lambda t: 0.2 * t, lambda t: sign * ERROR_RAD * (t > 1.0))
    assert found is Turned.CAMERA
    assert at_s < 2.0


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_told_heading_that_leaps_is_a_wrong_heading(sign: float) -> None:
    found, _ = fly(lambda t: -sign * ERROR_RAD * (t > 1.0), lambda t: sign * ERROR_RAD * (t > 1.0))
    assert found is Turned.HEADING


def test_a_heading_that_is_led_astray_bit_by_bit_is_a_wrong_heading() -> None:
    found, _ = fly(lambda t: -min(0.08 * t, 0.2), lambda t: min(0.08 * t, 0.2), 6.0)
    assert found is Turned.HEADING


def test_lines_that_contradict_from_the_first_are_believed_against_the_heading() -> None:
    found, _ = fly(lambda t: 0.0, lambda t: ERROR_RAD)
    assert found is Turned.HEADING


def test_a_lone_line_has_to_say_so_for_twice_as_long() -> None:
    several, several_s = fly(lambda t: 0.0, lambda t: ERROR_RAD, lead=2)
    lone, lone_s = fly(lambda t: 0.0, lambda t: ERROR_RAD, lead=1)
    assert several is lone is Turned.HEADING
    assert several_s == pytest.approx(0.6, abs=0.05)
    assert lone_s == pytest.approx(1.2, abs=0.05)


def test_as_many_lines_that_say_one_thing_as_say_another_decide_nothing() -> None:
    assert fly(lambda t: 0.0, lambda t: ERROR_RAD, lead=0) == (None, math.inf)
