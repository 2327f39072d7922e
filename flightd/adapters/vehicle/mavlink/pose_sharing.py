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
_STANDS_BELOW_M, _MOST_ON_FLOOR_M = 0.3, 0.5
"""What is read of an armed one that stands, and the most that any range finder reads on the floor."""
_PAD_PERIOD_NS = 33_333_333


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
        self._flown = False
        """Since it was armed it was in the air."""
        self._pad_due_ns = 0

    @property
    def needed_names(self) -> tuple[tuple[str, ...], ...]:
        """The parameters without which nothing is told, each by all its names."""
        if self._output is None:
            return ()
        return tuple(rule.names for rule in self._rules if not rule.optional)

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
        """What is due now: that it stands, or what a new frame showed, and the pad while it is near.  A frame
        that shows the pad's mat but no line tells no motion, and so no pad: what would be sent in its place
        is carried on by the autopilot's own word, which its estimator carries on itself."""
        output = self._output
        self._flown = state.armed and (self._flown or pose is not None or state.landed is LandedState.IN_AIR)
        stands = self._stands(state)
        if output is None or not (stands or pose is not None) or self.use is not PoseUse.GIVEN:
            return
        if stands:
            message = output.make_standing(now_ns, state.attitude, state.height_m)
        elif pose is not None:
            message = output.make(now_ns, pose, state.climb_mps)
        else:
            message = None
        if message is not None:
            yield message
        if pose is None or pad_m is None or now_ns < self._pad_due_ns:
            return
        if math.dist(pad_m, (pose.x_m, pose.y_m)) < _PAD_NEAR_M:
            self._pad_due_ns = max(self._pad_due_ns + _PAD_PERIOD_NS, now_ns + _PAD_PERIOD_NS // 2)
            yield landing_target(self._firmware, pose, pad_m, output.at_place(pose, pad_m))

    def _stands(self, state: VehicleState) -> bool:
        """It is not armed, or says that it stands, and its range finder does not contradict.  One that flew
        and tells no height may say so in a descent of little thrust."""
        if not state.armed:
            return not state.height_m > _MOST_ON_FLOOR_M
        unmeasured = math.isnan(state.height_m) and not self._flown
        return state.landed is LandedState.ON_GROUND and (state.height_m <= _STANDS_BELOW_M or unmeasured)


def pose_use(rules: tuple[Rule, ...], read: Read) -> PoseUse:
    """What becomes of our motion by an autopilot's parameters: those `rules` that are optional have to fit
    where it has them."""
    use = PoseUse.GIVEN
    for rule in rules:
        found = read(rule.names)
        if found is None and not rule.optional:
            return PoseUse.UNKNOWN
        if judge(rule, found) is not None:
            use = PoseUse.NOT_TAKEN
    return use
