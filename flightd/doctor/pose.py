"""Whether the autopilot's own estimator takes our motion."""

from __future__ import annotations

from flightd.core.types import PoseUse
from flightd.doctor.check import Check, ok, warning


def check_pose(use: PoseUse) -> list[Check]:
    """One line, none where it is not to be told of our motion."""
    name, remedy = "pose", "set what is named of its parameters; without, it flies as well as its attitude is"
    match use:
        case PoseUse.NONE:
            return []
        case PoseUse.GIVEN:
            return [ok(name, "the autopilot's estimator takes our motion")]
        case PoseUse.NOT_TAKEN:
            return [warning(name, "the autopilot's estimator does not take our motion", remedy)]
        case PoseUse.UNKNOWN:
            text = "its parameters do not say whether the autopilot's estimator takes our motion"
            return [warning(name, text, remedy)]
