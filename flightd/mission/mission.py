"""The mission: what to do now, from what is known now.  Pure: time and data in, guidance out."""

from __future__ import annotations

import math

from flightd.control.flight import Reference
from flightd.control.profile import Profile
from flightd.core.geometry import wrap_pi
from flightd.core.types import Command, CommandKind, Demand, Event, EventLevel, LandedState, Phase
from flightd.grid.site import Site
from flightd.grid.ways import NoWayError
from flightd.mission.first_look import FirstLook
from flightd.mission.guidance import Guidance, Guide, LossAction, MissionParams, Senses
from flightd.mission.hazards import ACTIONS, Action, triggers_of
from flightd.mission.legs import Legs, Pace
from flightd.mission.plan import FlightPlan, HeadingPolicy, Stop, make_plan
from flightd.mission.readiness import not_fresh, not_ready
from flightd.mission.relocate import Relocator
from flightd.mission.scan_phase import ScanPhase
from flightd.mission.scanner import Scanner
from flightd.mission.sorties import Sorties
from flightd.mission.table import TABLE, next_phase
from flightd.mission.touchdown import Touchdown
from flightd.mission.triggers import Trigger
from flightd.mission.watch import Lasting, Situation, Watch

_DEMANDS = {
    Phase.PREFLIGHT: Demand.STANDBY,
    Phase.RECOVER: Demand.KEEP,
    Phase.SWAP: Demand.STANDBY,
    Phase.DONE: Demand.DISARM,
    Phase.ABORTED: Demand.DISARM,
    Phase.PILOT: Demand.HANDS_OFF,
}
_ON_GROUND = {Phase.PREFLIGHT, Phase.ARMING, Phase.SWAP, Phase.DONE, Phase.ABORTED, Phase.PILOT}
_BY_PAD = {Phase.TAKE_OFF, Phase.ACQUIRE, Phase.HOLD}
_TO_GOAL = (Phase.FOLLOW, Phase.HOVER)
_STOPPED = (Phase.HOLD, Phase.RELOCATE, Phase.ACQUIRE)
"""Where a leg that was interrupted goes on from."""
_SETTLE_S = 3.0
"""The most that a landing waits for the drone to come to rest."""
_REST_MPS = 0.15
_AGAIN_S = 1.0
"""A hazard that was away for longer is told anew."""


class Mission:
    """One flight of one plan: call `step` at a fixed rate, `drain_events` for what happened.

    With a `scanner` the locations of each visited node are counted instead of a plain hover."""

    def __init__(
        self,
        site: Site,
        plan: FlightPlan,
        policy: HeadingPolicy,
        params: MissionParams,
        scanner: Scanner | None = None,
    ) -> None:
        self._site = site
        self._plan = plan
        self._policy = policy
        self._params = params
        self._watch = Watch(params)
        self._touchdown = Touchdown(params)
        self._relocator = Relocator(params)
        self._sorties = Sorties(site, Legs(site, policy, Pace.of(params)), params.battery, scanner)
        self._left_over: tuple[str, ...] = ()
        self._short_of_charge = False
        self._visited_before = 0
        self.stand = (plan.start, plan.start_yaw_rad)
        """The node on which the drone stands before it flies, and its heading there."""
        self._scanner = scanner
        self._scan = ScanPhase(site, scanner, params, policy)
        self._stops: list[Stop] = list(plan.stops)
        self._next = 0
        start = site.nodes[plan.start]
        self._anchor = (start.x_m, start.y_m)
        self.phase = Phase.PREFLIGHT
        self.reason = self._cause = ""
        self.visited: list[str] = []
        self._aborting = False
        self._returning = False
        self._on_pad_leg = False
        self._paused = False
        self._leg_along_x: bool | None = None
        self._stopped = False
        self._ground_lost = False
        self._hazards: dict[Trigger, int] = {}
        self._started = params.autostart
        self._first_look = FirstLook(params)
        self._found_flying = False
        self._ordered: Trigger | None = None
        self._since_ns = 0
        self._limit_s = math.inf
        self._settling = Lasting()
        self._steering = False
        self._events: list[Event] = []
        self._x = Profile(start.x_m, params.speed_mps, params.accel_mps2)
        self._y = Profile(start.y_m, params.speed_mps, params.accel_mps2)
        self._yaw = Profile(plan.start_yaw_rad, params.turn_rate_radps, params.turn_accel_radps2)
        self._cruise_m = params.height_m
        self._height = Profile(0.0, params.climb_mps, params.climb_accel_mps2)

    @property
    def goal(self) -> Stop:
        """The stop flown to or hovered at."""
        return self._stops[min(self._next, len(self._stops) - 1)]

    @property
    def airborne(self) -> bool:
        """The mission believes the drone to fly and answers for it."""
        return self.phase not in _ON_GROUND

    def drain_events(self) -> tuple[Event, ...]:
        told = self._scanner.drain_events() if self._scanner else []
        events, self._events = (*self._events, *told), []
        return events

    def command(self, command: Command, now_ns: int) -> None:
        """Take an operator's order; it acts at the next step."""
        kind = command.kind
        self._event(now_ns, EventLevel.INFO, "command", f"{kind.value} {command.node}".strip())
        if kind is CommandKind.START:
            self._started = True
        elif kind is CommandKind.PAUSE:
            self._paused = True
        elif kind is CommandKind.RESUME:
            self._paused = False
        elif kind in {CommandKind.HOME, CommandKind.GOTO} and not self.airborne:
            self._event(
                now_ns, EventLevel.WARNING, "command", f"{kind.value} refused: the drone does not fly"
            )
        elif kind is CommandKind.HOME:
            self._go_home(now_ns, "ordered home")
        elif kind is CommandKind.GOTO:
            self._go_to(now_ns, command.node)
        else:
            self._ordered = Trigger.LAND_HERE if kind is CommandKind.LAND else Trigger.STOP

    def step(self, senses: Senses) -> Guidance:
        """Advance by one tick."""
        doubts = self._relocator.step(senses, self.phase, (senses.now_ns - self._since_ns) * 1e-9)
        if self._relocator.jumped:
            self._correct(senses)
        triggers = self._triggers(senses) | doubts | self._scan.doubts(self.phase)
        self._tell_hazards(triggers, senses.now_ns)
        phase, trigger = next_phase(self.phase, triggers)
        if trigger is not None:
            self._change(senses, phase, trigger)
            self._ordered = None if trigger is self._ordered else self._ordered
        return self._guide(senses)

    # What has happened

    def _triggers(self, s: Senses) -> set[Trigger]:
        found = self._progress(s)
        if self._ordered is not None:
            found.add(self._ordered)
        found |= self._ground(s)
        if self._paused:
            found.add(Trigger.HOLD)
        self._battery(s)
        if (s.now_ns - self._since_ns) * 1e-9 > self._limit_s:
            found.add(Trigger.TIMED_OUT)
        found |= self._watch.step(s, self._situation(Trigger.HOLD in found))
        if Trigger.RECORD_LOST in found:
            found.remove(Trigger.RECORD_LOST)
            found |= self._lost(self._params.hazards.record_lost, Trigger.RECORD_LOST, s.now_ns)
        found |= {Trigger.DOWN_TO_SWAP} if Trigger.DISARMED in found and self._swaps else set()
        return found - {Trigger.PILOT_TOOK} if self._adopting(s) else found

    def _battery(self, s: Senses) -> None:
        """Turn back in time: below the fixed share, or when what is left only just brings it back."""
        charge = math.nan if s.vehicle is None else s.vehicle.battery_frac
        self._sorties.step(s.now_ns, charge, self.airborne)
        if not self.airborne or self._returning or self.phase is Phase.LAND:
            return
        if self._watch.battery_low(s):
            self._go_charge(s.now_ns, f"battery low: {charge:.0%}", in_need=True)
            return
        left_m = _distance(s, (self.goal.x_m, self.goal.y_m)) if self.phase is Phase.FOLLOW else 0.0
        if math.isfinite(left_m) and (reason := self._sorties.why_return(self.goal.node, left_m)):
            self._go_charge(s.now_ns, reason)

    @property
    def _swaps(self) -> bool:
        """It lands on a pad for a fresh battery, with stops left and something done on the last one."""
        done = len(self.visited) > self._visited_before
        return self._on_pad_leg and self._short_of_charge and done and bool(self._left_over)

    def _lost(self, action: LossAction, trigger: Trigger, now_ns: int) -> set[Trigger]:
        """What the configured action makes of something lost."""
        self._note_hazard(trigger, action.value, now_ns)
        if action is LossAction.HOME and self.airborne and not self._returning:
            self._go_home(now_ns, trigger.value, in_need=True)
        return {LossAction.HOLD: {Trigger.HOLD}, LossAction.LAND: {trigger}}.get(action, set())

    def _tell_hazards(self, triggers: set[Trigger], now_ns: int) -> None:
        asked = triggers & ACTIONS.keys()
        if self.phase in {Phase.TAKE_OFF, Phase.LAND}:  # near the floor lines come and go
            asked &= TABLE[self.phase].keys() | triggers_of(Action.REPORT, Action.HOME)
        for trigger in sorted(asked, key=list(Trigger).index):
            self._note_hazard(trigger, ACTIONS[trigger].value, now_ns)

    def _note_hazard(self, trigger: Trigger, action: str, now_ns: int) -> None:
        """Say once that a hazard was found."""
        last_ns = self._hazards.get(trigger)
        self._hazards[trigger] = now_ns
        if last_ns is None or (now_ns - last_ns) * 1e-9 > _AGAIN_S:
            self._event(now_ns, EventLevel.WARNING, "hazard", f"{trigger.value}: {action}")

    def _situation(self, paused: bool) -> Situation:
        if self.phase is Phase.FOLLOW:
            dx, dy = self.goal.x_m - self._anchor[0], self.goal.y_m - self._anchor[1]
            self._leg_along_x = abs(dx) >= abs(dy)
        elif self.phase not in _STOPPED:
            self._leg_along_x = None
        return Situation(self.airborne, paused, self._leg_along_x, self.phase is Phase.HOLD)

    def _ground(self, s: Senses) -> set[Trigger]:
        """What a lost ground link asks for, by the configured action; the link's return ends a hold."""
        action = self._params.ground_lost
        lost = self._watch.ground_lost(s)
        if lost is not self._ground_lost:
            self._ground_lost = lost
            text = f"silent for {s.ground_silent_s:.1f} s: {action.value}" if lost else "heard again"
            self._event(s.now_ns, EventLevel.WARNING if lost else EventLevel.INFO, "ground_link", text)
        return self._lost(action, Trigger.GROUND_LOST, s.now_ns) if lost else set()

    def _progress(self, s: Senses) -> set[Trigger]:
        """The trigger by which the present phase reaches its end, if it has."""
        p, v, goal = self._params, s.vehicle, self.goal
        match self.phase:
            case Phase.PREFLIGHT if self._first_look.flies_already(s):
                done, trigger = True, Trigger.FOUND_FLYING
            case Phase.RECOVER:
                done = (s.now_ns - self._since_ns) * 1e-9 >= p.recover_s
                trigger = Trigger.UNATTENDED
            case Phase.PREFLIGHT | Phase.SWAP:
                done, trigger = self._started and not self._grounded(s), Trigger.READY
            case Phase.ARMING:
                ready = v is not None and v.armed and v.in_control and not math.isnan(s.height_m)
                done, trigger = ready, Trigger.ARMED
            case Phase.TAKE_OFF:
                done, trigger = s.height_m > p.height_m - p.height_reached_m, Trigger.AT_HEIGHT
            case Phase.ACQUIRE:
                done, trigger = (
                    self._settled(s, s.localised and _sure(s, p) and _speed(s) < 2 * p.arrive_mps),
                    Trigger.ACQUIRED,
                )
            case Phase.TURN:
                turned = s.pose is not None and abs(wrap_pi(goal.yaw_rad - s.pose.yaw_rad)) < p.arrive_yaw_rad
                done, trigger = self._settled(s, turned), Trigger.TURNED
            case Phase.FOLLOW:
                there = _distance(s, (goal.x_m, goal.y_m)) < p.arrive_m and _speed(s) < p.arrive_mps
                done, trigger = self._settled(s, there), Trigger.ARRIVED
            case Phase.HOVER | Phase.CLIMB | Phase.SCAN:
                done, trigger = self._at_node(s)
            case _:
                return set()
        return {trigger} if done else set()

    def _at_node(self, s: Senses) -> tuple[bool, Trigger]:
        """Whether the dwell, the way to a view or the view is over, and what that leads to."""
        goal, scan = self.goal, self._scan
        due = not self._returning and scan.due(self.phase, goal)
        if self.phase is Phase.CLIMB:
            view = scan.view(self.phase)
            away_m = _distance(s, (view.x_m, view.y_m)) if view is not None else math.inf
            return self._settled(s, scan.at_view(s, away_m, _speed(s))) or not due, Trigger.AT_VIEW
        over = Trigger.ROUTE_DONE if self._next + 1 >= len(self._stops) else Trigger.DWELLED
        if self.phase is Phase.SCAN:
            done = not due or (_sure(s, self._params) and scan.is_over(s.now_ns))
            more = not self._returning and scan.due(self.phase, goal)
            return done, Trigger.VIEW_DONE if more else over
        if due:
            return True, Trigger.SCAN_DUE
        dwelt = not goal.visit or self._returning or scan.is_scanned(goal)
        dwell_s = 0.0 if dwelt else self._params.dwell_s
        return (s.now_ns - self._since_ns) * 1e-9 >= dwell_s and _sure(s, self._params), over

    def _adopting(self, s: Senses) -> bool:
        """A vehicle found flying is given a moment to show that it obeys."""
        return self.phase is Phase.RECOVER and (s.now_ns - self._since_ns) * 1e-9 < self._params.adopt_s

    def _grounded(self, s: Senses) -> str:
        """Why it stays on the ground, or an empty text."""
        silent = self._ground_lost and self._params.ground_lost is not LossAction.CONTINUE
        stale = not_fresh(s, self._params, len(self.remaining)) if self.phase is Phase.SWAP else ""
        return stale or not_ready(s, self._params, silent)

    def _settled(self, s: Senses, condition: bool) -> bool:
        """True once `condition` has held for the settling time."""
        return self._settling.step(condition, s.now_ns) >= self._params.settle_s and condition

    # Changing phase

    def _change(self, s: Senses, phase: Phase, trigger: Trigger) -> None:
        before, self.phase = self.phase, phase
        self._stopped |= trigger is Trigger.STOP
        planned = (trigger is Trigger.ROUTE_DONE or before is Phase.LAND) and not self._stopped
        if trigger in {Trigger.DWELLED, Trigger.ROUTE_DONE}:
            self._note_visit(s)
        self._scan.changed(s, before, phase, trigger, self.goal, self._relocator.shift_m)
        if trigger is Trigger.DWELLED:
            self._look_ahead(s)
            before_stop = self.goal
            self._next += 1
            self._stops[self._next] = self._scan.heading_kept(s, before_stop, self.goal)
        if trigger is Trigger.ARRIVED:
            self._anchor = (self.goal.x_m, self.goal.y_m)
        if phase in {Phase.HOLD, Phase.RELOCATE} or (phase is Phase.LAND and not planned):
            self._anchor = (s.pose.x_m, s.pose.y_m) if s.pose is not None else self._anchor
        if phase is Phase.HOLD and s.localised:
            self._anchor = s.warnings.line_m
        self._on_pad_leg = phase is Phase.LAND and planned
        unplanned = phase in {Phase.LAND, Phase.ABORTED, Phase.PILOT} and not planned
        if phase is Phase.DONE:
            if not self._aborting and self._scan.blind:
                self._aborting, self._cause = True, self._scan.blind
                self._event(s.now_ns, EventLevel.ERROR, "not_counted", self._cause)
            self.phase = Phase.ABORTED if self._aborting else Phase.DONE
            self._cause = self._cause if self._aborting else "landed on the pad"
        else:
            refused = trigger is Trigger.TIMED_OUT and s.vehicle is not None and s.vehicle.refusal
            self._cause = f"{trigger.value}: {s.vehicle.refusal}" if refused and s.vehicle else trigger.value
        self.reason = self._cause
        self._aborting |= unplanned
        stopped = phase in {Phase.HOLD, Phase.RELOCATE}
        level = EventLevel.WARNING if unplanned or stopped else EventLevel.INFO
        self._event(s.now_ns, level, "phase", f"{before.value} -> {self.phase.value}: {self.reason}")
        self._since_ns = s.now_ns
        self._settling = Lasting()
        self._limit_s = self._time_limit_s(s)
        if phase is Phase.LAND:
            self._touchdown.begin()
        self._relocate(s, trigger)
        if phase is Phase.SWAP:
            self._await_battery(s.now_ns)
        if phase is Phase.TAKE_OFF:
            self._height.reset(0.0 if math.isnan(s.height_m) else s.height_m)
        if phase is Phase.RECOVER and s.vehicle is not None:
            self._found_flying = self._returning = True  # where it is, and so the way home, is not known
            text = f"found flying in mode {s.vehicle.mode} at {s.height_m:.1f} m: level, then landing"
            self._event(s.now_ns, EventLevel.ERROR, "restart", text)

    def _time_limit_s(self, s: Senses) -> float:
        """How long the phase just begun may take: a fixed slack, and a multiple of its way's own time."""
        p = self._params
        match self.phase:
            case Phase.ARMING:
                return p.arm_timeout_s
            case Phase.SWAP:
                return p.battery.swap_wait_s
            case Phase.TAKE_OFF:
                way_s = p.height_m / p.climb_mps
            case Phase.TURN:
                way_s = math.pi / p.turn_rate_radps
            case Phase.CLIMB:
                way_s = self._scan.way_s(s)
            case Phase.FOLLOW:
                here = _distance(s, (self.goal.x_m, self.goal.y_m))
                way_s = (0.0 if math.isinf(here) else here) / p.speed_mps
            case _:
                way_s = 0.0
        return p.phase_slack_s + p.phase_share * way_s

    def _relocate(self, s: Senses, trigger: Trigger) -> None:
        """Begin to look for the position, or go on from where it was found."""
        if trigger is Trigger.POSITION_SURE:
            self._rejoin(s)
        elif self.phase is Phase.RELOCATE:
            self._relocator.begin()
            places = ", ".join(f"{node} {share:.0%}" for node, share in s.rivals[:5])
            if places:
                self._event(s.now_ns, EventLevel.WARNING, "position", f"doubted, it may be {places}")

    def _correct(self, s: Senses) -> None:
        """The drone is not where it was believed to be: what was held in metres moves along."""
        dx, dy = self._relocator.jump_m
        if s.pose is None or not self.airborne:
            return
        self._event(s.now_ns, EventLevel.WARNING, "position", f"corrected: it is {s.pose.node}")
        self._steering = False
        if self.phase is Phase.LAND and self._on_pad_leg:  # not across the floor at landing height
            self._on_pad_leg, self._anchor = False, (s.pose.x_m, s.pose.y_m)
            self._aborting, self.reason = True, "the position was corrected while landing"
        else:
            self._anchor = (self._anchor[0] + dx, self._anchor[1] + dy)

    def _rejoin(self, s: Senses) -> None:
        """From where the drone turned out to be: over the nearest node along open lines to the goal."""
        if s.pose is None:
            return
        self._go_back(s.now_ns)
        goal = self.goal
        self._event(s.now_ns, EventLevel.INFO, "position", f"sure again: {s.pose.node}")
        node = self._site.nodes[s.pose.node]
        if node.id == goal.node:
            return
        way = make_plan(
            self._site, [goal.node], node.id, goal.node, self._policy, s.pose.yaw_rad, in_need=True
        ).stops[:-1]
        first = Stop(node.id, node.x_m, node.y_m, way[0].yaw_rad, False)
        self._stops[self._next : self._next + 1] = [first, *way[:-1], goal]

    def _go_back(self, now_ns: int) -> None:
        """Put nodes whose count was withdrawn before what is left, near as they are; they are left for the
        next battery where the way leads home already."""
        due = self._scan.take_due(self.visited)
        if not due:
            return
        if not self._returning:
            nodes = [*due, *(stop.node for stop in self._stops[self._next :] if stop.visit)]
            home, yaw_rad = self._plan.home, self.goal.yaw_rad
            try:
                rest = make_plan(self._site, nodes, due[0], home, self._policy, yaw_rad)
            except NoWayError as err:
                self._event(now_ns, EventLevel.WARNING, "recount", f"{', '.join(due)} left out: {err}")
                return
            self._stops[self._next :] = rest.stops
        else:
            self._left_over = (*due, *self._left_over)
        self.visited = [node for node in self.visited if node not in due]
        self._event(now_ns, EventLevel.WARNING, "recount", f"{', '.join(due)} to visit again")

    def _note_visit(self, s: Senses) -> None:
        if self.goal.visit and not self._returning:  # a stop on the way home is none of the wanted ones
            self.visited.append(self.goal.node)
            self._event(s.now_ns, EventLevel.INFO, "visited", self.goal.node)

    @property
    def remaining(self) -> tuple[str, ...]:
        """The stops that this mission still wants to visit, in order."""
        ahead = (stop.node for stop in self._stops[self._next :] if stop.visit)
        return self._left_over or tuple(ahead)

    def _look_ahead(self, s: Senses) -> None:
        """Turn back here rather than half-way to a stop that the battery does not reach."""
        ahead = [stop.node for stop in self._stops[self._next + 1 :] if stop.visit]
        if ahead and not self._returning and (why := self._sorties.why_not_on(self.goal.node, ahead[0])):
            self._left_over = tuple(ahead)
            self._go_charge(s.now_ns, why)

    def _go_charge(self, now_ns: int, reason: str, *, in_need: bool = False) -> None:
        """Fly to the charge pad that is reached soonest; with batteries swapped the rest is flown later."""
        self._go_home(now_ns, reason, in_need=in_need, pad=self._sorties.way_back(self.goal.node).pad)
        self._short_of_charge = self._params.battery.swap
        self._aborting = not (self._short_of_charge and self._left_over)

    def _await_battery(self, now_ns: int) -> None:
        """Stand on the pad with the rest of the plan ahead."""
        pad = self.goal
        self.stand = (pad.node, pad.yaw_rad)
        rest = make_plan(self._site, self._left_over, pad.node, self._plan.home, self._policy, pad.yaw_rad)
        self._stops, self._next = list(rest.stops), 0
        self._anchor = (pad.x_m, pad.y_m)
        self._visited_before = len(self.visited)
        self._returning = self._aborting = self._short_of_charge = False
        self._started = self._params.autostart
        text = f"{len(self._left_over)} stops left; change the battery on the pad at {pad.node}"
        self._event(now_ns, EventLevel.WARNING, "swap", text)
        self._left_over = ()

    def _go_home(self, now_ns: int, reason: str, *, in_need: bool = False, pad: str | None = None) -> None:
        """Fly to the home pad or another; `in_need` by the shortest way, against one-way lines too."""
        self._left_over = self.remaining
        self._returning = True
        self._paused = False
        self._aborting = True
        self._event(now_ns, EventLevel.WARNING, "home", reason)
        self._replan([], in_need=in_need, home=pad)

    def _go_to(self, now_ns: int, node: str) -> None:
        if self._returning:
            self._event(now_ns, EventLevel.WARNING, "command", f"goto {node} refused: on the way home")
        elif node in self._site.nodes:
            try:
                self._replan([node])
            except NoWayError as err:
                self._event(now_ns, EventLevel.WARNING, "command", f"goto {node} refused: {err}")
        else:
            self._event(now_ns, EventLevel.WARNING, "command", f"no node {node!r} on site {self._site.name}")

    def _replan(self, visits: list[str], *, in_need: bool = False, home: str | None = None) -> None:
        """Finish the present leg, then fly over `visits` home.  NoWayError leaves everything as it is."""
        here = self.goal
        onward = make_plan(
            self._site,
            visits,
            here.node,
            home or self._plan.home,
            self._policy,
            here.yaw_rad,
            in_need=in_need,
        )
        self._stops[self._next + 1 :] = onward.stops

    # What to do

    def _guide(self, s: Senses) -> Guidance:
        demand = _DEMANDS.get(self.phase, Demand.FLY)
        if self.phase in {Phase.PREFLIGHT, Phase.SWAP}:
            self.reason = self._grounded(s) or "waiting for the start command"
        if not self.airborne:
            return Guidance(self.phase, Guide.NONE, self._reference(0.0), demand)
        self._steering = not (self._stopped or self._found_flying) and self._steer(s)
        if self.phase is Phase.LAND:
            climb, demand = self._descend(s)
            refused = demand is Demand.DISARM and s.vehicle is not None and s.vehicle.refusal
            self.reason = f"{self._cause}: {s.vehicle.refusal}" if refused and s.vehicle else self._cause
        elif self.phase is Phase.RECOVER:
            self._height.reset(0.0 if math.isnan(s.height_m) else s.height_m)
            climb = 0.0
        elif (
            math.isnan(s.height_m)
            or s.telemetry_age_s > self._params.telemetry_hold_s
            or abs(s.warnings.height_share - 1.0) > self._params.hazards.height_share
        ):
            self._height.reset(self._height.position)  # no climb by heights of the past
            climb = 0.0
        elif self.phase is Phase.HOLD and self._watch.blind.is_blind:
            climb = -self._watch.blind.sink_mps(s.height_m)
            self._height.reset(s.height_m, climb)
        else:
            self._height.step(self._wanted_height_m(), s.dt_s)
            climb = self._height.velocity
        guide = Guide.STEER if self._steering else Guide.BRAKE if self._may_brake(s) else Guide.LEVEL
        reckoned = min(s.x_age_s, s.y_age_s) < self._params.hazards.brake_s
        return Guidance(self.phase, guide, self._reference(climb), demand, reckoned, self._stopped)

    def _may_brake(self, s: Senses) -> bool:
        """Without a view of the floor, but with an attitude by which to reckon on from the last one."""
        heard = s.telemetry_age_s <= self._params.telemetry_hold_s
        known = heard and s.pose is not None and not self._found_flying
        return known and not self._stopped and self.phase is not Phase.TAKE_OFF

    def _wanted_height_m(self) -> float:
        """Flying height; a little more in search of lines that stay lost."""
        p, h = self._params, self._params.hazards
        if self.phase is Phase.RELOCATE:
            return self._relocator.height_m(self._height_goal_m())
        if self.phase is not Phase.HOLD or self._watch.unseen_s < h.search_s:
            return self._height_goal_m()
        highest_m = self._site.ceiling_m - h.headroom_m
        return max(p.height_m, min(self._height_goal_m() + h.search_climb_m, highest_m))

    def _descend(self, s: Senses) -> tuple[float, Demand]:
        """Climb rate and demand of a landing: at rest first, unless stopped or out of sight; down until
        the vehicle says that it stands; then disarm."""
        p, v = self._params, s.vehicle
        moving = self._steering and _speed(s) > _REST_MPS
        if moving and not self._on_pad_leg and (s.now_ns - self._since_ns) * 1e-9 < _SETTLE_S:
            self._height.reset(self._height.position)
            return 0.0, Demand.FLY
        rate = self._touchdown.rate_mps(s, self._target(s))
        if rate > 0.0 and not self._steering:  # what drifts unseen should not do so for long
            rate = self._watch.blind.rate_mps(s.height_m)
        self._height.reset(0.0 if math.isnan(s.height_m) else s.height_m, -rate)
        blind = s.telemetry_age_s > p.telemetry_land_s
        standing = v is not None and v.landed is LandedState.ON_GROUND and not blind
        by_itself = blind or self._found_flying
        return -rate, Demand.DISARM if standing else Demand.LAND if by_itself else Demand.FLY

    def _target(self, s: Senses) -> tuple[float, float] | None:
        """The pad to come down on; None while it lands on none."""
        return (s.pad_m or (self.goal.x_m, self.goal.y_m)) if self._on_pad_leg else None

    def _steer(self, s: Senses) -> bool:
        """Move the reference towards where the phase wants it; False when the floor cannot be relied on."""
        p, pose = self._params, s.pose
        too_low = self.phase is Phase.TAKE_OFF and s.height_m < p.steer_above_m
        unseen_s = self._touchdown.unseen_s(s, self._target(s))
        stale = min(s.x_age_s, s.y_age_s) > unseen_s or s.telemetry_age_s > p.telemetry_hold_s
        unknown = not (s.by_pad and self.phase in _BY_PAD) and (stale or not s.localised)
        if pose is None or unknown or too_low:
            return False
        if not self._steering:
            self._x.reset(pose.x_m, pose.vx_mps)
            self._y.reset(pose.y_m, pose.vy_mps)
            self._yaw.reset(pose.yaw_rad)
        if self.phase is Phase.RELOCATE:
            self._anchor = self._relocator.next_look(s, self._anchor)
        to_goal = self.phase in _TO_GOAL or self._on_pad_leg
        at = self._target(s) or ((self.goal.x_m, self.goal.y_m) if to_goal else self._anchor)
        x, y, yaw = (*at, self.goal.yaw_rad)
        view = self._scan.view(self.phase)
        if view is not None:
            x, y, yaw = view.x_m, view.y_m, view.yaw_rad
        if math.hypot(self._x.position - pose.x_m, self._y.position - pose.y_m) < p.max_lead_m:
            self._x.step(x, s.dt_s)
            self._y.step(y, s.dt_s)
        else:  # wait for the vehicle at rest: a speed kept here would be fed forward and hold it off
            self._x.brake(s.dt_s)
            self._y.brake(s.dt_s)
        if to_goal or view is not None or self.phase is Phase.TURN:
            self._yaw.step(self._yaw.position + wrap_pi(yaw - self._yaw.position), s.dt_s)
        return True

    def _height_goal_m(self) -> float:
        """The view's height while scanning; the legs between scanned nodes are flown at the last one's."""
        view = self._scan.view(self.phase)
        if view is not None:
            self._cruise_m = view.height_m
        elif self._returning or not self.goal.visit:
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

    def _event(self, now_ns: int, level: EventLevel, name: str, text: str) -> None:
        self._events.append(Event(now_ns, level, name, text))


def _distance(s: Senses, to: tuple[float, float]) -> float:
    return math.inf if s.pose is None else math.hypot(s.pose.x_m - to[0], s.pose.y_m - to[1])


def _speed(s: Senses) -> float:
    return math.inf if s.pose is None else math.hypot(s.pose.vx_mps, s.pose.vy_mps)


def _sure(s: Senses, p: MissionParams) -> bool:
    return s.pose is not None and s.pose.integrity >= p.integrity_min
