"""What may be made to go wrong in a simulated flight: the `[[fault]]` entries of a scenario, typed.

Each begins once: `at_s` seconds after the drone left the floor, or when it is within 0.4 m of `at_node` or
of `at_x_m`, `at_y_m`, or with `from_start` it is there from power-on; it lasts `duration_s`, or to the end.
"""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal, Self, TypeAlias

from pydantic import Field, model_validator

from flightd.config.section import Section
from flightd.core.types import CommandKind

_Finite = Annotated[float, Field(ge=-1000, le=1000, allow_inf_nan=False)]
_Angle = Annotated[float, Field(ge=-180, le=180, allow_inf_nan=False)]


class _Fault(Section):
    by_vehicle: ClassVar[bool] = False
    """The simulated MAVLink autopilot does it; an AR.Drone or a vehicle from elsewhere cannot."""
    by_airframe: ClassVar[bool] = False
    """Done to the simulated airframe: not to one from elsewhere."""
    by_launcher: ClassVar[bool] = False
    """Done to the daemon's processes or over its ground link, by who started the flight."""
    real_time: ClassVar[bool] = False
    """Makes sense by the clock only."""

    at_s: float | None = Field(None, ge=0, le=36_000)
    at_node: str | None = None
    at_x_m: _Finite | None = None
    at_y_m: _Finite | None = None
    from_start: bool = False
    duration_s: float = Field(math.inf, gt=0)

    @model_validator(mode="after")
    def _one_beginning(self) -> Self:
        if (self.at_x_m is None) != (self.at_y_m is None):
            raise ValueError("at_x_m and at_y_m belong together: give both")
        told = sum(value is not None for value in (self.at_s, self.at_node, self.at_x_m))
        if told + self.from_start != 1:
            raise ValueError("give one of at_s, at_node, at_x_m with at_y_m, or from_start = true")
        if self.from_start and self.by_launcher:
            raise ValueError("from_start is for vehicle, air and cameras: give at_s, at_node or a place")
        return self


class OfCamera(_Fault):
    """What can happen to either camera."""

    camera: Literal["down", "front"] = "down"


class CameraFault(OfCamera):
    """The camera shows its last picture for ever, black, white, or nothing at all."""

    kind: Literal["camera_frozen", "camera_black", "camera_white", "camera_gone"]


class CameraLate(OfCamera):
    kind: Literal["camera_late"]
    delay_s: float = Field(0.9, ge=-0.05, le=5, description="on top of the capture delay; below 0: sooner")


class CameraDisordered(OfCamera):
    """Every so many frames one comes late, behind newer ones."""

    kind: Literal["camera_disordered"]
    delay_s: float = Field(0.15, gt=0, le=0.2, description="on top of the capture delay")
    every: int = Field(4, ge=2, le=100)


class CameraTurned(OfCamera):
    """A mount that was knocked: the picture turns, clockwise, about its middle."""

    kind: Literal["camera_turned"]
    turn_deg: _Angle


class BareFloor(_Fault):
    """No paint within a square around the place, from the start; it begins when the drone comes there."""

    kind: Literal["bare_floor"]
    half_m: float = Field(2.0, gt=0, le=50)

    @model_validator(mode="after")
    def _at_a_place(self) -> Self:
        if self.at_s is not None or self.from_start or self.duration_s != math.inf:
            raise ValueError(
                "the floor is bare at a place for good: give at_node, or at_x_m and at_y_m alone"
            )
        return self


class LinkFault(_Fault):
    """What the autopilot tells no longer arrives (nothing at all, no heartbeats, no answers about its clock,
    nothing of its climb, of its battery); or what is sent to it; or nothing passes either way: the companion
    computer is dead."""

    by_vehicle = True
    kind: Literal[
        "telemetry_silent",
        "heartbeat_silent",
        "timesync_silent",
        "climb_silent",
        "battery_silent",
        "uplink_silent",
        "companion_dead",
    ]


class AttitudeSlow(_Fault):
    """The airframe answers more slowly: the bandwidth of its attitude is this share of what it was; and
    it rings, where a ratio of damping is given."""

    kind: Literal["attitude_slow"]
    share: float = Field(0.3, gt=0, le=1)
    damping: float | None = Field(None, gt=0, le=2)


class AttitudeBiased(_Fault):
    """The autopilot's estimate is off by so much: it tells so, and flies by it."""

    by_vehicle = True
    kind: Literal["attitude_biased"]
    roll_deg: _Angle = 0.0
    pitch_deg: _Angle = 0.0
    yaw_deg: _Angle = 0.0


class HeightBiased(_Fault):
    """The range finder reads so much more, from one sample to the next."""

    by_vehicle = True
    kind: Literal["height_biased"]
    offset_m: float = Field(ge=-20, le=20)


class HeightLost(_Fault):
    """Nothing comes back to the range finder."""

    by_vehicle = True
    kind: Literal["height_lost"]


class HeightScaled(_Fault):
    """The range finder reads this share of the height."""

    by_vehicle = True
    kind: Literal["height_scaled"]
    share: float = Field(0.5, ge=0.1, le=3)


class HeightStuck(_Fault):
    """Something hangs in the range finder's beam: it reads that, whatever the height; and what swings there
    makes it read up to `swing_m` more."""

    by_vehicle = True
    kind: Literal["height_stuck"]
    reading_m: float = Field(0.1, ge=0.05, le=8)
    swing_m: float = Field(0.0, ge=0, le=2)


class ClimbStuck(_Fault):
    """The autopilot tells one climb rate, whatever it is."""

    by_vehicle = True
    kind: Literal["climb_stuck"]
    reading_mps: float = Field(0.0, ge=-3, le=3)


class ClimbDrifts(_Fault):
    """The autopilot believes to climb so much faster than it does, by its height too, tells so, and flies by
    it: a door that opens, or a duct that blows, moves the barometer's air."""

    by_vehicle = True
    kind: Literal["climb_drifts"]
    error_mps: float = Field(-0.6, ge=-3, le=3)


class HeightQuality(_Fault):
    """The range finder goes on reading, and tells this quality of its signal: 0 is unknown, 1 none."""

    by_vehicle = True
    kind: Literal["height_quality"]
    percent: int = Field(1, ge=0, le=100)


class LandingUnreported(_Fault):
    """The autopilot never reports that it stands."""

    by_vehicle = True
    kind: Literal["landing_unreported"]


class BatteryDrop(_Fault):
    by_airframe = True
    kind: Literal["battery"]
    charge: float = Field(ge=0, le=1)


class ChargeMisreported(_Fault):
    """The autopilot reports this charge whatever the battery holds; -1 says that it does not know."""

    by_vehicle = True
    kind: Literal["charge_misreported"]
    percent: int = Field(-1, ge=-1, le=100)


class WindChange(_Fault):
    """Another wind; at its end the scenario's own is back."""

    by_airframe = True
    kind: Literal["wind"]
    mean_x_mps: float = Field(0.0, ge=-20, le=20)
    mean_y_mps: float = Field(0.0, ge=-20, le=20)
    gust_mps: float = Field(0.3, ge=0, le=10)


class VehicleFault(_Fault):
    """A pilot moves his mode switch and at the fault's end lets it land; or the autopilot starts anew in the
    air (its motors stop)."""

    by_vehicle = True
    kind: Literal["pilot", "vehicle_reboot"]


class ClockJump(_Fault):
    """The autopilot's clock jumps; at the fault's end it jumps back."""

    by_vehicle = True
    kind: Literal["clock_jump"]
    jump_s: float = Field(ge=-3600, le=3600)


class ClockRate(_Fault):
    """The autopilot's clock runs fast by this share of time, as one that is simulated or overloaded may."""

    by_vehicle = True
    kind: Literal["clock_rate"]
    share: float = Field(0.015, ge=-0.2, le=0.2)


class DetectorKilled(_Fault):
    by_launcher = True
    kind: Literal["detector_killed"]


class ProcessFault(_Fault):
    """A detector is stopped (it hangs), the log's writer is killed or stopped, or its disk takes no more."""

    by_launcher = True
    real_time = True
    kind: Literal["detector_hung", "writer_killed", "writer_hung", "disk_full"]


class LoopStalled(_Fault):
    """The daemon's own process stands still for so long, as one does whose memory was swapped out."""

    by_launcher = True
    real_time = True
    kind: Literal["loop_stalled"]
    stall_s: float = Field(0.8, gt=0, le=5)


class CpuTaken(_Fault):
    """The detectors get only the rest of the processor, in turns of 0.4 s."""

    by_launcher = True
    real_time = True
    kind: Literal["cpu_taken"]
    share: float = Field(0.9, gt=0, lt=1)


class StepFails(_Fault):
    """An error in the flight software: the mission's own step raises, as long as the fault lasts."""

    by_launcher = True
    kind: Literal["step_fails"]


class AisleOpened(_Fault):
    """Somebody opens an aisle, and the interlock tells it."""

    by_launcher = True
    kind: Literal["aisle_opened"]


class GroundSilent(_Fault):
    """A ground station attends from the start, and falls silent."""

    by_launcher = True
    real_time = True
    kind: Literal["ground_silent"]


class GroundOrder(_Fault):
    """An operator's order, over the real link."""

    by_launcher = True
    real_time = True
    kind: Literal["order"]
    command: Literal[
        CommandKind.PAUSE, CommandKind.RESUME, CommandKind.HOME, CommandKind.LAND, CommandKind.STOP
    ]


Fault: TypeAlias = Annotated[
    CameraFault
    | CameraLate
    | CameraDisordered
    | CameraTurned
    | BareFloor
    | LinkFault
    | AttitudeSlow
    | AttitudeBiased
    | HeightBiased
    | HeightLost
    | HeightScaled
    | HeightStuck
    | ClimbStuck
    | ClimbDrifts
    | HeightQuality
    | LandingUnreported
    | BatteryDrop
    | ChargeMisreported
    | WindChange
    | VehicleFault
    | ClockJump
    | ClockRate
    | DetectorKilled
    | ProcessFault
    | LoopStalled
    | CpuTaken
    | StepFails
    | AisleOpened
    | GroundSilent
    | GroundOrder,
    Field(discriminator="kind"),
]
