"""The mission: what to do now, from what is known now.  Pure: time and data in, guidance out.

Which phase follows is `machine`'s to say.  This is what belongs to each change: the route, the scan and the
reference are led along, and events are reported.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from flightd.config.hazards import LossAction
from flightd.config.schema import Config
from flightd.core.count_choice import ALL, CountChoice
from flightd.core.errors import InputError
from flightd.core.outlook import Outlook
from flightd.core.planned_flight import PlannedFlight, StandingPlan
from flightd.core.types import Command, CommandKind, Demand, Event, EventLevel, GridPose, Phase
from flightd.mission.battery.swap import BatterySwap
from flightd.mission.counted_way import CountedWay
from flightd.mission.event_log import EventLog
from flightd.mission.flight.leg_direction import LegDirection, leads_along_x
from flightd.mission.flight.phase_progress import PhaseProgress
from flightd.mission.flight.reference import ReferenceGenerator, ReferenceTask
from flightd.mission.flight.relocation import Relocator
from flightd.mission.guidance import CEILING_MARGIN_M, Guidance, MissionInputs
from flightd.mission.hazard_reporter import NEAR_FLOOR, HazardReporter
from flightd.mission.machine import (
    BEGIN,
    COMMANDS,
    TABLE,
    Cause,
    Intent,
    next_state,
    possible_commands,
    taken_in,
)
from flightd.mission.orders import StandingOrders, refusal
from flightd.mission.phase_reporter import PhaseReporter
from flightd.mission.plan.flight_plan import FlightPlan, HeadingPolicy, Stop
from flightd.mission.plan.itinerary import Itinerary
from flightd.mission.plan_in_hand import PlanInHand
from flightd.mission.reasons import Happened, Reason, in_words
from flightd.mission.safety.hazard_monitor import TAKEN_OVER, FlightContext, HazardMonitor
from flightd.mission.safety.loss_actions import LossActions
from flightd.mission.scan.no_scan import NO_SCAN, AnyScanner
from flightd.mission.scan.shelf_scan import ShelfScan
from flightd.mission.start_clearance import StartClearance
from flightd.mission.triggers import Trigger
from flightd.site.site import Site

_OVER_PAD_M = 0.5
"""So near its centre a landing goes on onto the pad, whatever the position was taken for before."""
_VISITED = (Trigger.DWELLED, Trigger.ROUTE_DONE)


class Mission:
    """One flight of one plan: call `step` at a fixed rate, `drain_events` for what happened.

    With a `scanner` the locations of each visited node are counted; `overhead_m` are the heights below the
    keep-outs (`Site.overhead_m`); with `autostart` (None: as configured) it waits for no start command."""

    def __init__(
        self,
        site: Site,
        plan: FlightPlan,
        policy: HeadingPolicy,
        config: Config,
        scanner: AnyScanner = NO_SCAN,
        overhead_m: Sequence[float] = (),
        *,
        autostart: bool | None = None,
    ) -> None:
        start = site.nodes[plan.start]
        self._params = config.mission
        self._plan = PlanInHand(site, plan, policy, config, scanner)
        self._armed = False
        """The vehicle was armed at the newest tick."""
        self._pose: GridPose | None = None
        self._events = EventLog()
        self._orders = StandingOrders()
        by_itself = config.mission.autostart if autostart is None else autostart
        self._clearance = StartClearance(config, self._events, autostart=by_itself)
        self._losses = LossActions(config, self._events)
        self._hazards = HazardReporter(self._events)
        self._route = Itinerary(site, plan, policy, self._events)
        self._route.wanted = scanner.wants
        self._scan = ShelfScan(site, scanner)
        self._counting = CountedWay(self._route, self._scan)
        self._progress = PhaseProgress(config, self._route, self._scan, scanner)
        self._monitor = HazardMonitor(config)
        self._relocator = Relocator(config.mission, site.ceiling_m - CEILING_MARGIN_M, overhead_m)
        self._steering = ReferenceGenerator(
            config, site, self._monitor, self._relocator, (start.x_m, start.y_m, plan.start_yaw_rad)
        )
        self._charging = BatterySwap(site, policy, config, scanner, self._route, self._monitor)
        self._reporter = PhaseReporter(self._events, self._route, self._scan)
        self.state = BEGIN
        self._awaits_more = False
        """It holds at the end of its way."""
        self._swapped = False
        """It has landed for a fresh battery, and goes on with nothing less."""
        self._leg = LegDirection()
        self._obstacles: tuple[Reason, ...] = ()
        self._await_start()

    @property
    def phase(self) -> Phase:
        """What it does now."""
        return self.state.phase

    @property
    def reason(self) -> str:
        """Why it does that, in words; empty before the first tick."""
        return self._reporter.reason

    @property
    def airborne(self) -> bool:
        """The mission believes the drone to fly and answers for it."""
        return self.state.airborne

    @property
    def plan(self) -> FlightPlan:
        """The plan that is flown, or would be with the next start."""
        return self._plan.plan

    @property
    def goal(self) -> Stop:
        """The stop flown to or hovered at."""
        return self._route.goal

    @property
    def height_goal_m(self) -> float:
        """The height above the floor that it flies at or makes for; 0 on the ground and in a landing."""
        return self._steering.height_goal_m if self.airborne else 0.0

    @property
    def view_m(self) -> tuple[float, float] | None:
        """Where on the map it looks at a shelf from, or flies to for that; None while it does not scan."""
        view = self._scan.view(self.phase)
        return None if view is None else (view.x_m, view.y_m)

    @property
    def stand(self) -> tuple[str, float]:
        """The node on which the drone stands before it flies, and its heading there."""
        return self._route.stand

    @property
    def visited(self) -> Sequence[str]:
        """The nodes visited, in order."""
        return self._route.visited

    @property
    def remaining(self) -> tuple[str, ...]:
        """The stops that this mission still wants to visit, in order."""
        return self._route.remaining

    @property
    def possible_commands(self) -> frozenset[CommandKind]:
        """What an operator may order now; no start before the flight is ready."""
        possible = possible_commands(self.state)
        held = self.state.waiting and not self._clearance.is_ready
        withheld = {CommandKind.START} if held else set()
        return possible - withheld - ({CommandKind.PLAN} if self._armed else set())

    @property
    def standing(self) -> StandingPlan:
        """What is told of the plan that is flown, or would be with the next start."""
        return self._plan.standing(self.visited, self.remaining)

    def planned(
        self, nodes: Sequence[str], choice: CountChoice = ALL, *, best_order: bool, waits: bool = False
    ) -> PlannedFlight:
        """What a flight over the nodes would be, from the pad that it stands on first and with the battery as
        it is told now (none: what the configuration says); changes nothing.  InputError where it
        cannot be flown."""
        return self._plan.planned(nodes, choice, self._charging.charge, best_order=best_order, waits=waits)

    def outlook(self, now_ns: int) -> Outlook:
        """What it expects and what troubles it."""
        left_s, home_s = self._charging.endurance_s
        return Outlook(
            hazards=self._events.hazards(now_ns),
            obstacles=tuple(map(in_words, self._obstacles)) if self.state.waiting else (),
            way=self._route.way,
            battery_left_s=left_s,
            home_s=home_s,
            plan=self._plan.id,
            waits_at=self._route.waits_at,
            lands_at=self._route.lands_at,
        )

    def drain_events(self) -> tuple[Event, ...]:
        return (*self._events.drain(), *self._scan.drain_events())

    def command(self, command: Command, now_ns: int) -> None:
        """Take an operator's order; a landing or stop acts at the next step."""
        kind, trigger = command.kind, COMMANDS[command.kind]
        self._events.report(now_ns, EventLevel.INFO, "command", f"{kind.value} {command.node}".strip())
        if trigger not in taken_in(self.state):
            self._events.report(now_ns, EventLevel.WARNING, "command", refusal(command, self.state))
            return
        if kind is CommandKind.PLAN:
            self._take_plan(command, now_ns)
            return
        if self.state.waiting and kind in {CommandKind.START, CommandKind.PAUSE}:
            if kind is CommandKind.START and command.plan and command.plan != self._plan.id:
                text = "start refused: another plan stands than the one that it was given for"
                self._events.report(now_ns, EventLevel.WARNING, "command", text)
                return
            self._take_start(trigger, now_ns)
            return
        if self.phase is Phase.ARMING and kind is CommandKind.PAUSE:
            self._clearance.take_back(now_ns)
            return
        self._orders.take(kind)
        if kind is CommandKind.HOME:
            self._go_home(trigger, Happened(trigger), now_ns)
        elif kind is CommandKind.GOTO:
            self._route.shorten(self._pose)
            halted = self.phase is Phase.HOLD
            waits, lands = command.waits, command.lands
            if self._route.go_to(now_ns, command.node, waits=waits, lands=lands, halted=halted):
                self._plan.count_at(command.node, command.counts)

    def _take_plan(self, command: Command, now_ns: int) -> None:
        """Fly other nodes with the next start, or again what the configuration says; one that cannot be flown
        changes nothing."""
        if self._armed:
            self._events.report(now_ns, EventLevel.WARNING, "command", "plan refused: the vehicle is armed")
            return
        try:
            text = self._plan.take(command)
        except InputError as err:
            self._events.report(now_ns, EventLevel.WARNING, "command", f"plan refused: {err}")
            return
        self._route.begin(self.plan)
        self._events.report(now_ns, EventLevel.INFO, "plan", text)

    def _take_start(self, trigger: Trigger, now_ns: int) -> None:
        """Begin a start's count-down if nothing keeps the drone on the ground, or take it back."""
        if trigger is Trigger.PAUSE:
            self._clearance.take_back(now_ns)
        elif self.state.intent is not Intent.WAIT:
            self._clearance.report_waiting(now_ns)
            return
        elif not self._clearance.give(now_ns):
            return
        self._turn(trigger)

    def step(self, inputs: MissionInputs) -> Guidance:
        """Advance by one tick."""
        self._armed, self._pose = inputs.vehicle is not None and inputs.vehicle.armed, inputs.pose
        self._pass_by(inputs)
        doubts = self._relocator.step(inputs, self.phase, self._progress.phase_s(inputs.now_ns))
        if self._relocator.jumped:
            self._correct(inputs)
        if Trigger.POSITION_SURE in doubts and not self._route.leads_on_from(inputs.pose):
            doubts = {Trigger.CUT_OFF}
        triggers = self._triggers(inputs) | doubts | self._scan.doubts(self.phase)
        self._hazards.report(inputs.now_ns, triggers, self.state)
        _, trigger = next_state(self.state, triggers)
        if trigger is not None:
            self._begin(inputs, trigger)
            self._orders.acted_on(trigger)
        return self._guide(inputs)

    # What has happened

    def _triggers(self, s: MissionInputs) -> set[Trigger]:
        """What has happened by this tick.  Turning back acts at once."""
        arming, waiting = self.phase is Phase.ARMING, self.state.waiting
        obstacle = self._grounded(s) if arming or waiting else None
        ordered = self.state.intent is Intent.VISIT
        may_start = waiting and self._clearance.may_start(s.now_ns, obstacle, ordered=ordered)
        found = self._progress.step(s, self.state, may_start=may_start)
        found |= self._orders.urgent
        if self._losses.ground_lost(s):
            found |= self._lost(self._losses.of_ground_link, Trigger.GROUND_LOST, s.now_ns)
        if self._orders.paused:
            found.add(Trigger.HOLD)
        found |= self._heed_battery(s)
        if self._progress.timed_out(s, self.phase):
            found.add(Trigger.TIMED_OUT)
        if s.failed:
            found.add(Trigger.STEP_FAILED)
        if arming:
            found = self._clearance.while_arming(found, s, obstacle)
        elif waiting and self._clearance.is_void(s.now_ns, obstacle):
            found.add(Trigger.START_EXPIRED)
            self._clearance.void(s.now_ns)
            self._clearance.report_void(s.now_ns, obstacle)
            self._turn(Trigger.START_EXPIRED)
        if Trigger.FOUND_FLYING in found:  # an order to land or stop stands until it may be obeyed
            found -= self._orders.urgent
        waits = self._awaits_more and self.goal.waits
        found |= self._monitor.step(s, self._situation(waits or Trigger.HOLD in found))
        for lost, action in self._losses.on_board.items():
            if lost in found:
                found.remove(lost)
                found |= self._lost(action, lost, s.now_ns)
        if Trigger.HOLD in found:
            found.discard(Trigger.LINES_FOUND)
        if Trigger.DISARMED in found and self.state.on_pad:
            found |= self._landed()
        return found - TAKEN_OVER if self._progress.adopting(s, self.phase) else found

    def _heed_battery(self, s: MissionInputs) -> set[Trigger]:
        """Turn back, or end a pause on the way back, when the charge asks for it; land when it is spent."""
        pressed = self._charging.presses
        self._turn_back(self._charging.step(s, self.state))
        if self._charging.presses and not pressed and self._orders.paused and self.state.returning:
            self._orders.paused = False
            text = "pause ended: the charge only just suffices for the way back"
            self._events.report(s.now_ns, EventLevel.WARNING, "battery", text)
        return {Trigger.BATTERY_CRITICAL} if self._charging.is_spent(s) else set()

    def _landed(self) -> set[Trigger]:
        """What a landing on the pad is more than its end."""
        if self._charging.swaps:
            return {Trigger.DOWN_TO_SWAP}
        if self._route.lands_as_told:
            return {Trigger.DOWN_AS_TOLD}
        return {Trigger.NOT_COUNTED} if self._scan.blind else set()

    def _lost(self, action: LossAction, trigger: Trigger, now_ns: int) -> set[Trigger]:
        """What the configured action makes of something lost."""
        self._hazards.report_loss(now_ns, trigger, action, self.state)
        if action is LossAction.HOME and Trigger.HOME_IN_NEED in taken_in(self.state):
            self._go_home(Trigger.HOME_IN_NEED, Happened(trigger), now_ns)
        holds = set() if self._charging.presses else {Trigger.HOLD}
        return {LossAction.HOLD: holds, LossAction.LAND: {trigger}}.get(action, set())

    def _situation(self, paused: bool) -> FlightContext:
        return FlightContext(
            self.airborne,
            paused,
            self._leg.step(self.phase, self.goal, self._steering.anchor),
            self.phase is Phase.HOLD,
            at_height=self.airborne and self.phase not in NEAR_FLOOR,
            takes_off=self.phase is Phase.TAKE_OFF,
        )

    def _grounded(self, s: MissionInputs) -> Reason | None:
        """Why it stays on the ground, None if nothing keeps it there."""
        stops_left = len(self.remaining) if self._swapped else None
        arming = self.phase is Phase.ARMING
        self._obstacles = self._clearance.obstacles(s, stops_left, self._losses.ground_silent, arming=arming)
        return next(iter(self._obstacles), None)

    # Changing the intent of the phase in hand

    def _turn(self, trigger: Trigger) -> None:
        """Take what goes on in the same phase for something else."""
        outcome = TABLE[self.state][trigger]
        if outcome is not None:
            self.state = outcome.state
            if outcome.cause is Cause.TRIGGER:
                self._reporter.turn(trigger)

    def _go_home(self, trigger: Trigger, reason: Reason, now_ns: int) -> None:
        """Fly to the home pad; in need by the shortest way, against one-way lines too."""
        self._route.shorten(self._pose)
        self._route.turn_home(now_ns, reason, in_need=trigger is Trigger.HOME_IN_NEED)
        self._turn_back(trigger)

    def _turn_back(self, trigger: Trigger | None) -> None:
        """The route leads to a pad now; whoever paused the flight wants that, too."""
        if trigger is not None:
            self._orders.paused = False
            self._turn(trigger)

    def _await_start(self) -> None:
        """On the ground before a flight: with autostart nobody has to order it."""
        if self._clearance.autostart:
            self._turn(Trigger.START)

    # Changing phase

    def _begin(self, s: MissionInputs, trigger: Trigger) -> None:
        """Begin the phase that a trigger leads to, with all that belongs to it."""
        before, outcome = self.state, TABLE[self.state][trigger]
        if outcome is None:
            return
        self.state, self._awaits_more = outcome.state, trigger is Trigger.AWAITS_MORE
        if trigger in _VISITED and not before.returning and not self._scan.legs:
            self._route.note_visit(s.now_ns)
        self._scan.follow(s, before.phase, self.phase, trigger, self.goal, self._relocator.shift_m)
        if trigger is Trigger.ARRIVED:
            self._scan.look_ahead(s, self.goal, () if self.state.returning else self._route.run)
        if trigger is Trigger.DWELLED:
            self._go_on(s)
        self._anchor(s, trigger)
        self._reporter.begin(s, before, self.state, trigger, outcome.cause, self._progress.phase_s(s.now_ns))
        goes_on = before.phase is Phase.LAND and trigger is Trigger.STOP
        self._progress.begin(s, self.phase, goes_on=goes_on)
        if not goes_on:
            self._enter(s, trigger)

    def _anchor(self, s: MissionInputs, trigger: Trigger) -> None:
        """Where the phase that begins holds, if it holds anywhere."""
        here = self._steering.anchor if s.pose is None else (s.pose.x_m, s.pose.y_m)
        if trigger is Trigger.ARRIVED:
            self._steering.anchor = (self.goal.x_m, self.goal.y_m)
        elif self.phase is Phase.HOLD and s.localised:
            self._steering.anchor = s.warnings.line_m
        elif self.state.halted or (self.phase is Phase.LAND and not self.state.on_pad):
            self._steering.anchor = here

    def _enter(self, s: MissionInputs, trigger: Trigger) -> None:
        """What the phase that begins starts with."""
        match self.phase:
            case Phase.PREFLIGHT if trigger is Trigger.DOWN_AS_TOLD:
                self._stand(s)
            case Phase.PREFLIGHT:
                self._await_start()
            case Phase.TAKE_OFF:
                self._clearance.withdraw()
                self._steering.take_off(s.height_m)
            case Phase.ACQUIRE if trigger is Trigger.POSITION_SURE:
                self._counting.rejoin(s, returning=self.state.returning)
            case Phase.RELOCATE:
                self._relocator.begin()
                self._reporter.doubt(s)
            case Phase.LAND:
                self._steering.land(by_itself=trigger is Trigger.TIMED_OUT)
            case Phase.SWAP:
                self._swapped = True
                self._steering.anchor = (self.goal.x_m, self.goal.y_m)
                self._charging.await_battery(s.now_ns)
                self._await_start()
            case Phase.RECOVER if s.vehicle is not None:
                text = f"found flying in mode {s.vehicle.mode} at {s.height_m:.1f} m: level, then landing"
                self._events.report(s.now_ns, EventLevel.ERROR, "restart", text)

    def _stand(self, s: MissionInputs) -> None:
        """On the pad that it was told: the next flight begins here, and somebody has to order it."""
        goal = self.goal
        self._steering.anchor = (goal.x_m, goal.y_m)
        self._clearance.autostart = self._swapped = False
        if self._scan.blind is not None:
            self._events.report(s.now_ns, EventLevel.ERROR, "not_counted", in_words(self._scan.blind))
        self._scan.count_anew()
        self._route.begin(self._plan.begin_at(goal.node, goal.yaw_rad))
        self._charging.begin_anew()  # nothing is done yet

    def _go_on(self, s: MissionInputs) -> None:
        """To the next stop, which is the way back where the battery does not reach another one."""
        if not self.state.returning:
            self._counting.lead_on(s.now_ns, self.goal)
            self._turn_back(self._charging.look_ahead(s.now_ns))
        self._counting.advance(s, self.goal)

    def _pass_by(self, s: MissionInputs) -> None:
        """What is flown past is decided, and its nodes are visited."""
        self._counting.step(s, self.goal, returning=self.state.returning)
        known = s.localised and s.is_sure(self._params)
        if self.phase is Phase.FOLLOW and known and s.pose is not None and not self.state.returning:
            self._route.note_passed(s.now_ns, s.pose)

    def _correct(self, s: MissionInputs) -> None:
        """The drone is not where it was believed to be: what was held in metres moves along."""
        dx, dy = self._relocator.jump_m
        if s.pose is None or not self.airborne:
            return
        self._events.report(s.now_ns, EventLevel.WARNING, "position", f"corrected: it is {s.pose.node}")
        self._steering.begin_anew()
        if self.state.on_pad and s.pad_m is not None and s.distance_m(s.pad_m) < _OVER_PAD_M:
            return  # it is still coming down on its pad
        if self.state.on_pad:
            self._steering.anchor = (s.pose.x_m, s.pose.y_m)
        else:
            x, y = self._steering.anchor
            self._steering.anchor = (x + dx, y + dy)
        self._turn(Trigger.POSITION_CORRECTED)

    # What to do

    def _guide(self, s: MissionInputs) -> Guidance:
        if self.state.waiting:
            self._reporter.wait(self._clearance.wait(self._grounded(s), s.now_ns))
        if not self.airborne:
            guidance = self._steering.on_ground(s, self.phase)
            disarms = self.state.waiting and self._clearance.disarms(s.now_ns)
            return replace(guidance, demand=Demand.DISARM) if disarms else guidance
        guidance = self._steering.step(s, self._task(s.now_ns))
        if self.state.halted:
            self._reporter.halt(paused=self._orders.paused)
        if self.phase is Phase.LAND:
            disarms = s.vehicle is not None and guidance.demand is Demand.DISARM
            self._reporter.land(s.vehicle.refusal if s.vehicle is not None and disarms else None)
        return guidance

    def _task(self, now_ns: int) -> ReferenceTask:
        # from a shelf's lowest level neither aisle's line would be seen on the way to another aisle
        along_x = leads_along_x(self.goal, self._steering.anchor)
        cruise = self.state.returning or not self.goal.visit or not along_x
        view = self._scan.view(self.phase)
        goal = self._scan.paced(self.goal)
        return ReferenceTask(self.state, self._progress.phase_s(now_ns), goal, view, cruise)
