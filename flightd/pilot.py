"""One pure step of flying: what came in since the last tick -> what goes out now.

The same step flies, simulates and replays: it reads no clock, opens nothing and keeps all its state in
itself.  Order: telemetry and lines into the tracks, tracks to a pose on the grid, the mission decides,
control turns its reference into a setpoint, the limits have the last word.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from flightd.config.schema import Config
from flightd.core.learnt import LearntSensors
from flightd.core.scanning import Place
from flightd.core.tick import TICK_S, StepFailure, TickInput, TickOutput
from flightd.core.types import AttitudeSetpoint, Command, CommandKind, Demand, Phase
from flightd.localisation.state_estimator import Estimate, StateEstimator
from flightd.mission.flight.steering import Steering
from flightd.mission.guidance import Guidance, MissionInputs
from flightd.mission.mission import Mission
from flightd.mission.plan.flight_plan import FlightPlan, HeadingPolicy
from flightd.mission.safety.last_resort import LastResort, Sinking, sinking_by_sight
from flightd.mission.safety.plausibility_monitor import PlausibilityMonitor
from flightd.mission.scan.no_scan import NO_SCAN, AnyScanner
from flightd.site.site import Site
from flightd.tracking.battery_charge import BatteryCharge

_FRAMES_ARRIVE_S = 0.5


class Pilot:
    """The whole flying state of one mission.

    `overhead_m` are the heights below the keep-outs, also of those that `site` leaves out because the
    flight's own heights pass them by; `autostart` is the order's, None: the configuration's; `learnt` what
    earlier flights have learnt of the sensors."""

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
        learnt: LearntSensors | None = None,
    ) -> None:
        self._config = config
        self._scanner = scanner
        self._mission = Mission(site, plan, policy, config, scanner, overhead_m, autostart=autostart)
        self._estimator = StateEstimator(site, config, scanner.least_integrity, self._mission.stand, learnt)
        self._charge = BatteryCharge(config.battery)
        self._plausibility = PlausibilityMonitor(site, config)
        self._steering = Steering(config.control, self._plausibility)
        self._last_ns: int | None = None
        self._commanded: AttitudeSetpoint | None = None
        self._last_resort = LastResort(config.mission)
        self._answered = TickOutput(None, Demand.STANDBY, Phase.PREFLIGHT, "", "", 0, plan.visits, None, None)

    @property
    def phase(self) -> Phase:
        """What it answered last."""
        return self._answered.phase

    @property
    def reason(self) -> str:
        """Why, in words."""
        return self._answered.reason

    @property
    def failure(self) -> StepFailure | None:
        """What the newest step raised, None where it raised nothing."""
        return self._last_resort.failure

    @property
    def learnt(self) -> LearntSensors | None:
        """What the flight that ended last has learnt of the sensors, or those before it."""
        return self._estimator.learnt

    @property
    def mission(self) -> Mission:
        return self._mission

    @property
    def left_over(self) -> tuple[str, ...]:
        """The stops for a flight that goes on with this one, in order: first what was visited and would not
        count if this one ended now.  A mission that is done leaves nothing over: the next one is whole."""
        remaining = self._mission.remaining
        if self._mission.phase is Phase.DONE:
            return remaining
        return (*(node for node in self._scanner.unproven if node not in remaining), *remaining)

    @property
    def scanner(self) -> AnyScanner:
        """What counts the shelves."""
        return self._scanner

    @property
    def possible_commands(self) -> frozenset[CommandKind]:
        """What an operator may order now; nothing once the mission is not stepped any more."""
        resort = self._last_resort
        if resort.given_up:
            return frozenset({CommandKind.LAND, CommandKind.STOP}) if resort.sinks_by_sight else frozenset()
        return self._mission.possible_commands

    def another_resort(self) -> LastResort:
        """For whoever calls `step`: what catches there may fail, too."""
        return LastResort(self._config.mission)

    @property
    def plan(self) -> FlightPlan:
        """The plan at the start of the flight: the order's, or what was ordered since, before it flew."""
        return self._mission.plan

    @property
    def looks(self) -> bool:
        """Whether the front camera's pictures are wanted now."""
        return self._scanner.looking

    @property
    def exposure(self) -> tuple[float, float]:
        """What the front camera's pictures are wanted with, as parts of its usual exposure and gain."""
        return self._scanner.exposure

    def places(self, stamp_ns: int) -> tuple[Place, ...]:
        """Which locations the front camera's picture exposed at `stamp_ns` is wanted for, and where it
        shows them; none while nothing is scanned.  Changes nothing."""
        if not self._scanner.looking:
            return ()
        pose = self._estimator.poses.at(stamp_ns)
        return self._scanner.places(pose) if pose is not None else ()

    def evidence(self) -> frozenset[str]:
        """The pictures, of those that it was given, that a finding may still name.  Changes nothing."""
        return self._scanner.evidence

    def step(self, tick: TickInput) -> TickOutput:
        """Fly one tick.  Raises nothing: what goes wrong levels the drone at this tick and lands it from the
        next one, by the lines as long as that works, else by its autopilot."""
        resort = self._last_resort
        resort.failure = None
        resort.seen = tick.vehicle or resort.seen
        if not resort.given_up:
            try:
                self._answered = self._fly(tick)
            except Exception as err:  # noqa: BLE001 - whatever it is, the drone has to come down
                resort.caught(tick.now_ns, err)
            else:
                if self._answered.phase is Phase.RECOVER:
                    resort.found_flying()
                return self._answered
        self._answered = resort.answer(
            tick,
            self._answered,
            self._mission.drain_events,
            self._scanner.drain,
            lambda: self._sink_by_sight(tick),
        )
        self._commanded = self._answered.setpoint
        return self._answered

    def _since_last_s(self, now_ns: int) -> float:
        dt_s = TICK_S if self._last_ns is None else max((now_ns - self._last_ns) * 1e-9, 1e-3)
        self._last_ns = now_ns
        return dt_s

    def _fly(self, tick: TickInput) -> TickOutput:
        now_ns = tick.now_ns
        dt_s = self._since_last_s(now_ns)
        self._take(tick.commands, now_ns)
        # a vehicle that tells nothing has not disarmed: where the drone is would be forgotten
        armed = self._estimator.armed if tick.vehicle is None else tick.vehicle.armed
        if armed is not self._estimator.armed:
            self._estimator.begin(self._mission.stand, armed=armed)
            self._plausibility.begin()
        self._estimator.take(tick, self._commanded)
        known = self._estimator.step(now_ns)
        pose, tracks = known.pose, known.tracks
        self._scan(tick)
        inputs = self._inputs(tick, dt_s, known)
        guidance = self._mission.step(inputs)
        setpoint = self._commanded = self._steer(inputs, guidance, known)
        self._plausibility.steered(now_ns, guidance, pose)
        mission = self._mission
        findings, settled = self._scanner.drain()
        return TickOutput(
            setpoint=setpoint,
            demand=guidance.demand,
            phase=mission.phase,
            reason=mission.reason,
            goal=mission.goal.node,
            visited=len(mission.visited),
            planned=mission.plan.visits,
            pose=pose,
            tracks=tracks,
            events=mission.drain_events(),
            findings=findings,
            settled=settled,
            shared=known.shared,
        )

    def _steer(self, inputs: MissionInputs, guidance: Guidance, known: Estimate) -> AttitudeSetpoint | None:
        tracks = known.tracks
        push_mps2 = (tracks.push_x_mps2, tracks.push_y_mps2) if tracks is not None else (0.0, 0.0)
        stand_yaw_rad = self._mission.stand[1]
        return self._steering.step(inputs, guidance, push_mps2, stand_yaw_rad, known.lead, known.conditions)

    def _sink_by_sight(self, tick: TickInput) -> Sinking | None:
        """Without a step of the mission: what has failed may be that alone."""
        dt_s = self._since_last_s(tick.now_ns)
        self._estimator.take(tick, self._commanded)
        known = self._estimator.step(tick.now_ns)
        inputs = self._inputs(tick, dt_s, known)
        guidance = sinking_by_sight(inputs, self._config.mission.land_mps)
        setpoint = self._commanded = None if guidance is None else self._steer(inputs, guidance, known)
        return None if setpoint is None else Sinking(setpoint, known.shared)

    def _take(self, commands: Sequence[Command], now_ns: int) -> None:
        """Give the mission all orders, also those behind one that fails; its error is raised then."""
        failed: Exception | None = None
        for command in commands:
            try:
                self._mission.command(command, now_ns)
            except Exception as err:  # noqa: BLE001 - a stop may come behind it
                failed = failed or err
        if failed is not None:
            raise failed

    def _scan(self, tick: TickInput) -> None:
        """Give each picture's codes to the scan, with the pose at its exposure, and the location labels
        among them to the localiser."""
        if tick.counted:
            self._scanner.go_on_with(tick.counted)
        for codes in tick.codes:
            pose = self._estimator.poses.at(codes.stamp_ns)
            if pose is not None:
                self._scanner.take(codes, pose)
        for seen in self._scanner.drain_sightings():
            self._estimator.localiser.sighted(seen.location, seen.dx_m, seen.dy_m)

    def _inputs(self, tick: TickInput, dt_s: float, known: Estimate) -> MissionInputs:
        now_ns, v, pose = tick.now_ns, tick.vehicle, known.pose
        estimator, localiser = self._estimator, self._estimator.localiser
        x_ns, y_ns = localiser.told_ns
        features_ns = min(known.tracks.features_ns) if known.tracks is not None else 0
        max_sigma_m = self._config.localisation.expert.max_sigma_m
        precise = pose is not None and max(pose.covariance[0], pose.covariance[4]) < max_sigma_m**2
        seeking = self._mission.phase is Phase.RELOCATE
        doubted = seeking or (pose is not None and pose.integrity < self._config.mission.integrity_min)
        return MissionInputs(
            now_ns=now_ns,
            dt_s=dt_s,
            pose=pose,
            localised=precise and all(localiser.ever_matched),
            height_m=known.height_m,
            frames_arrive=estimator.frames.age_s(now_ns) < _FRAMES_ARRIVE_S,
            x_age_s=estimator.sight_age_s(now_ns, x_ns),
            y_age_s=estimator.sight_age_s(now_ns, y_ns),
            commanded=self._commanded,
            features_age_s=estimator.sight_age_s(now_ns, features_ns),
            telemetry_age_s=math.inf if v is None else estimator.telemetry_age_s(now_ns, v.attitude.stamp_ns),
            vehicle=v,
            judged_charge=self._charge.step(now_ns, v, flying=self._mission.airborne),
            ground_silent_s=tick.ground_silent_s,
            pad_m=estimator.pads.centre(self._mission.goal.node),
            by_pad=known.by_pad,
            rivals=tuple(localiser.rivals()) if doubted else (),
            way_out=localiser.way_out() if seeking else None,
            failed=self._last_resort.failed,
            unfit=tick.unfit,
            aisle_closed=tick.aisle_closed,
            warnings=self._plausibility.step(
                now_ns,
                dt_s,
                known,
                tracker=estimator.tracker,
                frames=estimator.frames,
                climb=estimator.climb,
                height_stuck=estimator.height_stuck,
                health=tick.health,
            ),
        )
