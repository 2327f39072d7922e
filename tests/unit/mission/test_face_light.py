"""How the light of a rack front is chosen: paper that is too dark or too light comes out as wanted, soon and
without swinging, sharp at any speed, and nothing is asked of a camera that does not follow."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.mission.scan.face_light import FaceLight, LegLight, Shot
from flightd.site.site import Side

LEFT, RIGHT = ("A", Side.LEFT, 1), ("A", Side.RIGHT, 1)
LEG = LegLight(speed_mps=0.8, exposure=1.0, sharp_mps=1.1)
PAPER = 215.0
LEAST, MOST, MOST_GAIN = 0.4, 2.5, 2.5


class Camera:
    """Takes pictures of a front in some light, each with what was asked for `late` pictures before."""

    def __init__(self, light: float, *, late: int = 1, exposes: bool = True, gains: bool = True) -> None:
        self.light = light
        self._asked = [Shot()] * (late + 1)
        self._exposes, self._gains = exposes, gains

    def take(self, wanted: Shot) -> tuple[tuple[float, float], float]:
        """Parts of exposure and gain, and the white of paper."""
        self._asked = [*self._asked[1:], wanted]
        exposure = self._asked[0].exposure if self._exposes else 1.0
        gain = self._asked[0].gain if self._gains else 1.0
        return (exposure, gain), min(PAPER * self.light * exposure * gain, 255.0)


def chooser() -> FaceLight:
    return FaceLight(LEAST, MOST, MOST_GAIN)


def fly(light: FaceLight, camera: Camera, count: int, leg: LegLight = LEG) -> tuple[list[Shot], list[float]]:
    """What is wanted, and the white of paper, picture by picture."""
    shots, whites = [], []
    flown_mps = leg.speed_mps
    for _ in range(count):
        shot = light.shot([LEFT], leg, flown_mps)
        taken, white = camera.take(shot)
        assert taken[0] * flown_mps <= leg.sharp_mps * 1.001 or not light.follows, "blurred"
        light.take({LEFT: white}, shot, taken, leg.exposure)
        flown_mps += min(max(shot.speed_mps - flown_mps, -0.1), 0.1)
        shots.append(shot)
        whites.append(white)
    return shots, whites


@pytest.mark.parametrize("lit", [0.4, 0.5, 1.3, 2.0])
@pytest.mark.parametrize("late", [0, 1, 3])
def test_paper_comes_out_as_wanted_soon_and_stays_so(lit: float, late: int) -> None:
    shots, whites = fly(chooser(), Camera(lit, late=late), 30)
    assert all(150.0 < white < 240.0 for white in whites[12:])
    assert len(set(shots[12:])) == 1, "it does not swing"


def test_what_comes_out_well_enough_is_left_alone() -> None:
    for lit in (0.55, 0.8, 1.0, 1.1):
        assert set(fly(chooser(), Camera(lit), 20)[0]) == {Shot(1.0, 1.0, 0.8)}


def test_what_was_set_right_is_not_touched_until_it_is_really_wrong_again() -> None:
    light, camera = chooser(), Camera(2.0)
    fly(light, camera, 20)
    part = light.part([LEFT])
    for lit in (1.5, 2.2, 1.4):  # paper between 110 and 240 again and again
        camera.light = lit
        fly(light, camera, 10)
    assert light.part([LEFT]) == part
    camera.light = 0.4
    fly(light, camera, 20)
    assert light.part([LEFT]) > 3.0 * part


def test_one_picture_of_a_lamp_changes_nothing() -> None:
    light = chooser()
    for white in (200.0, 200.0, 255.0, 200.0, 200.0, 12.0, 200.0):
        light.take({LEFT: white}, Shot(), (1.0, 1.0), 1.0)
    assert light.part([LEFT]) == 1.0


@given(st.lists(st.floats(0.0, 255.0), max_size=40), st.floats(0.0, 2.0))
def test_no_exposure_is_longer_than_blur_allows_and_no_light_beyond_its_bounds(
    whites: list[float], flown_mps: float
) -> None:
    light = chooser()
    for white in whites:
        shot = light.shot([LEFT], LEG, flown_mps)
        assert shot.exposure * max(flown_mps, shot.speed_mps) <= LEG.sharp_mps * 1.001
        assert 1.0 <= shot.gain <= MOST_GAIN
        assert LEG.speed_mps / 2 <= shot.speed_mps <= LEG.speed_mps
        before = light.part([LEFT])
        light.take({LEFT: white}, shot, (shot.exposure, shot.gain), LEG.exposure)
        assert LEAST <= light.part([LEFT]) <= MOST
        assert 1.0 / 1.601 <= light.part([LEFT]) / before <= 1.601


def test_a_dark_front_gets_exposure_then_gain_and_only_then_a_slower_flight() -> None:
    shots, _ = fly(chooser(), Camera(0.4), 30)
    assert shots[-1].exposure == pytest.approx(LEG.sharp_mps / LEG.speed_mps, rel=0.1)
    assert shots[-1].gain > 1.3
    assert shots[-1].speed_mps == LEG.speed_mps
    slower, whites = fly(chooser(), Camera(0.4, gains=False), 60)
    assert slower[-1].gain == 1.0
    assert LEG.speed_mps / 2 <= slower[-1].speed_mps < 0.9 * LEG.speed_mps
    assert whites[-1] > 150.0


def test_a_camera_that_does_not_follow_is_left_as_it_is_and_flown_no_faster_than_it_is_sharp() -> None:
    light = chooser()
    fly(light, Camera(0.4, exposes=False, gains=False), 30)
    assert not light.follows
    assert light.part([LEFT]) == 1.0
    fast = LegLight(speed_mps=1.6, exposure=0.6, sharp_mps=1.1)
    assert light.shot([LEFT], fast, 1.6) == Shot(1.0, 1.0, 1.1)


def test_each_front_has_its_own_light_and_keeps_it_for_the_next_look() -> None:
    light = chooser()
    fly(light, Camera(2.0), 20)
    assert light.part([LEFT]) < 0.6
    assert light.part([RIGHT]) == 1.0
    assert light.shot([RIGHT], LEG, 0.8) == Shot(1.0, 1.0, 0.8)
    assert light.shot([LEFT], LEG, 0.8).exposure < 0.6
    assert light.drain_changed() == [(LEFT, light.part([LEFT]))]
    assert light.drain_changed() == []


def test_without_a_white_nothing_is_learnt() -> None:
    light = chooser()
    for _ in range(9):
        light.take({LEFT: None}, Shot(), (1.0, 1.0), 1.0)
    assert light.shot([LEFT], LEG, 0.8) == Shot(1.0, 1.0, 0.8)
