"""Faults of a simulated flight, done as the world would do them: to the floor, the air, the vehicle and its
cameras, never to the daemon.  What concerns the daemon's own processes is told to who started them.
"""

from __future__ import annotations

import asyncio
import math
import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.core.errors import InputError
from flightd.core.topics import Topic
from flightd.ports import Clock, Recorder
from flightd.sim.autopilot.autopilot import AutopilotPeer
from flightd.sim.floor.texture import Box
from flightd.sim.plant.airframe import Airframe, AirframeParams
from flightd.sim.plant.kinematics import OFF_FLOOR_M, Kinematics
from flightd.sim.plant.wind import Wind, WindParams
from flightd.sim.scenario.fault_schema import (
    AttitudeBiased,
    AttitudeSlow,
    BareFloor,
    BatteryDrop,
    CameraDisordered,
    CameraFault,
    CameraLate,
    CameraTurned,
    ChargeMisreported,
    ClimbDrifts,
    ClimbStuck,
    ClockJump,
    ClockRate,
    Fault,
    HeightBiased,
    HeightLost,
    HeightQuality,
    HeightScaled,
    HeightStuck,
    LandingUnreported,
    LinkFault,
    VehicleFault,
    WindChange,
)
from flightd.sim.sensors.camera import CameraPeer
from flightd.sim.sensors.instruments import SensorFault
from flightd.site.site import Site

_LOOKS_S = 0.01
_WITHHELD: Mapping[str, frozenset[int]] = {
    "heartbeat_silent": frozenset({dialect.MAVLINK_MSG_ID_HEARTBEAT}),
    "timesync_silent": frozenset({dialect.MAVLINK_MSG_ID_TIMESYNC}),
    "climb_silent": frozenset(
        {
            dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED,
            dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
            dialect.MAVLINK_MSG_ID_VFR_HUD,
        }
    ),
    "battery_silent": frozenset({dialect.MAVLINK_MSG_ID_BATTERY_STATUS, dialect.MAVLINK_MSG_ID_SYS_STATUS}),
}
"""Which messages a fault of the link keeps back."""
_HERE_M = 0.4

OF_ARDRONE = frozenset({"companion_dead"})
"""What can go wrong in a vehicle or its link that the simulated AR.Drone can have, too."""


@runtime_checkable
class OverRadio(Protocol):
    """A vehicle that is reached by radio alone: without it nothing passes either way."""

    radio: bool


FaultListener = Callable[[int, bool], None]
"""Called with a fault's number and whether it begins or ends."""


@dataclass(frozen=True, slots=True)
class FaultNote:
    """A fault began, or ended; `index` is its place in the scenario."""

    stamp_ns: int
    index: int
    kind: str
    began: bool


class FaultSchedule:
    """When each fault begins and ends, by the simulator's truth.  Pure: call `step` again and again."""

    def __init__(self, faults: Sequence[Fault], site: Site) -> None:
        """InputError for a node that the site does not have."""
        self._faults = tuple(faults)
        self._places = [place_of(fault, site) for fault in faults]
        self._begun_ns: dict[int, int] = {}
        self._over: set[int] = set()
        self._off_ns: int | None = None

    def step(self, now_ns: int, truth: Kinematics) -> list[tuple[int, bool]]:
        """What begins (True) and ends (False) now, by the faults' numbers."""
        if self._off_ns is None and truth.height_m >= OFF_FLOOR_M:
            self._off_ns = now_ns
        turns: list[tuple[int, bool]] = []
        for index, fault in enumerate(self._faults):
            begun_ns = self._begun_ns.get(index)
            if begun_ns is None:
                if self._due(fault, self._places[index], now_ns, truth):
                    self._begun_ns[index] = now_ns
                    turns.append((index, True))
            elif index not in self._over and (now_ns - begun_ns) * 1e-9 >= fault.duration_s:
                self._over.add(index)
                turns.append((index, False))
        return turns

    def _due(self, fault: Fault, place: tuple[float, float] | None, now_ns: int, truth: Kinematics) -> bool:
        if fault.from_start or self._off_ns is None:
            return fault.from_start
        if place is None:
            return fault.at_s is not None and (now_ns - self._off_ns) * 1e-9 >= fault.at_s
        dx_m, dy_m = abs(truth.x_m - place[0]), abs(truth.y_m - place[1])
        if isinstance(fault, BareFloor):
            return max(dx_m, dy_m) < fault.half_m
        return math.hypot(dx_m, dy_m) < _HERE_M


def place_of(fault: Fault, site: Site) -> tuple[float, float] | None:
    """Where it begins, None for one that begins at a time.  InputError for an unknown node."""
    if fault.at_node is not None:
        node = site.nodes.get(fault.at_node)
        if node is None:
            raise InputError(f"scenario: fault {fault.kind}: no node {fault.at_node} on site {site.name}")
        return node.x_m, node.y_m
    if fault.at_x_m is None or fault.at_y_m is None:
        return None
    return fault.at_x_m, fault.at_y_m


def bare_boxes(faults: Sequence[Fault], site: Site) -> tuple[Box, ...]:
    """Where the floor has no paint."""
    boxes: list[Box] = []
    for fault in faults:
        place = place_of(fault, site)
        if isinstance(fault, BareFloor) and place is not None:
            (x_m, y_m), half_m = place, fault.half_m
            boxes.append((x_m - half_m, y_m - half_m, x_m + half_m, y_m + half_m))
    return tuple(boxes)


class WorldFaults:
    """Does to the peers what the schedule says; records each turn beside the truth."""

    def __init__(
        self,
        faults: Sequence[Fault],
        site: Site,
        cameras: Mapping[str, CameraPeer],
        airframe: Airframe,
        vehicle: object,
        tell: FaultListener,
        seed: int = 0,
    ) -> None:
        """`seed` draws the gusts of a wind that changes."""
        self._faults = tuple(faults)
        self._schedule = FaultSchedule(faults, site)
        self._cameras = cameras
        self._airframe = airframe
        self._vehicle = vehicle
        self._calm = airframe.wind
        self._whole = airframe.params
        self._tell = tell
        self._draw = random.Random(f"faults {seed}")

    async def run(self, clock: Clock, truth_at: Callable[[int], Kinematics], recorder: Recorder) -> None:
        """Until cancelled."""
        while self._faults:
            now_ns = clock.now_ns()
            for index, begins in self._schedule.step(now_ns, truth_at(now_ns)):
                fault = self._faults[index]
                recorder.record(Topic.FAULT, now_ns, FaultNote(now_ns, index, fault.kind, begins))
                if fault.by_launcher:
                    self._tell(index, begins)
                else:
                    self.turn(fault, begins)
            await asyncio.sleep(_LOOKS_S)

    def turn(self, fault: Fault, on: bool) -> None:
        """Begin or end one fault that is the world's own."""
        match fault:
            case CameraFault() | CameraLate() | CameraDisordered() | CameraTurned():
                self._spoil(fault, on)
            case BatteryDrop() if on:
                self._airframe.battery_frac = fault.charge
            case WindChange():
                wind = WindParams(fault.mean_x_mps, fault.mean_y_mps, fault.gust_mps)
                self._airframe.wind = Wind(wind, self._draw.getrandbits(32)) if on else self._calm
            case AttitudeSlow():
                self._airframe.params = _slowed(self._whole, fault) if on else self._whole
            case _ if isinstance(self._vehicle, AutopilotPeer):
                _break(self._vehicle, fault, on)
            case LinkFault(kind="companion_dead") if isinstance(self._vehicle, OverRadio):
                self._vehicle.radio = not on

    def _spoil(self, fault: CameraFault | CameraLate | CameraDisordered | CameraTurned, on: bool) -> None:
        camera = self._cameras.get("camera" if fault.camera == "down" else "front-camera")
        if camera is None:
            return
        trouble = camera.trouble
        match fault:
            case CameraLate():
                trouble.late_s = fault.delay_s if on else 0.0
            case CameraDisordered():
                trouble.straggler_s, trouble.straggler_every = (fault.delay_s if on else 0.0), fault.every
            case CameraTurned():
                trouble.turn_deg = fault.turn_deg if on else 0.0
            case CameraFault(kind="camera_frozen"):
                trouble.frozen = on
            case CameraFault(kind="camera_gone"):
                trouble.gone = on
            case CameraFault():
                level = 0 if fault.kind == "camera_black" else 255
                trouble.level = level if on else None


def _slowed(whole: AirframeParams, fault: AttitudeSlow) -> AirframeParams:
    return replace(
        whole,
        attitude_bandwidth_radps=whole.attitude_bandwidth_radps * fault.share,
        attitude_damping=whole.attitude_damping if fault.damping is None else fault.damping,
    )


def _break(vehicle: AutopilotPeer, fault: Fault, on: bool) -> None:
    """What goes wrong in an autopilot, or between it and its companion."""
    match fault:
        case LinkFault(kind="telemetry_silent"):
            vehicle.link.silent = on
        case LinkFault(kind="uplink_silent"):
            vehicle.link.deaf = on
        case LinkFault(kind="companion_dead"):
            vehicle.link.muted = on
        case LinkFault():
            kept = _WITHHELD[fault.kind]
            vehicle.link.withheld = vehicle.link.withheld | kept if on else vehicle.link.withheld - kept
        case LandingUnreported():
            vehicle.reports_landed = not on
        case ClockRate():
            vehicle.pace_clock(fault.share * 1e6 if on else 0.0)
        case ClockJump():
            vehicle.jump_clock(round(fault.jump_s * 1e9) * (1 if on else -1))
        case VehicleFault(kind="pilot"):
            vehicle.pilot_mode(vehicle.pilots_mode if on else vehicle.landing_mode)
        case VehicleFault() if on:
            vehicle.reboot()
        case _:
            _mislead(vehicle.sensors.fault, fault, on)


def _mislead(wrong: SensorFault, fault: Fault, on: bool) -> None:
    """What the sensors tell wrong."""
    match fault:
        case AttitudeBiased():
            angles = math.radians(fault.roll_deg), math.radians(fault.pitch_deg), math.radians(fault.yaw_deg)
            wrong.roll_rad, wrong.pitch_rad, wrong.yaw_rad = angles if on else (0.0, 0.0, 0.0)
        case HeightBiased():
            wrong.range_m = fault.offset_m if on else 0.0
        case HeightLost():
            wrong.range_lost = on
        case HeightQuality():
            wrong.range_quality_pc = fault.percent if on else 0
        case ClimbStuck():
            wrong.climb_stuck_mps = fault.reading_mps if on else None
        case ClimbDrifts():
            wrong.climb_drift_mps = fault.error_mps if on else 0.0
        case HeightStuck():
            wrong.range_stuck_m = fault.reading_m if on else None
            wrong.range_swing_m = fault.swing_m
        case HeightScaled():
            wrong.range_share = fault.share if on else 1.0
        case ChargeMisreported():
            wrong.charge_pc = fault.percent if on else None
