"""Where the drone is led: the reference in all axes, and what control is to make of it.  Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flightd.config.schema import Config
from flightd.control.flight_controller import Reference
from flightd.control.motion_profile import Profile
from flightd.core.geometry import wrap_pi
from flightd.core.types import Demand, LandedState, Phase
from flightd.mission.flight.relocation import Relocator
from flightd.mission.flight.touchdown import ReckonedHeight, Standstill, Touchdown, UnheardDescent
from flightd.mission.guidance import Guidance, Guide, MissionInputs
from flightd.mission.machine import State
from flightd.mission.plan.flight_plan import Stop
from flightd.mission.safety.hazard_monitor import HazardMonitor
from flightd.mission.safety.low_keep_outs import LowKeepOuts
from flightd.mission.scan.views import View
from flightd.site.site import Site

_DEMANDS = {
    Phase.PREFLIGHT: Demand.STANDBY,
    Phase.SWAP: Demand.STANDBY,
    Phase.DONE: Demand.DISARM,
    Phase.ABORTED: Demand.DISARM,
    Phase.PILOT: Demand.HANDS_OFF,
}
"""Of the vehicle, while nothing is flown."""
_BY_PAD = {Phase.TAKE_OFF, Phase.ACQUIRE, Phase.HOLD}
_TO_GOAL = (Phase.FOLLOW, Phase.HOVER)
_SETTLE_S, _SETTLE_UNMEASURED_S = 3.0, 0.6
"""The most that a landing waits for the drone to come to rest, and where no height tells whether it stays at
that."""
_REST_MPS = 0.15
# the autopilots themselves say after a second that they stand
_OWN_LANDING_S, _DISARM_S = 2.5, 5.5
"""Down and still for so long: have the autopilot land by itself, ask it to disarm."""
_RISES_MPS = 0.2
"""One that takes its climb for so much less than it is lands by itself too slowly, or rises off the floor."""
_HURRY, _HURRY_ACCEL = 4.0 / 3.0, 2.0
"""How much faster than usual a take-off out of sight climbs, within the limits, and how much harder."""
_BEYOND_M = 0.05
"""A climb that would end so far above its goal, which has come down meanwhile, is stopped as hard."""


@dataclass(frozen=True, slots=True)
class ReferenceTask:
    """What the mission is at: its state, whose phase is flown for `phase_s`, the stop it is for and the view
    from there; `cruise` flies at the height of the plan rather than at that of the last view."""

    state: State
    phase_s: float
    goal: Stop
    view: View | None
    cruise: bool

    @property
    def phase(self) -> Phase:
        return self.state.phase


class ReferenceGenerator:
    """The reference of a flying drone: call `step` at each tick in the air."""

    def __init__(
        self,
        config: Config,
        site: Site,
        monitor: HazardMonitor,
        relocator: Relocator,
        start: tuple[float, float, float],
    ) -> None:
        """`start` is the place on the map, m, and the heading, rad, before the first flight."""
        p = config.mission
        self._params = p
        self._hazards = config.hazards
        self._ceiling_m = site.ceiling_m
        self._monitor = monitor
        self._blind = monitor.blind
        self._relocator = relocator
        self._low = LowKeepOuts(site, p)
        self._seeks_place = False
        self._reckoned = ReckonedHeight()
        self._touchdown = Touchdown(p, self._reckoned)
        self._standstill = Standstill(p)
        self._unheard = UnheardDescent(p)
        self._still_s = 0.0
        self._sinks = False
        self._by_itself = False
        self._stood = False
        self.anchor = (start[0], start[1])
        """Where it holds when no stop is flown to."""
        self._steers = False
        self.height_goal_m = 0.0
        """The height above the floor that is flown at or made for."""
        self._cruise_m = p.height_m
        self._lost_at_m = 0.0
        """Where a take-off saw a line last."""
        self._x = Profile(start[0], p.speed_mps, p.accel_mps2)
        self._y = Profile(start[1], p.speed_mps, p.accel_mps2)
        self._yaw = Profile(start[2], p.turn_rate_radps, p.expert.turn_accel_radps2)
        self._height = Profile(0.0, p.climb_mps, p.expert.climb_accel_mps2)
        self._hurried = Profile(0.0, _HURRY * p.climb_mps, _HURRY_ACCEL * p.expert.climb_accel_mps2)

    def take_off(self, height_m: float) -> None:
        """A climb begins from here."""
        self._steers = False
        self._lost_at_m = 0.0 if math.isnan(height_m) else height_m
        self._height.reset(self._lost_at_m)

    def land(self, *, by_itself: bool = False) -> None:
        """A landing begins; `by_itself`: the autopilot's own."""
        self._touchdown.begin()
        self._seeks_place = True
        self.height_goal_m = 0.0
        self._standstill.begin()
        self._still_s = 0.0
        self._sinks = False
        self._by_itself = by_itself
        self._stood = False

    def begin_anew(self) -> None:
        """Start the reference at the drone, which is not where it was believed to be."""
        self._steers = False

    def on_ground(self, s: MissionInputs, phase: Phase) -> Guidance:
        """What is wanted while nothing is flown."""
        demand = _DEMANDS.get(phase, Demand.FLY)
        if demand is Demand.DISARM and s.vehicle is not None and s.vehicle.may_fly:
            demand = Demand.LAND
        if s.vehicle is not None and not s.vehicle.armed:
            self._standstill.stands(s.height_m)
        return Guidance(phase, Guide.NONE, self._reference(0.0), demand)

    def step(self, s: MissionInputs, task: ReferenceTask) -> Guidance:
        """Move the reference on by one tick."""
        demand = Demand.KEEP if task.phase is Phase.RECOVER else Demand.FLY
        self._reckoned.step(s)
        self._steers = not (task.state.stopped or task.state.adopted) and self._steer(s, task)
        if task.phase is Phase.LAND:
            climb, demand = self._descend(s, task)
        elif task.phase is Phase.RECOVER:
            self._height.reset(0.0 if math.isnan(s.height_m) else s.height_m)
            climb = 0.0
        elif (
            math.isnan(s.height_m)
            or s.telemetry_age_s > self._params.telemetry_hold_s
            or s.warnings.height_doubted
            or (task.phase is Phase.TAKE_OFF and self._monitor.climbs_no_further(s))
        ):
            self._height.reset(self._height.position)  # no climb by heights of the past, nor blind
            climb = 0.0
        elif task.phase is Phase.HOLD and self._blind.is_blind:
            climb = -self._blind.sink_mps(s.height_m, self._low.floor_m(s))
            self._height.reset(s.height_m, climb)
        else:
            climb = self._climb_mps(s, task)
        guide = Guide.STEER if self._steers else Guide.BRAKE if self._may_brake(s, task) else Guide.LEVEL
        stands = self._unheard.step(s, -climb) or self._standstill.touches
        if task.phase is Phase.LAND and stands:
            guide = Guide.LEVEL
        dead_reckoned = s.sight_s < self._hazards.expert.brake_s
        return Guidance(task.phase, guide, self._reference(climb), demand, dead_reckoned, task.state.stopped)

    def _climb_mps(self, s: MissionInputs, task: ReferenceTask) -> float:
        """Climb rate towards the wanted height.  A take-off that drifts where no line tells how hurries: the
        picture has to widen faster than it leaves the lines behind; so does the end of a climb to a height
        that is no longer wanted."""
        expert, height, hurried = self._params.expert, self._height, self._hurried
        self.height_goal_m = self._wanted_height_m(s, task)
        rises = task.phase is Phase.TAKE_OFF and s.height_m >= expert.steer_above_m
        climb_mps = max(height.velocity, 0.0)
        ends_m = height.position + climb_mps**2 / (2.0 * expert.climb_accel_mps2)
        ends_beyond = climb_mps > 0.0 and ends_m > self.height_goal_m + _BEYOND_M
        if ends_beyond or (rises and not self._steers):
            hurried.reset(height.position, height.velocity)
            hurried.step(self.height_goal_m, s.dt_s, climb_mps if ends_beyond else math.inf)
            height.reset(hurried.position, hurried.velocity)
        else:
            height.step(self.height_goal_m, s.dt_s)
        return height.velocity

    def _may_brake(self, s: MissionInputs, task: ReferenceTask) -> bool:
        """Without a view of the floor, but with an attitude by which to dead-reckon from the last one; or,
        the other way round, with a view to brake by while the vehicle is not heard.  A take-off brakes by
        what it sees alone."""
        p = self._params
        heard = s.telemetry_age_s <= p.telemetry_hold_s
        seen = s.sight_s <= p.lines_hold_s
        rises = task.phase is Phase.TAKE_OFF
        told = heard and seen and s.height_m >= p.expert.steer_above_m if rises else heard or seen
        return told and s.pose is not None and not (task.state.adopted or task.state.stopped)

    def _wanted_height_m(self, s: MissionInputs, task: ReferenceTask) -> float:
        """Flying height; only a little more in search of lines that stay lost, in a take-off too."""
        p, h = self._params, self._hazards
        if task.phase is Phase.TAKE_OFF:
            sees = s.by_pad or min(s.x_age_s, s.y_age_s) <= p.lines_hold_s
            if sees or s.height_m < self._monitor.sees_from_m:
                self._lost_at_m = s.height_m
                return self._height_goal_m(task)
            return min(self._height_goal_m(task), self._lost_at_m + h.expert.search_climb_m)
        if task.phase is Phase.RELOCATE:
            return self._relocator.height_m(self._height_goal_m(task))
        if task.phase is not Phase.HOLD or self._monitor.unseen_s < h.expert.search_s:
            return self._height_goal_m(task)
        highest_m = max(p.height_m, self._ceiling_m - h.headroom_m)
        return min(self._relocator.raised_m(self._height_goal_m(task), h.expert.search_climb_m), highest_m)

    def _descend(self, s: MissionInputs, task: ReferenceTask) -> tuple[float, Demand]:
        """Climb rate and demand of a landing: at rest first, unless stopped or out of sight; down until
        the vehicle says that it stands, or does so without a word; then disarm."""
        p, v = self._params, s.vehicle
        self._still_s = self._standstill.step(s, sinks=self._sinks)
        self._sinks = False
        moving = self._steers and s.speed_mps > _REST_MPS and not self._standstill.touches
        settle_s = _SETTLE_UNMEASURED_S if math.isnan(s.height_m) else _SETTLE_S
        waits = moving and task.phase_s < settle_s
        aside = self._steers and not self._by_itself and self._low.is_on_way(s, self.anchor)
        if not task.state.on_pad and (waits or aside):
            self._height.reset(self._height.position)
            return 0.0, Demand.FLY
        top_m = self._low.top_m(s)
        rate = self._touchdown.rate_mps(s, _target(s, task))
        if rate > 0.0 and not self._steers:  # what drifts unseen should not do so for long
            rate = self._blind.rate_mps(self._unheard.height_m(s) - top_m)
        elif top_m > 0.0 and not s.believed_height_m > top_m + p.expert.touch_below_m:
            rate = min(rate, p.expert.touch_mps)
        self._height.reset(0.0 if math.isnan(s.height_m) else s.height_m, -rate)
        self._sinks = rate > 0.0
        deaf = s.telemetry_age_s > p.telemetry_land_s
        unsteered = v is not None and math.isnan(v.climb_mps) and not v.keeps_climb
        self._by_itself |= unsteered  # nothing takes it back out of its own landing
        standing = v is not None and v.landed is LandedState.ON_GROUND and not deaf
        standing = standing or self._still_s > _DISARM_S
        self._stood |= standing  # from then on nothing takes it out of its own landing any more
        rests = self._still_s > _OWN_LANDING_S and s.warnings.climb_error_mps > -_RISES_MPS
        by_itself = deaf or task.state.adopted or self._by_itself or self._stood or rests
        return -rate, Demand.DISARM if standing else Demand.LAND if by_itself else Demand.FLY

    def _steer(self, s: MissionInputs, task: ReferenceTask) -> bool:
        """Move the reference towards where the phase wants it; False when the floor cannot be relied on."""
        p, pose, phase = self._params, s.pose, task.phase
        too_low = phase is Phase.TAKE_OFF and s.height_m < p.expert.steer_above_m
        unseen_s = self._touchdown.unseen_s(s, _target(s, task))
        stale = min(s.x_age_s, s.y_age_s) > unseen_s or s.telemetry_age_s > p.telemetry_hold_s
        unknown = not (s.by_pad and phase in _BY_PAD) and (stale or not s.localised)
        if pose is None or unknown or too_low:
            return False
        if phase is Phase.LAND and not task.state.on_pad and (self._seeks_place or not self._steers):
            self.anchor = self._low.landing_place(s, self.anchor)
            self._seeks_place = False
        if not self._steers:
            self._x.reset(pose.x_m, pose.vx_mps)
            self._y.reset(pose.y_m, pose.vy_mps)
            self._yaw.reset(pose.yaw_rad)
        if phase is Phase.RELOCATE:
            self.anchor = self._relocator.next_look(s, self.anchor)
        to_goal = phase in _TO_GOAL or task.state.on_pad
        at = _target(s, task) or ((task.goal.x_m, task.goal.y_m) if to_goal else self.anchor)
        x, y, yaw = (*at, task.goal.yaw_rad)
        if task.view is not None:
            x, y, yaw = task.view.x_m, task.view.y_m, task.view.yaw_rad
        if math.hypot(self._x.position - pose.x_m, self._y.position - pose.y_m) < p.expert.max_lead_m:
            speed_mps = task.goal.speed_mps if phase is Phase.FOLLOW else math.inf
            self._x.step(x, s.dt_s, speed_mps)
            self._y.step(y, s.dt_s, speed_mps)
        else:  # wait for the vehicle at rest: a speed kept here would be fed forward and hold it off
            self._x.brake(s.dt_s)
            self._y.brake(s.dt_s)
        if to_goal or task.view is not None or phase is Phase.TURN:
            self._yaw.step(self._yaw.position + wrap_pi(yaw - self._yaw.position), s.dt_s)
        else:  # a turn that is broken off comes to rest
            self._yaw.brake(s.dt_s)
        return True

    def _height_goal_m(self, task: ReferenceTask) -> float:
        """The view's height while scanning, that of a leg past a shelf; the legs between an aisle's scanned
        nodes are flown at the last one's, unless a doubt on the way asks for a wider view."""
        if task.view is not None:
            self._cruise_m = task.view.height_m
        elif task.phase is Phase.RELOCATE:
            self._cruise_m = max(self._cruise_m, self._params.height_m)
        elif task.goal.sweep is not None and not task.state.on_pad:
            self._cruise_m = task.goal.sweep.height_m
        elif task.cruise:
            self._cruise_m = self._params.height_m
        return self._cruise_m

    def _reference(self, climb_mps: float) -> Reference:
        return Reference(
            x_m=self._x.position,
            y_m=self._y.position,
            yaw_rad=self._yaw.position,
            height_m=self._height.position,
            vx_mps=self._x.velocity,
            vy_mps=self._y.velocity,
            ax_mps2=self._x.acceleration,
            ay_mps2=self._y.acceleration,
            yaw_rate_radps=self._yaw.velocity,
            climb_mps=climb_mps,
        )


def _target(s: MissionInputs, task: ReferenceTask) -> tuple[float, float] | None:
    """The pad to come down on; None while it lands on none."""
    return (s.pad_m or (task.goal.x_m, task.goal.y_m)) if task.state.on_pad else None
