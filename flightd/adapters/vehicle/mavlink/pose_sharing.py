"""Whether, when and what the autopilot's estimator is told of our motion."""

from __future__ import annotations

import math
from collections.abc import Iterator

from flightd.adapters.vehicle.mavlink.link.codec import Message
from flightd.adapters.vehicle.mavlink.link.connection import Firmware
from flightd.adapters.vehicle.mavlink.parameter_rule import Read, Rule, judge
from flightd.adapters.vehicle.mavlink.pose_output import PoseForm, PoseOutput, landing_target
from flightd.core.shared_pose import SharedPose
from flightd.core.types import LandedState, PoseUse, VehicleState

_PAD_NEAR_M = 1.0
"""Further away the pad is not shown: a landing of last resort must not set out for it."""
_STANDS_BELOW_M = 0.3


class PoseSharing:
    """Call `messages` at each tick.  Nothing goes out with `form` None, nor before the autopilot's parameters
    were read and fit all `rules` but those that are optional."""

    def __init__(
        self,
        form: PoseForm | None,
        firmware: Firmware,
        rules: tuple[Rule, ...],
        read: Read,
    ) -> None:
        self._output = None if form is None else PoseOutput(form, firmware)
        self._firmware, self._rules, self._read = firmware, rules, read

    @property
    def use(self) -> PoseUse:
        """What becomes of our motion, by what is known of the autopilot's parameters."""
        if self._output is None:
            return PoseUse.NONE
        return pose_use(self._rules, self._read)

    def messages(
        self,
        now_ns: int,
        state: VehicleState,
        pose: SharedPose | None,
        pad_m: tuple[float, float] | None,
    ) -> Iterator[Message]:
        """What is due now: that it stands, or what a new frame showed, and the pad while it is near."""
        output = self._output
        if output is None or self.use is not PoseUse.GIVEN:
            return
        if _stands(state):
            message = output.make_standing(now_ns, state.attitude, state.height_m)
        elif pose is not None:
            message = output.make(now_ns, pose, state.climb_mps)
        else:
            message = None
        if message is None:
            return
        yield message
        if pose is not None and pad_m is not None and math.dist(pad_m, (pose.x_m, pose.y_m)) < _PAD_NEAR_M:
            yield landing_target(self._firmware, pose, pad_m, output.at_place(pose, pad_m))


def pose_use(rules: tuple[Rule, ...], read: Read) -> PoseUse:
    """What becomes of our motion by an autopilot's parameters, of those `rules` that are not optional."""
    needed = [(rule, read(rule.names)) for rule in rules if not rule.optional]
    if any(value is None for _, value in needed):
        return PoseUse.UNKNOWN
    fits = all(judge(rule, value) is None for rule, value in needed)
    return PoseUse.GIVEN if fits else PoseUse.NOT_TAKEN


def _stands(state: VehicleState) -> bool:
    """It says so, or is not armed, and its range finder does not contradict."""
    on_floor = not state.armed or state.landed is LandedState.ON_GROUND
    return on_floor and not state.height_m > _STANDS_BELOW_M
