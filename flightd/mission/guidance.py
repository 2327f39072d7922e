"""What the mission knows, is told to do, and wants: its parameters, senses and guidance."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, field

from flightd.control.flight_controller import Reference
from flightd.core.types import HEALTHY, Demand, GridPose, Health, Phase, VehicleState
from flightd.mission.battery.consumption import BatteryParams

CEILING_MARGIN_M = 0.5
"""Nothing is flown nearer to the ceiling."""


class LossAction(enum.StrEnum):
    """What to do when something is lost that flying itself does not need: ground station, flight log."""

    CONTINUE = "continue"
    HOLD = "hold"
    HOME = "home"
    LAND = "land"


@dataclass(frozen=True, slots=True)
class HazardParams:
    """When things count as wrong, and for how long that is borne; SI units, radians."""

    heartbeat_land_s: float = 5.0
    height_share: float = 0.25
    """In flight the two agree to 0.02, and the tracker goes by the lines from 0.2 on.  A drone that climbs
    by a range finder which reads 0.7 m too little is told wrong by 0.30 when it comes to rest at 1.6 m."""
    heading_rad: float = math.radians(5.0)
    disagree_s: float = 0.4
    push_mps2: float = 0.8
    off_m: float = 0.5
    push_s: float = 2.0
    headroom_m: float = 0.5
    corridor_m: float = 0.45
    outside_s: float = 0.2
    latency_s: float = 0.25
    overload_s: float = 3.0
    brake_s: float = 2.4
    search_s: float = 0.0
    search_climb_m: float = 0.3
    search_land_s: float = 1.4
    blind_land_s: float = 2.2
    blind_m: float = 0.5
    record_lost: LossAction = LossAction.HOME


@dataclass(frozen=True, slots=True)
class MissionParams:
    """Speeds, distances and waiting times of the mission; SI units, radians."""

    height_m: float = 1.5
    speed_mps: float = 0.8
    accel_mps2: float = 0.5
    climb_mps: float = 0.6
    climb_accel_mps2: float = 0.6
    turn_rate_radps: float = 0.6
    turn_accel_radps2: float = 1.0
    dwell_s: float = 2.0
    settle_s: float = 0.5
    arrive_m: float = 0.08
    arrive_mps: float = 0.10
    arrive_yaw_rad: float = math.radians(4.0)
    height_reached_m: float = 0.15
    view_height_m: float = 0.08
    steer_above_m: float = 0.45
    land_mps: float = 0.35
    touch_mps: float = 0.20
    blind_mps: float = 0.9
    touch_blind_mps: float = 0.3
    touch_below_m: float = 0.35
    lines_hold_s: float = 0.25
    lines_land_s: float = 4.0
    lines_found_s: float = 1.0
    followed_hold_s: float = 0.8
    telemetry_hold_s: float = 0.3
    telemetry_land_s: float = 3.0
    arm_timeout_s: float = 60.0
    adopt_s: float = 1.5
    recover_s: float = 2.0
    phase_slack_s: float = 20.0
    phase_share: float = 2.0
    battery_start_frac: float = 0.3
    battery_home_frac: float = 0.2
    battery_land_frac: float = 0.1
    max_lead_m: float = 0.35
    autostart: bool = True
    integrity_min: float = 0.95
    doubt_s: float = 0.3
    first_look_s: float = 3.0
    settled_s: float = 0.5
    relocate_look_s: float = 4.0
    relocate_s: float = 30.0
    relocate_climb_m: float = 1.0
    ceiling_m: float = math.inf
    overhead_m: tuple[float, ...] = ()
    ground_lost_s: float = 5.0
    ground_lost: LossAction = LossAction.CONTINUE
    battery: BatteryParams = field(default_factory=BatteryParams)
    hazards: HazardParams = HazardParams()


class Guide(enum.Enum):
    """What control is to do: nothing at all, level with height held, come to rest by the velocity as it is
    reckoned and stay, or steer to the reference."""

    NONE = "none"
    LEVEL = "level"
    BRAKE = "brake"
    STEER = "steer"


@dataclass(frozen=True, slots=True)
class Warnings:
    """How far what the mission senses can be believed.

    Pictures: age of the newest, and since when they are the same or show nothing.  `heading_error_rad` is
    what the lines say against the vehicle's heading, `height_share` the lines' width against the map's
    (1: they agree), `push_mps2` the acceleration that no lean explains, `off_m` the distance from the
    reference while steering, `headroom_m` the way up to the ceiling's margin, `outside_m` how far outside
    the corridor, whose nearest line is at `line_m`; `tick_s` the mean time between ticks."""

    picture_age_s: float = 0.0
    frozen_s: float = 0.0
    blank_s: float = 0.0
    heading_error_rad: float = 0.0
    height_share: float = 1.0
    push_mps2: float = 0.0
    off_m: float = 0.0
    headroom_m: float = math.inf
    outside_m: float = 0.0
    line_m: tuple[float, float] = (0.0, 0.0)
    tick_s: float = 0.02
    health: Health = HEALTHY


ALL_WELL = Warnings()


@dataclass(frozen=True, slots=True)
class MissionInputs:
    """All that the mission knows at one tick.  `pose` is None before the floor was seen; ages in
    seconds, infinite when there never was any.  `ground_silent_s` is 0 while no ground station attends.
    `pad_m` is the centre of the goal's pad on the map, as seen or else as drawn; None where there is none.
    `by_pad` says that the pose is only that over the pad: enough to climb straight up.
    While the position is sought again, `rivals` are the nodes where the drone may be with their
    probability, and `way_out` a move that is safe at all of them."""

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

    @property
    def speed_mps(self) -> float:
        """Speed over the floor; infinite where there is no pose."""
        return math.inf if self.pose is None else math.hypot(self.pose.vx_mps, self.pose.vy_mps)

    def distance_m(self, to: tuple[float, float]) -> float:
        """How far away a place on the map is; infinite where there is no pose."""
        return math.inf if self.pose is None else math.hypot(self.pose.x_m - to[0], self.pose.y_m - to[1])

    def is_sure(self, params: MissionParams) -> bool:
        """The drone is over the node that it is believed to be over."""
        return self.pose is not None and self.pose.integrity >= params.integrity_min


@dataclass(frozen=True, slots=True)
class Guidance:
    """What the mission wants: guide, reference (grid axes), demand on the vehicle.  `reckoned` says that
    the velocity is still known while the floor is not seen, `at_once` that nothing may delay levelling."""

    phase: Phase
    guide: Guide
    reference: Reference
    demand: Demand
    reckoned: bool = False
    at_once: bool = False
