from __future__ import annotations

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


def test_of_one_that_is_not_to_be_told_nothing_is_said() -> None:
    assert check_pose(VehicleConfig(pose_output="none"), PoseUse.NONE) == []
