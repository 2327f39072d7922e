"""What stands below the legs: where nothing sinks, and where beside it a landing goes."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from flightd.core.types import GridPose
from flightd.mission.guidance import MissionInputs
from flightd.mission.safety.low_keep_outs import LowKeepOuts
from flightd.site.corridor import Corridor
from flightd.site.site_file import load_site
from flightd.site.ways import KeepOut
from tests.unit.mission.configured import configured

PARAMS = configured().mission
DEMO = load_site(Path(__file__).parents[3] / "configs" / "site-demo.toml")
A, B = DEMO.aisle_nodes(DEMO.aisles[0].id)[1:3]
MIDDLE_M = (A.x_m + B.x_m) / 2
CONVEYOR = KeepOut(MIDDLE_M - 0.3, A.y_m - 1.0, MIDDLE_M + 0.3, A.y_m + 1.0, 0.0, 1.0)
GANTRY = KeepOut(-1e3, -1e3, 1e3, 1e3, 2.5)
SITE = replace(DEMO, keep_outs=(CONVEYOR, GANTRY)).between(1.2, 2.0)
LOW = LowKeepOuts(SITE, PARAMS)


def at(x_m: float, y_m: float, sigma_m: float = 0.02, integrity: float = 1.0) -> MissionInputs:
    covariance = (sigma_m**2, 0.0, 0.0, 0.0, sigma_m**2, 0.0, 0.0, 0.0, 1e-4)
    pose = GridPose(0, A.id, 0.0, 0.0, 0.0, x_m, y_m, 0.0, 0.0, 1.6, covariance, integrity)
    return MissionInputs(0, 0.02, pose, True, 1.6, True, 0.0, 0.0, 0.0, None)


def test_a_leg_over_it_stays_open_and_it_is_still_known() -> None:
    assert SITE.keep_outs == ()
    assert SITE.low_keep_outs == (CONVEYOR,)
    assert SITE.between(1.2, 2.0).low_keep_outs == (CONVEYOR,)
    assert replace(DEMO, keep_outs=(CONVEYOR,)).between(0.5, 2.0).low_keep_outs == ()


@pytest.mark.parametrize(
    ("inputs", "floor_m"),
    [
        (at(MIDDLE_M, A.y_m), 1.3),
        (at(CONVEYOR.x1_m + 0.25, A.y_m), 1.3),
        (at(CONVEYOR.x1_m + 0.5, A.y_m), 0.0),
        (at(CONVEYOR.x1_m + 0.5, A.y_m, sigma_m=0.15), 1.3),
        (at(CONVEYOR.x1_m + 50.0, A.y_m, integrity=0.6), 1.3),
        (replace(at(0.0, 0.0), pose=None), 1.3),
    ],
    ids=["over it", "near it", "beside it", "not well known", "maybe elsewhere", "nowhere"],
)
def test_nothing_sinks_into_it_to_wait(inputs: MissionInputs, floor_m: float) -> None:
    assert LOW.floor_m(inputs) == pytest.approx(floor_m)
    assert LowKeepOuts(DEMO, PARAMS).floor_m(inputs) == 0.0


def test_a_landing_goes_along_its_line_to_the_nearer_side() -> None:
    inputs = at(MIDDLE_M + 0.1, A.y_m)
    place = LOW.landing_place(inputs, (MIDDLE_M + 0.1, A.y_m + 0.05))
    assert place == pytest.approx((CONVEYOR.x1_m + 0.6, A.y_m), abs=1e-3)
    assert LOW.is_on_way(inputs, place)
    assert not LOW.is_on_way(at(*place), place)
    free = (CONVEYOR.x0_m - 0.65, A.y_m)
    assert LOW.landing_place(at(*free), free) == free, "the floor is free there"


def test_without_a_sure_place_or_a_free_one_near_it_stays_where_it_is() -> None:
    here = MIDDLE_M, A.y_m
    assert LOW.landing_place(at(*here, integrity=0.6), here) == here
    all_along = replace(CONVEYOR, x0_m=MIDDLE_M - 8.0, x1_m=MIDDLE_M + 8.0, y0_m=-1e3, y1_m=1e3)
    long = LowKeepOuts(replace(DEMO, keep_outs=(all_along,)).between(1.2, 2.0), PARAMS)
    assert long.landing_place(at(*here), here) == here
    assert not long.is_on_way(at(*here), here)


def test_who_is_as_low_as_it_does_not_lean_towards_it() -> None:
    corridor = Corridor(SITE, 5.0)
    beside = CONVEYOR.x1_m + 0.2, A.y_m, 0.0, 0.0
    assert corridor.back(*beside, height_m=1.6) is None
    assert corridor.back(*beside, height_m=0.8) == pytest.approx((1.0, 0.0))
    assert corridor.back(*beside, height_m=math.nan) == pytest.approx((1.0, 0.0))
    assert corridor.back(MIDDLE_M, A.y_m, 0.0, 0.0, height_m=0.8) is None, "above it there is no side to it"
