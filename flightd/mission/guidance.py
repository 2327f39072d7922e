"""What the mission knows and wants: its inputs and guidance."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

from flightd.config.mission import MissionConfig
from flightd.control.flight_controller import Reference
from flightd.core.refusal import Refusal
from flightd.core.types import HEALTHY, AttitudeSetpoint, Demand, GridPose, Health, Phase, VehicleState
from flightd.tracking.battery_charge import Charge, told_charge

FLOOR_M = 0.5
"""No range finder reads more on the floor."""
CEILING_MARGIN_M = 0.5
"""Nothing is flown nearer to the ceiling."""


class Guide(enum.Enum):
    """What control is to do: nothing at all, level with height held, come to rest by the dead-reckoned
    velocity and stay, or steer to the reference."""

    NONE = "none"
    LEVEL = "level"
    BRAKE = "brake"
    STEER = "steer"


@dataclass(frozen=True, slots=True)
class Warnings:
    """How far what the mission senses can be believed.

    Pictures: age of the newest, and since when they are the same or show nothing.  `heading_error_rad` is
    what the lines say against the vehicle's heading, `height_doubted` that their width contradicts the
    height, by `height_error_m` (how much too high it is told), `height_stuck` that the height does not
    follow the climb of the vehicle, `climb_wrong` that the climb does not follow the height, by
    `climb_error_mps` (how much too great it is told), `push_mps2` the acceleration that no lean explains,
    `off_m` the distance from the reference while steering, `swings` that the drone swings about it,
    `headroom_m` the way up to the ceiling's margin, `outside_m` how far outside the corridor, whose
    nearest line is at `line_m`, `delay_leaps` how often the camera's delay became another one, `lean_leaps`
    how often roll or pitch was told otherwise while the gyros felt no turn; `tick_s` the mean time between
    ticks."""

    frame_age_s: float = 0.0
    frozen_s: float = 0.0
    blank_s: float = 0.0
    heading_error_rad: float = 0.0
    height_doubted: bool = False
    height_error_m: float = 0.0
    height_stuck: bool = False
    climb_wrong: bool = False
    climb_error_mps: float = 0.0
    push_mps2: float = 0.0
    off_m: float = 0.0
    swings: bool = False
    headroom_m: float = math.inf
    outside_m: float = 0.0
    line_m: tuple[float, float] = (0.0, 0.0)
    delay_leaps: int = 0
    lean_leaps: int = 0
    tick_s: float = 0.02
    health: Health = HEALTHY


ALL_WELL = Warnings()


@dataclass(frozen=True, slots=True)
class MissionInputs:
    """All that the mission knows at one tick.  `pose` is None before the floor was seen; ages in
    seconds, infinite when there never was any.  `ground_silent_s` is 0 while no ground station attends.
    `pad_m` is the centre of the goal's pad on the map, as seen or else as drawn; None where there is none.
    `features_age_s` is the age of the newest frame in which features of the floor told all motion, `x_age_s`
    and `y_age_s` that of the newest line, or of features that stand in for it.
    `by_pad` says that the pose is only that over the pad: enough to climb straight up.
    While the position is sought again, `rivals` are the nodes where the drone may be with their
    probability, and `way_out` a move that is safe at all of them.  `failed`: a step before this one raised
    an error.  `unfit` is what this computer's check before the flight found, `aisle_closed` what the
    interlock says; `commanded` the setpoint that is in force."""

    now_ns: int
    dt_s: float
    pose: GridPose | None
    localised: bool
    height_m: float
    frames_arrive: bool
    x_age_s: float
    y_age_s: float
    telemetry_age_s: float
    vehicle: VehicleState | None
    ground_silent_s: float = 0.0
    pad_m: tuple[float, float] | None = None
    by_pad: bool = False
    rivals: tuple[tuple[str, float], ...] = ()
    way_out: tuple[float, float] | None = None
    warnings: Warnings = ALL_WELL
    judged_charge: Charge | None = None
    failed: bool = False
    unfit: Refusal | None = None
    aisle_closed: bool = True
    features_age_s: float = math.inf
    commanded: AttitudeSetpoint | None = None

    @property
    def believed_height_m(self) -> float:
        """The height as it is told, by the lines' width where that contradicts it."""
        return self.height_m - (self.warnings.height_error_m if self.warnings.height_doubted else 0.0)

    @property
    def sight_s(self) -> float:
        """Age of the newest sight of the floor by which the motion is known."""
        return min(self.x_age_s, self.y_age_s, self.features_age_s)

    @property
    def charge(self) -> Charge:
        """What the battery is believed to hold; where nobody judged that, what it is told to."""
        return told_charge(self.vehicle) if self.judged_charge is None else self.judged_charge

    @property
    def speed_mps(self) -> float:
        """Speed over the floor; infinite where there is no pose."""
        return math.inf if self.pose is None else math.hypot(self.pose.vx_mps, self.pose.vy_mps)

    def distance_m(self, to: tuple[float, float]) -> float:
        """How far away a place on the map is; infinite where there is no pose."""
        return math.inf if self.pose is None else math.hypot(self.pose.x_m - to[0], self.pose.y_m - to[1])

    def is_sure(self, params: MissionConfig) -> bool:
        """The drone is over the node that it is believed to be over."""
        return self.pose is not None and self.pose.integrity >= params.integrity_min


@dataclass(frozen=True, slots=True)
class Guidance:
    """What the mission wants: guide, reference (grid axes), demand on the vehicle.  `dead_reckoned` says
    that the velocity is still known while the floor is not seen, `at_once` that nothing may delay
    levelling."""

    phase: Phase
    guide: Guide
    reference: Reference
    demand: Demand
    dead_reckoned: bool = False
    at_once: bool = False
