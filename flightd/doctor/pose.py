"""Whether the autopilot's own estimator takes our motion, and where on earth it believes to be."""

from __future__ import annotations

from flightd.config.vehicle import VehicleConfig
from flightd.core.types import PoseUse
from flightd.doctor.check import Check, ok, warning


def check_pose(config: VehicleConfig, use: PoseUse) -> list[Check]:
    """A line, none where it is not to be told of our motion, and one on an origin that was left as shipped.
    A PX4 that is left the choice flies as well without."""
    if use is PoseUse.NONE:
        return []
    return [_judge_use(config, use), *([] if use is PoseUse.NOT_TAKEN else _judge_origin(config))]


def _judge_origin(config: VehicleConfig) -> list[Check]:
    """An origin goes to an estimator that takes our motion, and to no other."""
    if not config.sends_default_origin:
        return []
    text = "vehicle.origin_deg is the shipped default: elsewhere on earth arming is refused (Check mag field)"
    return [warning("origin", text, "set it to the hall's latitude and longitude")]


def _judge_use(config: VehicleConfig, use: PoseUse) -> Check:
    if use is PoseUse.GIVEN:
        return ok("pose", "the autopilot's estimator takes our motion")
    if use is PoseUse.UNKNOWN:
        text = "it is not known yet whether the autopilot's estimator takes our motion"
        remedy = "check again; if it stays so, its firmware does not have a parameter that is needed"
    else:
        text = "the autopilot's estimator does not take our motion"
        remedy = "set what is named of its parameters"
    if config.kind == "px4" and config.pose_output == "auto":
        return ok("pose", text)
    return warning("pose", text, remedy)
