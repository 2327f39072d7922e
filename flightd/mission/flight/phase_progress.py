"""When a phase of the mission has reached its end, and how long it may take.  Pure."""

from __future__ import annotations

import math

from flightd.config.schema import Config
from flightd.core.geometry import wrap_pi
from flightd.core.types import Phase
from flightd.mission.debounce_timer import DebounceTimer
from flightd.mission.flight.smoothed_motion import SmoothedMotion
from flightd.mission.flight.touchdown import AIM_S
from flightd.mission.guidance import MissionInputs
from flightd.mission.machine import State
from flightd.mission.plan.itinerary import Itinerary
from flightd.mission.plan.sweep_leg import SweepLeg
from flightd.mission.safety.found_flying import FoundFlyingCheck
from flightd.mission.scan.no_scan import AnyScanner
from flightd.mission.scan.shelf_scan import ShelfScan
from flightd.mission.scan.views import View
from flightd.mission.triggers import Trigger

_READING_S = 0.8
"""At the end of the last leg past a shelf its pictures are still being read."""


_WIDENS, _WIDEST = (0.2, 0.7), 3.0
"""Between these parts of a phase's slack the bounds within which a goal is reached grow to so many
times their width: gusts swing a drone about its place for as long as they last."""
_MISSED = 0.8
"""After this part of it a view is given up."""
_LINGERS_M = 0.25
"""So far on a leg's first place is still seen well enough to count."""


class PhaseProgress:
    """The phase in hand: call `begin` when it changes, then `step` at each tick."""

    def __init__(self, config: Config, itinerary: Itinerary, scan: ShelfScan, scanner: AnyScanner) -> None:
        self._params = config.mission
        self._battery = config.battery
        lingers_s = math.sqrt(2.0 * _LINGERS_M / config.mission.accel_mps2)
        self._stands_s = config.scan.pictures / config.front_camera.fps - lingers_s
        self._itinerary = itinerary
        self._scan = scan
        self._scanner = scanner
        self._found_flying = FoundFlyingCheck(config.mission)
        self._settling = DebounceTimer()
        self._motion = SmoothedMotion()
        self._limit_s = math.inf
        self._since_ns = 0

    def begin(self, s: MissionInputs, phase: Phase, *, goes_on: bool = False) -> None:
        """A phase begins; one that `goes_on` only gets all of its time once more."""
        if not goes_on:
            self._since_ns = s.now_ns
            self._settling = DebounceTimer()
        self._limit_s = self.phase_s(s.now_ns) + self._time_limit_s(s, phase)

    def phase_s(self, now_ns: int) -> float:
        """Time since the phase began."""
        return (now_ns - self._since_ns) * 1e-9

    def timed_out(self, s: MissionInputs, phase: Phase) -> bool:
        """It takes longer than it may.  A landing of a vehicle that is not heard ends when that is given up
        as vanished."""
        unheard = phase is Phase.LAND and s.telemetry_age_s > self._params.telemetry_land_s
        return self.phase_s(s.now_ns) > self._limit_s and not unheard

    def adopting(self, s: MissionInputs, phase: Phase) -> bool:
        """A vehicle found flying is given a moment to show that it obeys."""
        return phase is Phase.RECOVER and self.phase_s(s.now_ns) < self._params.expert.adopt_s

    def step(self, s: MissionInputs, state: State, *, may_start: bool) -> set[Trigger]:
        """The trigger by which the phase reaches its end, if it has; on the ground it ends when the mission
        `may_start`."""
        p, v, goal = self._params, s.vehicle, self._itinerary.goal
        self._motion.step(s.pose, s.dt_s)
        match state.phase:
            case Phase.PREFLIGHT if self._found_flying.flies_already(s):
                done, trigger = True, Trigger.FOUND_FLYING
            case Phase.RECOVER:
                done, trigger = self.phase_s(s.now_ns) >= p.recover_s, Trigger.UNATTENDED
            case Phase.PREFLIGHT | Phase.SWAP:
                done, trigger = may_start, Trigger.READY
            case Phase.ARMING:
                ready = v is not None and v.armed and v.in_control and not math.isnan(s.height_m)
                done, trigger = ready, Trigger.ARMED
            case Phase.TAKE_OFF:
                done, trigger = s.height_m > p.height_m - p.expert.height_reached_m, Trigger.AT_HEIGHT
            case Phase.ACQUIRE:
                calm = s.localised and s.is_sure(p) and self._motion.speed_mps < 2 * p.expert.arrive_mps
                done, trigger = self._settled(s, calm), Trigger.ACQUIRED
            case Phase.TURN:
                turned = self._faces(s, goal.yaw_rad)
                level = goal.sweep is None or state.returning or self._is_level(s, goal.sweep.height_m)
                stands_s = max(p.settle_s, self._stands_s) if goal.sweep is not None else p.settle_s
                done, trigger = self._settled(s, turned and level, stands_s), Trigger.TURNED
            case Phase.FOLLOW:
                there = self._rests_at(s, (goal.x_m, goal.y_m))
                # before the next leg past a shelf it comes to stand anyway
                leads_on = goal.sweep is not None and not goal.sweep.last and not state.returning
                settle_s = 0.0 if leads_on else p.settle_s
                done, trigger = self._settled(s, there, settle_s), Trigger.ARRIVED
            case Phase.HOVER | Phase.CLIMB | Phase.SCAN:
                done, trigger = self._at_node(s, state.phase, state.returning)
            case _:
                return set()
        return {trigger} if done else set()

    def _at_node(self, s: MissionInputs, phase: Phase, returning: bool) -> tuple[bool, Trigger]:
        """Whether the dwell, the way to a view or the view is over, and what that leads to."""
        goal, scan = self._itinerary.goal, self._scan
        due = not returning and scan.due(phase, goal)
        if phase is Phase.CLIMB:
            if self._settled(s, self._at_view(s)) or not due:
                return True, Trigger.AT_VIEW
            return self._overdue(s.now_ns) > _MISSED, Trigger.VIEW_MISSED
        over = Trigger.ROUTE_DONE if self._itinerary.is_last else Trigger.DWELLED
        if phase is Phase.SCAN:
            done = not due or (s.is_sure(self._params) and self._scanner.step(s.now_ns))
            more = not returning and scan.due(phase, goal)
            return done, Trigger.VIEW_DONE if more else over
        if due:
            return True, Trigger.SCAN_DUE
        if goal.waits and not returning:
            return self.phase_s(s.now_ns) >= self._params.dwell_s, Trigger.AWAITS_MORE
        dwelt = not goal.visit or returning or scan.is_scanned(goal) or bool(scan.legs)
        last = goal.sweep is not None and goal.sweep.last and not returning
        dwell_s = _READING_S if last else 0.0 if dwelt else self._params.dwell_s
        return self.phase_s(s.now_ns) >= dwell_s and s.is_sure(self._params), over

    def _at_view(self, s: MissionInputs) -> bool:
        """Whether the drone is at the view, level with it and facing the shelf."""
        view = self._scanner.view
        if view is None:
            return False
        there = self._rests_at(s, (view.x_m, view.y_m))
        return there and self._is_level(s, view.height_m) and self._faces(s, view.yaw_rad)

    def _faces(self, s: MissionInputs, yaw_rad: float) -> bool:
        """Whether the drone has turned to a heading."""
        bound_rad = self._width(s.now_ns) * self._params.expert.arrive_yaw_rad
        return s.pose is not None and abs(wrap_pi(yaw_rad - s.pose.yaw_rad)) < bound_rad

    def _is_level(self, s: MissionInputs, height_m: float) -> bool:
        """Whether the drone is at the height from which a shelf is looked at."""
        return abs(s.height_m - height_m) < self._width(s.now_ns) * self._params.expert.view_height_m

    def _rests_at(self, s: MissionInputs, place_m: tuple[float, float]) -> bool:
        """Whether the drone is at a place of the map, but for what it swings about it."""
        width = self._width(s.now_ns)
        near = self._motion.distance_m(place_m) < width * self._params.arrive_m
        return near and self._motion.speed_mps < width * self._params.expert.arrive_mps

    def _width(self, now_ns: int) -> float:
        """How many times its usual width each bound of a goal has by now: 1 unless the phase is overdue."""
        begin, end = _WIDENS
        late = (self._overdue(now_ns) - begin) / (end - begin)
        return 1.0 + (_WIDEST - 1.0) * min(max(late, 0.0), 1.0)

    def _overdue(self, now_ns: int) -> float:
        """The part of its slack that the phase in hand has used up; below 0 within its own time."""
        return 1.0 - (self._limit_s - self.phase_s(now_ns)) / self._params.expert.phase_slack_s

    def _turn_s(self, s: MissionInputs, to: View | SweepLeg | None) -> float:
        """How long it may take to turn, and to reach the height of a view or of a leg past a shelf."""
        rise_m = 0.0 if to is None else abs(to.height_m - s.height_m)
        climb_s = 0.0 if math.isnan(rise_m) else rise_m / self._params.climb_mps
        return math.pi / self._params.turn_rate_radps + climb_s

    def _settled(self, s: MissionInputs, condition: bool, for_s: float | None = None) -> bool:
        """True once `condition` has held for the settling time, or for another one."""
        needed_s = self._params.settle_s if for_s is None else for_s
        return self._settling.step(condition, s.now_ns) >= needed_s and condition

    def _time_limit_s(self, s: MissionInputs, phase: Phase) -> float:
        """How long the phase just begun may take: a fixed slack, and a multiple of its way's own time.  A
        pause may last as long as a full battery does."""
        p, goal = self._params, self._itinerary.goal
        match phase:
            case Phase.ARMING:
                return p.expert.arm_timeout_s
            case Phase.SWAP:
                return self._battery.swap_wait_s
            case Phase.TAKE_OFF:
                way_s = p.height_m / p.climb_mps
            case Phase.HOVER:
                way_s = p.dwell_s
            case Phase.SCAN:
                way_s = self._scanner.look_s
            case Phase.RELOCATE:
                way_s = p.relocate_s
            case Phase.HOLD:
                return self._battery.hover_s
            case Phase.TURN:
                way_s = self._turn_s(s, goal.sweep)
            case Phase.CLIMB:
                way_s = self._turn_s(s, self._scanner.view)
            case Phase.LAND:
                height_m = p.height_m if math.isnan(s.height_m) else s.height_m
                way_s = height_m / min(p.land_mps, p.expert.touch_mps, p.expert.touch_blind_mps) + AIM_S
            case Phase.FOLLOW:
                here_m = s.distance_m((goal.x_m, goal.y_m))
                speed_mps = min(goal.speed_mps, self._scanner.passing_mps, p.speed_mps)
                way_s = (0.0 if math.isinf(here_m) else here_m) / speed_mps
            case _:
                way_s = 0.0
        return p.expert.phase_slack_s + p.expert.phase_share * way_s
