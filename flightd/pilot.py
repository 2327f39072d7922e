"""One pure step of flying: what came in since the last tick -> what goes out now.

The same step flies, simulates and replays: it reads no clock, opens nothing and keeps all its state in
itself.  Order: telemetry and lines into the tracks, tracks to a pose on the grid, the mission decides,
control turns its reference into a setpoint, the limits have the last word.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from flightd.config.schema import Config
from flightd.control.flight_controller import FlightController, Motion
from flightd.control.limits import Limiter, Surroundings
from flightd.core.scanning import Place
from flightd.core.tick import TICK_S, StepFailure, TickInput, TickOutput
from flightd.core.tracks import TrackSet
from flightd.core.types import (
    AttitudeSetpoint,
    CommandKind,
    Demand,
    GridPose,
    Phase,
    VehicleState,
)
from flightd.localisation.grid_localiser import GridLocaliser
from flightd.localisation.pad_finder import PadFinder
from flightd.localisation.pose_history import PoseHistory
from flightd.mission.guidance import Guidance, Guide, MissionInputs
from flightd.mission.mission import Mission
from flightd.mission.plan.flight_plan import FlightPlan, HeadingPolicy
from flightd.mission.safety.last_resort import LastResort
from flightd.mission.safety.plausibility_monitor import PlausibilityMonitor
from flightd.mission.scan.no_scan import NO_SCAN, AnyScanner
from flightd.site.site import Site
from flightd.tracking.attitude_extrapolation import AttitudeExtrapolation
from flightd.tracking.battery_charge import BatteryCharge
from flightd.tracking.frame_monitor import FrameMonitor
from flightd.tracking.height_history import HeightHistory
from flightd.tracking.line_tracker import LineTracker
from flightd.tracking.stuck_height import StuckHeight

_FRAMES_ARRIVE_S = 0.5
_TOUCHDOWN_S = 2.0


class Pilot:
    """The whole flying state of one mission.

    `overhead_m` are the heights below the keep-outs, also of those that `site` leaves out because the
    flight's own heights pass them by; `autostart` is the order's, None: the configuration's."""

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
        self._config = config
        self._plan = plan
        self._site = site
        self._scanner = scanner
        self._mission = Mission(site, plan, policy, config, scanner, overhead_m, autostart=autostart)
        self._begin()
        self._heights = HeightHistory()
        self._charge = BatteryCharge(config.battery)
        self._control = FlightController(config.control)
        self._limiter = Limiter(config.control)
        self._armed = False
        self._last_ns: int | None = None
        self._last_yaw: float | None = None
        self._yaw_rate = 0.0
        self._frames = FrameMonitor()
        self._plausibility = PlausibilityMonitor(site, config)
        self._extrapolation = AttitudeExtrapolation()
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
    def mission(self) -> Mission:
        return self._mission

    @property
    def possible_commands(self) -> frozenset[CommandKind]:
        """What an operator may order now; nothing once the mission is not stepped any more."""
        return frozenset() if self._last_resort.given_up else self._mission.possible_commands

    @property
    def plan(self) -> FlightPlan:
        """The plan at the start of the flight."""
        return self._plan

    @property
    def exposure(self) -> float:
        """What the front camera's pictures are wanted with, as a part of its usual exposure."""
        return self._scanner.exposure

    def places(self, stamp_ns: int) -> tuple[Place, ...]:
        """Which locations the front camera's picture exposed at `stamp_ns` is wanted for, and where it
        shows them; none while nothing is scanned.  Changes nothing."""
        if not self._scanner.looking:
            return ()
        pose = self._pose_history.at(stamp_ns)
        return self._scanner.places(pose) if pose is not None else ()

    def step(self, tick: TickInput) -> TickOutput:
        """Fly one tick.  Raises nothing: what goes wrong levels the drone at this tick and lands it from the
        next one, by the lines as long as that works, else by its autopilot."""
        resort = self._last_resort
        resort.failure = None
        if not resort.given_up:
            try:
                self._answered = self._fly(tick)
            except Exception as err:  # noqa: BLE001 - whatever it is, the drone has to come down
                resort.caught(tick.now_ns, err)
            else:
                return self._answered
        self._answered = resort.answer(tick, self._answered, self._mission.drain_events, self._scanner.drain)
        self._commanded = self._answered.setpoint
        return self._answered

    def _fly(self, tick: TickInput) -> TickOutput:
        now_ns = tick.now_ns
        dt_s = TICK_S if self._last_ns is None else max((now_ns - self._last_ns) * 1e-9, 1e-3)
        self._last_ns = now_ns
        for command in tick.commands:
            self._mission.command(command, now_ns)
        self._take(tick)
        height_m = self._heights.at(now_ns)
        tracks = self._tracker.at(now_ns)
        pose = None if tracks is None else self._localiser.step(tracks, height_m)
        if pose is not None:
            self._pose_history.add(pose)
        if tracks is not None and pose is not None:
            self._pads.step(tracks, pose)
        by_pad = None if pose is None else self._pads.over(pose, self._localiser.ever_matched)
        pose = by_pad or pose
        self._scan(tick)
        inputs = self._inputs(tick, dt_s, pose, height_m, tracks)
        inputs = replace(inputs, by_pad=by_pad is not None)
        guidance = self._mission.step(inputs)
        push_mps2 = (tracks.push_x_mps2, tracks.push_y_mps2) if tracks is not None else (0.0, 0.0)
        setpoint = self._commanded = self._setpoint(inputs, guidance, push_mps2)
        self._plausibility.steered(guidance, pose)
        mission = self._mission
        findings, settled = self._scanner.drain()
        return TickOutput(
            setpoint=setpoint,
            demand=guidance.demand,
            phase=mission.phase,
            reason=mission.reason,
            goal=mission.goal.node,
            visited=len(mission.visited),
            planned=self._plan.visits,
            pose=pose,
            tracks=tracks,
            events=mission.drain_events(),
            findings=findings,
            settled=settled,
        )

    def _scan(self, tick: TickInput) -> None:
        """Give each picture's codes to the scan, with the pose at its exposure, and the location labels
        among them to the localiser."""
        if tick.counted:
            self._scanner.skip(tick.counted)
        for codes in tick.codes:
            pose = self._pose_history.at(codes.stamp_ns)
            if pose is not None:
                self._scanner.take(codes, pose)
        for seen in self._scanner.drain_sightings():
            self._localiser.sighted(seen.location, seen.dx_m, seen.dy_m)

    def _begin(self) -> None:
        """Stand on the pad and know nothing else."""
        node, yaw_rad = self._mission.stand
        camera, control = self._config.camera, self._config.control
        self._tracker = LineTracker(
            camera.lens(),
            camera.mount(),
            self._site.line_width_m,
            yaw_rad,
            control.tilt_compensation,
            self._config.tracking,
        )
        view = camera.floor_reach(control.max_tilt_rad)
        self._localiser = GridLocaliser(self._site, node, view, self._config.localisation)
        self._pose_history = PoseHistory(self._scanner.least_integrity)
        self._pads = PadFinder(self._site)
        self._stuck = StuckHeight()

    def _take(self, tick: TickInput) -> None:
        """Telemetry first: a frame needs the attitude and height of its exposure.

        What was seen before arming says nothing: until then the drone may have been carried about.  The
        flight starts on the pad, in the plan's heading.  Nor is anything dead-reckoned once it is disarmed.
        """
        armed = tick.vehicle is not None and tick.vehicle.armed
        if armed is not self._armed:
            self._begin()
        self._armed = armed
        for sample in tick.attitudes:
            self._tracker.attitude(sample)
            self._pose_history.add_attitude(sample)
        heard = tick.vehicle.attitude if tick.vehicle is not None else None
        assumed = self._extrapolation.step(tick.now_ns, heard, self._commanded)
        if assumed is not None:
            self._tracker.assume(assumed)
        if tick.vehicle is not None:
            v = tick.vehicle
            if not self._stuck.found:
                self._heights.add(v.height_stamp_ns, v.height_m, v.climb_mps)
            self._mind_height(tick.now_ns, v)
        for lines in tick.lines:
            if self._frames.take(lines) and armed:
                self._tracker.frame(lines, self._heights.at(lines.stamp_ns))

    def _mind_height(self, now_ns: int, vehicle: VehicleState) -> None:
        """Forget the heights of a range finder that is found to be stuck: then the lines' width tells."""
        if not self._armed or self._commanded is None or self._stuck.found:
            return
        if self._stuck.step(now_ns, vehicle.height_m, vehicle.climb_mps, self._commanded.climb_mps):
            self._heights = HeightHistory()

    def _inputs(
        self, tick: TickInput, dt_s: float, pose: GridPose | None, height_m: float, tracks: TrackSet | None
    ) -> MissionInputs:
        now_ns, v = tick.now_ns, tick.vehicle
        x_ns, y_ns = self._localiser.seen_ns
        max_sigma_m = self._config.localisation.expert.max_sigma_m
        known = pose is not None and max(pose.covariance[0], pose.covariance[4]) < max_sigma_m**2
        seeking = self._mission.phase is Phase.RELOCATE
        doubted = seeking or (pose is not None and pose.integrity < self._config.mission.integrity_min)
        return MissionInputs(
            now_ns=now_ns,
            dt_s=dt_s,
            pose=pose,
            localised=known and all(self._localiser.ever_matched),
            height_m=height_m,
            frames_arrive=self._frames.age_s(now_ns) < _FRAMES_ARRIVE_S,
            x_age_s=(now_ns - x_ns) * 1e-9 if x_ns else math.inf,
            y_age_s=(now_ns - y_ns) * 1e-9 if y_ns else math.inf,
            telemetry_age_s=math.inf if v is None else (now_ns - v.attitude.stamp_ns) * 1e-9,
            vehicle=v,
            judged_charge=self._charge.step(now_ns, v, flying=self._mission.airborne),
            ground_silent_s=tick.ground_silent_s,
            pad_m=self._pads.centre(self._mission.goal.node),
            rivals=tuple(self._localiser.rivals()) if doubted else (),
            way_out=self._localiser.way_out() if seeking else None,
            failed=self._last_resort.failed,
            unfit=tick.unfit,
            aisle_closed=tick.aisle_closed,
            warnings=self._plausibility.step(
                now_ns,
                dt_s,
                pose,
                height_m,
                tracks,
                self._tracker,
                self._frames,
                tick.health,
                self._stuck.found,
            ),
        )

    def _setpoint(
        self, inputs: MissionInputs, guidance: Guidance, push: tuple[float, float]
    ) -> AttitudeSetpoint | None:
        """What control makes of the guidance, within the limits; None when nothing may be sent."""
        now_ns, dt_s, pose = inputs.now_ns, inputs.dt_s, inputs.pose
        motion = self._motion(pose, self._plausibility.height_m(inputs.height_m), dt_s)
        control, reference = self._control, guidance.reference
        sight_s = min(inputs.x_age_s, inputs.y_age_s)
        if guidance.guide is Guide.NONE:
            control.reset()
            return None
        if guidance.guide is Guide.LEVEL or pose is None:
            wanted, age_s = control.level(now_ns, motion, reference, dt_s), 0.0
        elif guidance.guide is Guide.BRAKE:
            wanted = control.rest(now_ns, motion, reference, dt_s, push, dead_reckoned=guidance.dead_reckoned)
            age_s = min(inputs.telemetry_age_s, sight_s)
        else:
            wanted = control.step(now_ns, motion, reference, dt_s)
            # above the pad the mission steers on without lines: by the mat, or the motion last known
            by_mat = inputs.by_pad or (guidance.phase is Phase.LAND and sight_s < _TOUCHDOWN_S)
            age_s = inputs.telemetry_age_s if by_mat else max(sight_s, inputs.telemetry_age_s)
        around = Surroundings(
            headroom_m=inputs.warnings.headroom_m,
            back=self._plausibility.back(pose, inputs.warnings.line_m) if inputs.localised else None,
            data_age_s=age_s,
            at_once=guidance.at_once,
        )
        return self._limiter.apply(wanted, around)

    def _motion(self, pose: GridPose | None, height_m: float, dt_s: float) -> Motion:
        if pose is None:
            return Motion(0.0, 0.0, 0.0, 0.0, self._mission.stand[1], 0.0, height_m)
        if self._last_yaw is not None:
            turned = math.remainder(pose.yaw_rad - self._last_yaw, math.tau)
            self._yaw_rate += min(1.0, dt_s / 0.05) * (turned / dt_s - self._yaw_rate)
        self._last_yaw = pose.yaw_rad
        return Motion(pose.x_m, pose.y_m, pose.vx_mps, pose.vy_mps, pose.yaw_rad, self._yaw_rate, height_m)
