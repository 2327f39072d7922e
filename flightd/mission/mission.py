"""The mission: what to do now, from what is known now.  Pure: time and data in, guidance out."""

from __future__ import annotations

from collections.abc import Sequence

from flightd.config.hazards import LossAction
from flightd.config.schema import Config
from flightd.core.types import Command, CommandKind, Demand, Event, EventLevel, Phase
from flightd.mission.battery.swap import BatterySwap
from flightd.mission.event_log import EventLog
from flightd.mission.flight.phase_progress import PhaseProgress
from flightd.mission.flight.reference import ReferenceGenerator, ReferenceTask
from flightd.mission.flight.relocation import Relocator
from flightd.mission.guidance import CEILING_MARGIN_M, Guidance, MissionInputs
from flightd.mission.plan.flight_plan import FlightPlan, HeadingPolicy, Stop
from flightd.mission.plan.itinerary import Itinerary
from flightd.mission.safety.hazard_monitor import FlightContext, HazardMonitor
from flightd.mission.safety.hazards import ACTIONS, Action, triggers_of
from flightd.mission.safety.readiness import not_fresh, not_ready
from flightd.mission.scan.scan_phase import ScanPhase
from flightd.mission.scan.scanner import Scanner
from flightd.mission.transition_table import TABLE, next_phase
from flightd.mission.triggers import Trigger
from flightd.site.site import Site

_DEMANDS = {
    Phase.PREFLIGHT: Demand.STANDBY,
    Phase.SWAP: Demand.STANDBY,
    Phase.DONE: Demand.DISARM,
    Phase.ABORTED: Demand.DISARM,
    Phase.PILOT: Demand.HANDS_OFF,
}
_ON_GROUND = {Phase.PREFLIGHT, Phase.ARMING, Phase.SWAP, Phase.DONE, Phase.ABORTED, Phase.PILOT}
_NEAR_FLOOR = {Phase.TAKE_OFF, Phase.LAND}
"""Where lines come and go."""
_OVER = (Phase.DONE, Phase.ABORTED, Phase.PILOT)
_WAITING = (Phase.PREFLIGHT, Phase.SWAP)
_STOPPED = (Phase.HOLD, Phase.RELOCATE, Phase.ACQUIRE)
"""Where a leg that was interrupted goes on from."""


class Mission:
    """One flight of one plan: call `step` at a fixed rate, `drain_events` for what happened.

    With a `scanner` the locations of each visited node are counted instead of a plain hover; `overhead_m` are
    the heights below the keep-outs (`Site.overhead_m`); with `autostart` (None: as configured) it waits for
    no start command."""

    def __init__(
        self,
        site: Site,
        plan: FlightPlan,
        policy: HeadingPolicy,
        params: Config,
        scanner: Scanner | None = None,
        overhead_m: Sequence[float] = (),
        *,
        autostart: bool | None = None,
    ) -> None:
        start = site.nodes[plan.start]
        self._params = params
        self._scanner = scanner
        self._events = EventLog()
        self._route = Itinerary(site, plan, policy, self._events)
        self._scan = ScanPhase(site, scanner, params.mission, policy)
        self._progress = PhaseProgress(params, self._route, self._scan)
        self._watch = HazardMonitor(params)
        self._relocator = Relocator(params.mission, site.ceiling_m - CEILING_MARGIN_M, overhead_m)
        self._steering = ReferenceGenerator(
            params, site.ceiling_m, self._watch, self._relocator, (start.x_m, start.y_m, plan.start_yaw_rad)
        )
        self._charging = BatterySwap(site, policy, params, scanner, self._route, self._watch)
        self.phase = Phase.PREFLIGHT
        self.reason = self._cause = ""
        self._aborting = False
        self._on_pad_leg = False
        self._paused = False
        self._leg_along_x: bool | None = None
        self._stopped = False
        self._ground_lost = False
        self._autostart = params.mission.autostart if autostart is None else autostart
        self._started = self._autostart
        self._found_flying = False
        self._ordered: Trigger | None = None

    @property
    def goal(self) -> Stop:
        """The stop flown to or hovered at."""
        return self._route.goal

    @property
    def stand(self) -> tuple[str, float]:
        """The node on which the drone stands before it flies, and its heading there."""
        return self._route.stand

    @property
    def visited(self) -> Sequence[str]:
        """The nodes visited, in order."""
        return self._route.visited

    @property
    def airborne(self) -> bool:
        """The mission believes the drone to fly and answers for it."""
        return self.phase not in _ON_GROUND

    def drain_events(self) -> tuple[Event, ...]:
        told = self._scanner.drain_events() if self._scanner else []
        return (*self._events.drain(), *told)

    def command(self, command: Command, now_ns: int) -> None:
        """Take an operator's order; it acts at the next step."""
        kind = command.kind
        self._events.tell(now_ns, EventLevel.INFO, "command", f"{kind.value} {command.node}".strip())
        if kind is CommandKind.START:
            self._started = True
        elif kind is CommandKind.PAUSE:
            self._paused = True
        elif kind is CommandKind.RESUME:
            self._paused = False
        elif kind in {CommandKind.HOME, CommandKind.GOTO} and not self.airborne:
            self._events.tell(
                now_ns, EventLevel.WARNING, "command", f"{kind.value} refused: the drone does not fly"
            )
        elif kind is CommandKind.HOME:
            self._go_home(now_ns, "ordered home")
        elif kind is CommandKind.GOTO:
            self._route.go_to(now_ns, command.node)
        else:
            self._ordered = Trigger.LAND_HERE if kind is CommandKind.LAND else Trigger.STOP

    def step(self, senses: MissionInputs) -> Guidance:
        """Advance by one tick."""
        doubts = self._relocator.step(senses, self.phase, self._progress.phase_s(senses.now_ns))
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

    def _triggers(self, s: MissionInputs) -> set[Trigger]:
        may_start = self.phase in _WAITING and self._started and not self._grounded(s)
        found = self._progress.step(s, self.phase, may_start=may_start)
        if self._ordered is not None:
            found.add(self._ordered)
        found |= self._ground(s)
        if self._paused:
            found.add(Trigger.HOLD)
        if self._charging.step(s, self.phase, self.airborne):
            self._turned_back()
        if self._progress.timed_out(s.now_ns):
            found.add(Trigger.TIMED_OUT)
        found |= self._watch.step(s, self._situation(Trigger.HOLD in found))
        if Trigger.RECORD_LOST in found:
            found.remove(Trigger.RECORD_LOST)
            found |= self._lost(self._params.hazards.record_lost, Trigger.RECORD_LOST, s.now_ns)
        swaps = self._on_pad_leg and self._charging.swaps
        found |= {Trigger.DOWN_TO_SWAP} if Trigger.DISARMED in found and swaps else set()
        return found - {Trigger.PILOT_TOOK} if self._adopting(s) else found

    def _lost(self, action: LossAction, trigger: Trigger, now_ns: int) -> set[Trigger]:
        """What the configured action makes of something lost."""
        if self.airborne or (self.phase not in _OVER and action is not LossAction.CONTINUE):
            self._events.hazard(now_ns, trigger, action.value)
        if action is LossAction.HOME and self.airborne and not self._route.returning:
            self._go_home(now_ns, trigger.value, in_need=True)
        return {LossAction.HOLD: {Trigger.HOLD}, LossAction.LAND: {trigger}}.get(action, set())

    def _tell_hazards(self, triggers: set[Trigger], now_ns: int) -> None:
        asked = triggers & ACTIONS.keys()
        if not self.airborne:  # on the ground only what decides something there is worth telling
            asked &= TABLE[self.phase].keys()
        elif self.phase in _NEAR_FLOOR:
            asked &= TABLE[self.phase].keys() | triggers_of(Action.REPORT, Action.HOME)
        for trigger in sorted(asked, key=list(Trigger).index):
            self._events.hazard(now_ns, trigger, ACTIONS[trigger].value)

    def _situation(self, paused: bool) -> FlightContext:
        if self.phase is Phase.FOLLOW:
            self._leg_along_x = self._leads_along_x()
        elif self.phase not in _STOPPED:
            self._leg_along_x = None
        at_height = self.airborne and self.phase not in _NEAR_FLOOR
        return FlightContext(self.airborne, paused, self._leg_along_x, self.phase is Phase.HOLD, at_height)

    def _ground(self, s: MissionInputs) -> set[Trigger]:
        """What a lost ground link asks for, by the configured action; the link's return ends a hold."""
        action = self._params.ground.lost_action
        lost = self._watch.ground_lost(s)
        if lost is not self._ground_lost:
            self._ground_lost = lost
            text = f"silent for {s.ground_silent_s:.1f} s: {action.value}" if lost else "heard again"
            self._events.tell(s.now_ns, EventLevel.WARNING if lost else EventLevel.INFO, "ground_link", text)
        return self._lost(action, Trigger.GROUND_LOST, s.now_ns) if lost else set()

    def _adopting(self, s: MissionInputs) -> bool:
        """A vehicle found flying is given a moment to show that it obeys."""
        return (
            self.phase is Phase.RECOVER
            and self._progress.phase_s(s.now_ns) < self._params.mission.expert.adopt_s
        )

    def _grounded(self, s: MissionInputs) -> str:
        """Why it stays on the ground, or an empty text."""
        silent = self._ground_lost and self._params.ground.lost_action is not LossAction.CONTINUE
        stale = not_fresh(s, self._params, len(self.remaining)) if self.phase is Phase.SWAP else ""
        return stale or not_ready(s, self._params, silent)

    # Changing phase

    def _change(self, s: MissionInputs, phase: Phase, trigger: Trigger) -> None:
        before, self.phase = self.phase, phase
        self._stopped |= trigger is Trigger.STOP
        planned = (trigger is Trigger.ROUTE_DONE or before is Phase.LAND) and not self._stopped
        if trigger in {Trigger.DWELLED, Trigger.ROUTE_DONE}:
            self._route.note_visit(s.now_ns)
        self._scan.changed(s, before, phase, trigger, self.goal, self._relocator.shift_m)
        if trigger is Trigger.DWELLED:
            self._go_on(s)
        if trigger is Trigger.ARRIVED:
            self._steering.anchor = (self.goal.x_m, self.goal.y_m)
        if phase in {Phase.HOLD, Phase.RELOCATE} or (phase is Phase.LAND and not planned):
            self._steering.anchor = (s.pose.x_m, s.pose.y_m) if s.pose is not None else self._steering.anchor
        if phase is Phase.HOLD and s.localised:
            self._steering.anchor = s.warnings.line_m
        self._on_pad_leg = phase is Phase.LAND and planned
        unplanned = phase in {Phase.LAND, Phase.ABORTED, Phase.PILOT} and not planned
        if phase is Phase.DONE:
            if not self._aborting and self._scan.blind:
                self._aborting, self._cause = True, self._scan.blind
                self._events.tell(s.now_ns, EventLevel.ERROR, "not_counted", self._cause)
            self.phase = Phase.ABORTED if self._aborting else Phase.DONE
            self._cause = self._cause if self._aborting else "landed on the pad"
        else:
            refused = trigger is Trigger.TIMED_OUT and s.vehicle is not None and s.vehicle.refusal
            self._cause = f"{trigger.value}: {s.vehicle.refusal}" if refused and s.vehicle else trigger.value
        self.reason = self._cause
        self._aborting |= unplanned
        stopped = phase in {Phase.HOLD, Phase.RELOCATE}
        level = EventLevel.WARNING if unplanned or stopped else EventLevel.INFO
        self._events.tell(s.now_ns, level, "phase", f"{before.value} -> {self.phase.value}: {self.reason}")
        self._progress.begin(s, self.phase)
        if phase is Phase.LAND:
            self._steering.land()
        self._relocate(s, trigger)
        if phase is Phase.SWAP:
            self._steering.anchor = (self.goal.x_m, self.goal.y_m)
            self._charging.await_battery(s.now_ns)
            self._aborting, self._started = False, self._autostart
        if phase is Phase.TAKE_OFF:
            self._steering.take_off(s.height_m)
        if phase is Phase.RECOVER and s.vehicle is not None:
            # where it is, and so the way home, is not known
            self._found_flying = self._route.returning = True
            text = f"found flying in mode {s.vehicle.mode} at {s.height_m:.1f} m: level, then landing"
            self._events.tell(s.now_ns, EventLevel.ERROR, "restart", text)

    def _go_on(self, s: MissionInputs) -> None:
        """To the next stop, which is the way back where the battery does not reach another one."""
        if self._charging.look_ahead(s.now_ns):
            self._turned_back()
        self._route.advance(self._scan.heading_kept(s, self.goal, self._route.next_stop))

    def _relocate(self, s: MissionInputs, trigger: Trigger) -> None:
        """Begin to look for the position, or go on from where it was found."""
        if trigger is Trigger.POSITION_SURE:
            self._rejoin(s)
        elif self.phase is Phase.RELOCATE:
            self._relocator.begin()
            places = ", ".join(f"{node} {share:.0%}" for node, share in s.rivals[:5])
            if places:
                self._events.tell(s.now_ns, EventLevel.WARNING, "position", f"doubted, it may be {places}")

    def _correct(self, s: MissionInputs) -> None:
        """The drone is not where it was believed to be: what was held in metres moves along."""
        dx, dy = self._relocator.jump_m
        if s.pose is None or not self.airborne:
            return
        self._events.tell(s.now_ns, EventLevel.WARNING, "position", f"corrected: it is {s.pose.node}")
        self._steering.begin_anew()
        if self.phase is Phase.LAND and self._on_pad_leg:  # not across the floor at landing height
            self._on_pad_leg, self._steering.anchor = False, (s.pose.x_m, s.pose.y_m)
            self._aborting, self.reason = True, "the position was corrected while landing"
        else:
            x, y = self._steering.anchor
            self._steering.anchor = (x + dx, y + dy)

    def _rejoin(self, s: MissionInputs) -> None:
        """Go on from where the drone turned out to be."""
        if s.pose is None:
            return
        self._route.recount(s.now_ns, self._scan.take_due(self._route.visited))
        self._route.rejoin(s.now_ns, s.pose)

    @property
    def remaining(self) -> tuple[str, ...]:
        """The stops that this mission still wants to visit, in order."""
        return self._route.remaining

    def _go_home(self, now_ns: int, reason: str, *, in_need: bool = False) -> None:
        """Fly to the home pad; `in_need` by the shortest way, against one-way lines too."""
        self._route.turn_home(now_ns, reason, in_need=in_need)
        self._paused, self._aborting = False, True

    def _turned_back(self) -> None:
        """The battery ends this flight, and the mission unless another one goes on."""
        self._paused, self._aborting = False, not self._charging.goes_on

    # What to do

    def _guide(self, s: MissionInputs) -> Guidance:
        if self.phase in _WAITING:
            self.reason = self._grounded(s) or "waiting for the start command"
        if not self.airborne:
            return self._steering.on_ground(self.phase, _DEMANDS.get(self.phase, Demand.FLY))
        guidance = self._steering.step(s, self._task(s.now_ns))
        if self.phase is Phase.LAND:
            refused = guidance.demand is Demand.DISARM and s.vehicle is not None and s.vehicle.refusal
            self.reason = f"{self._cause}: {s.vehicle.refusal}" if refused and s.vehicle else self._cause
        return guidance

    def _leads_along_x(self) -> bool:
        """The way to the goal is along its aisle, not from one aisle to another."""
        goal, (x_m, y_m) = self.goal, self._steering.anchor
        return abs(goal.x_m - x_m) >= abs(goal.y_m - y_m)

    def _task(self, now_ns: int) -> ReferenceTask:
        route = self._route
        # from a shelf's lowest level neither aisle's line would be seen on the way to another aisle
        cruise = route.returning or not route.goal.visit or not self._leads_along_x()
        return ReferenceTask(
            phase=self.phase,
            phase_s=self._progress.phase_s(now_ns),
            goal=route.goal,
            view=self._scan.view(self.phase),
            cruise=cruise,
            on_pad=self._on_pad_leg,
            stopped=self._stopped,
            unknown=self._found_flying,
        )
