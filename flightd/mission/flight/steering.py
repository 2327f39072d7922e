"""What the mission wants, as a setpoint: by control, within the limits.  Pure."""

from __future__ import annotations

import math
from dataclasses import replace

from flightd.config.control import ControlConfig
from flightd.control.flight_controller import CALM, Conditions, FlightController, Motion
from flightd.control.limits import Limiter, Surroundings
from flightd.control.oscillation import LEAST_EASE
from flightd.core.geometry import wrap_pi
from flightd.core.types import AttitudeSetpoint, GridPose, Phase
from flightd.mission.guidance import Guidance, Guide, MissionInputs
from flightd.mission.safety.plausibility_monitor import PlausibilityMonitor
from flightd.tracking.carried_motion import NO_LEAD, Lead

_TOUCHDOWN_S = 2.0
_LOW_M, _LANDS_LEAN_RAD = 0.5, math.radians(5.0)
"""Below this height a landing leans by no more: it may stand already, which is known a second later.  Nor,
above its pad, by what it no longer sees."""

_LEAST_HASTE = 0.4
"""Where pictures and what answers them are late, or may be later than is known, a lean that changes fast
makes lines seem to move: whoever steers by them changes it by no less than this share of what is
configured."""


class Steering:
    """Call `step` at each tick."""

    def __init__(self, config: ControlConfig, plausibility: PlausibilityMonitor) -> None:
        self._control = FlightController(config)
        self._limiter = Limiter(config)
        self._stale_s = config.expert.stale_s
        self._plausibility = plausibility
        self._last_yaw: float | None = None
        self._yaw_rate = 0.0
        self._lands_low = False

    def step(
        self,
        inputs: MissionInputs,
        guidance: Guidance,
        push: tuple[float, float],
        stand_yaw_rad: float,
        lead: Lead = NO_LEAD,
        conditions: Conditions = CALM,
    ) -> AttitudeSetpoint | None:
        """What control makes of the guidance, within the limits; None when nothing may be sent.  `push` is
        the acceleration that no lean explains, m/s2, grid axes; `stand_yaw_rad` the heading before there is a
        pose; `lead` what the motion changes by until the setpoint has most of its effect: it is made for
        then, under those `conditions`."""
        now_ns, dt_s, pose = inputs.now_ns, inputs.dt_s, inputs.pose
        height_m = self._plausibility.height_m(inputs.height_m)
        motion = self._motion(pose, height_m, dt_s, stand_yaw_rad, lead)
        control, reference = self._control, guidance.reference.after(lead.after_s)
        sight_s, ease = min(inputs.x_age_s, inputs.y_age_s), self._plausibility.oscillation.ease
        rises, blind = guidance.phase is Phase.TAKE_OFF, conditions.blind_mps2
        # since a leap the speed is dead-reckoned by what is known of the attitude
        by_unleant = rises or (conditions.leapt and guidance.dead_reckoned)
        if guidance.guide is Guide.NONE:
            control.reset()
            return None
        if guidance.guide is Guide.LEVEL or pose is None:
            wanted, age_s = control.level(now_ns, motion, reference, dt_s, conditions.level_rad), 0.0
        elif guidance.guide is Guide.BRAKE:  # in a take-off while least is known of push and lateness
            wanted = control.rest(
                now_ns,
                motion,
                reference,
                dt_s,
                conditions.unleant_mps2 if by_unleant else (push[0] + blind[0], push[1] + blind[1]),
                dead_reckoned=guidance.dead_reckoned,
                ease=min(ease, conditions.ease) if rises else ease,
            )
            age_s = min(inputs.telemetry_age_s, inputs.sight_s)
        else:
            eased = replace(conditions, ease=max(conditions.ease * ease, min(ease, LEAST_EASE)))
            wanted = control.step(now_ns, motion, reference, dt_s, eased)
            # above the pad the mission steers on without lines: by the mat, or the motion last known
            by_mat = inputs.by_pad or (guidance.phase is Phase.LAND and sight_s < _TOUCHDOWN_S)
            age_s = inputs.telemetry_age_s if by_mat else max(sight_s, inputs.telemetry_age_s)
        by_sight = guidance.guide is Guide.STEER or (rises and guidance.guide is Guide.BRAKE)
        # what reads nothing is as low as it was
        low = height_m < _LOW_M or (self._lands_low and math.isnan(height_m))
        lands = guidance.phase is Phase.LAND
        self._lands_low = low and lands
        unseen = lands and guidance.guide is Guide.STEER and sight_s > self._stale_s
        back = None
        if inputs.localised:
            back = self._plausibility.back(pose, inputs.warnings.line_m, inputs.believed_height_m)
        around = Surroundings(
            headroom_m=inputs.warnings.headroom_m,
            back=back,
            data_age_s=age_s,
            at_once=guidance.at_once,
            most_lean_rad=_LANDS_LEAN_RAD if self._lands_low or unseen else math.inf,
            climb_error_mps=inputs.warnings.climb_error_mps,
            haste=max(conditions.ease**2, _LEAST_HASTE) if by_sight else 1.0,
        )
        return self._limiter.apply(wanted, around)

    def _motion(
        self, pose: GridPose | None, height_m: float, dt_s: float, stand_yaw_rad: float, lead: Lead
    ) -> Motion:
        if pose is None:
            return Motion(0.0, 0.0, 0.0, 0.0, stand_yaw_rad, 0.0, height_m)
        if self._last_yaw is not None:
            turned = math.remainder(pose.yaw_rad - self._last_yaw, math.tau)
            self._yaw_rate += min(1.0, dt_s / 0.05) * (turned / dt_s - self._yaw_rate)
        self._last_yaw = pose.yaw_rad
        return Motion(
            pose.x_m + lead.x_m,
            pose.y_m + lead.y_m,
            pose.vx_mps + lead.vx_mps,
            pose.vy_mps + lead.vy_mps,
            wrap_pi(pose.yaw_rad + lead.yaw_rad),
            self._yaw_rate,
            height_m,
        )
