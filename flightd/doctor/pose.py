"""Whether the autopilot's own estimator takes our motion."""

from __future__ import annotations

from flightd.core.types import PoseUse
from flightd.doctor.check import Check, ok, warning


def check_pose(use: PoseUse) -> list[Check]:
    """One line, none where it is not to be told of our motion."""
    if use is PoseUse.NONE:
        return []
    if use is PoseUse.GIVEN:
        return [ok("pose", "the autopilot's estimator takes our motion")]
    text = "the autopilot's estimator does not take our motion"
    return [warning("pose", text, "set what is named of its parameters")]
