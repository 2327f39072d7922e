from __future__ import annotations

from typing import Any

import pytest

from flightd.config.vehicle import VehicleConfig
from flightd.core.types import PoseUse
from flightd.doctor.check import CheckLevel
from flightd.doctor.pose import check_pose


@pytest.mark.parametrize(
    ("vehicle", "use", "level", "words"),
    [
        ({}, PoseUse.GIVEN, CheckLevel.OK, "takes our motion"),
        ({}, PoseUse.NOT_TAKEN, CheckLevel.WARNING, "does not take our motion"),
        ({}, PoseUse.UNKNOWN, CheckLevel.WARNING, "not known yet whether"),
        ({"kind": "px4"}, PoseUse.NOT_TAKEN, CheckLevel.OK, "does not take our motion"),
        ({"kind": "px4"}, PoseUse.UNKNOWN, CheckLevel.OK, "not known yet whether"),
        ({"kind": "px4", "pose_output": "odometry"}, PoseUse.UNKNOWN, CheckLevel.WARNING, "not known yet"),
    ],
)
def test_what_becomes_of_our_motion_is_told_in_a_line(
    vehicle: dict[str, str], use: PoseUse, level: CheckLevel, words: str
) -> None:
    (check,) = check_pose(VehicleConfig.model_validate(vehicle), use)
    assert (check.level, words in check.text) == (level, True)
    assert bool(check.remedy) is (level is CheckLevel.WARNING)


GUIDED = {"flying_mode": "guided"}
HALL = {"origin_deg": [48.1, 11.6]}


@pytest.mark.parametrize(
    ("vehicle", "use", "told"),
    [
        (GUIDED, PoseUse.GIVEN, True),
        (GUIDED, PoseUse.UNKNOWN, True),
        (GUIDED, PoseUse.NOT_TAKEN, False),  # it gets no origin
        (GUIDED | HALL, PoseUse.GIVEN, False),
        (GUIDED | {"pose_output": "none"}, PoseUse.NONE, False),
        ({}, PoseUse.GIVEN, False),
    ],
)
def test_an_origin_left_as_shipped_is_told_where_it_is_sent(
    vehicle: dict[str, Any], use: PoseUse, told: bool
) -> None:
    checks = check_pose(VehicleConfig.model_validate(vehicle), use)
    origins = [check for check in checks if check.name == "origin"]
    assert [(check.level, "vehicle.origin_deg" in check.text) for check in origins] == (
        [(CheckLevel.WARNING, True)] if told else []
    )
    assert all("latitude and longitude" in check.remedy for check in origins)


def test_of_one_that_is_not_to_be_told_nothing_is_said() -> None:
    assert check_pose(VehicleConfig(pose_output="none"), PoseUse.NONE) == []
