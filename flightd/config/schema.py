"""The daemon's configuration: one frozen, typed tree; unknown keys are refused, every key says its unit
and range.  Angles are degrees in the file (`_deg`) and radians wherever the tree is used."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationError, model_validator

from flightd.config.front_camera import FrontCameraConfig
from flightd.config.ground import GroundConfig
from flightd.config.hazards import HazardConfig
from flightd.config.metrics import MetricsConfig
from flightd.config.scan import InventoryConfig, ScanConfig
from flightd.config.section import FocalX, FocalY, Height, OpticsSection, Section, Width
from flightd.config.vehicle import VehicleConfig
from flightd.control.flight_controller import FlightGains
from flightd.control.limits import Limits
from flightd.control.pid import PidGains
from flightd.core.errors import InputError
from flightd.core.geometry import Mount
from flightd.localisation.grid_localiser import LocaliserParams
from flightd.mission.battery.consumption import BatteryParams
from flightd.mission.guidance import CEILING_MARGIN_M, MissionParams
from flightd.mission.plan.flight_plan import Heading, HeadingPolicy, VisitOrder
from flightd.mission.scan.views import ScanParams
from flightd.pilot import PilotParams
from flightd.site.site import Site
from flightd.site.ways import KEEP_OUT_CLEARANCE_M
from flightd.tracking.line_tracker import TrackerParams
from flightd.tracking.tilt_compensation import TiltCompensation

_Positive = Annotated[float, Field(gt=0, le=1e4, allow_inf_nan=False)]
_Share = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]

HEIGHT_ROOM_M = 0.4
"""Below and above the flying height, what a keep-out must leave free for a leg to pass it."""


_RAGGED = 0.03
"""Part of the picture's reach, per metre of height, in which lines are not found surely."""


class CameraConfig(OpticsSection):
    """The down camera: where its pictures come from, its lens and how it is mounted."""

    url: str = Field(
        "udp://127.0.0.1:5600",
        description="udp://HOST:PORT (notices of pictures in shared memory), device:/dev/videoN, "
        "file:PATH (a video), folder:PATH (pictures)",
    )
    width_px: Width = 640
    height_px: Height = 360
    fps: float = Field(30.0, gt=0, le=240, description="frame rate asked for")
    fx_px: FocalX = 381.4  # 80 deg across 640 px
    fy_px: FocalY = 381.4
    mount_yaw_deg: float = Field(0.0, ge=-180, le=180, description="turn of the camera, clockwise from above")
    latency_s: float = Field(
        0.060, ge=0, le=1, description="from mid-exposure to arrival, least delay of the path"
    )

    def mount(self) -> Mount:
        return Mount(math.radians(self.mount_yaw_deg), self.mount_offset_m)


class VisionConfig(Section):
    """How lines are found, and by how many processes."""

    method: Literal["combined", "centroid", "skeleton", "naive"] = Field(
        "combined", description="line detector"
    )
    profile: str | None = Field(
        None, description="colour profile: a shipped name or a file; none: the site's line colour"
    )
    workers: int = Field(2, ge=1, le=16, description="detector processes")
    timeout_s: float = Field(
        0.5, gt=0.01, le=5, description="a detector that takes longer is killed and replaced"
    )


class PidConfig(Section):
    kp: float = Field(ge=0, le=100)
    ki: float = Field(ge=0, le=100)
    kd: float = Field(ge=0, le=100)
    integral_limit: float = Field(ge=0, le=100, description="largest share of the integral, in output units")
    output_limit: float = Field(gt=0, le=100, description="largest output")

    def gains(self) -> PidGains:
        return PidGains(self.kp, self.ki, self.kd, self.integral_limit, self.output_limit)


class ControlConfig(Section):
    """Loops and limits; the limits have the last word before the wire."""

    horizontal: PidConfig = Field(
        PidConfig(kp=6.5, ki=3.3, kd=4.4, integral_limit=0.8, output_limit=1.7), description="m/s^2 per m"
    )
    yaw: PidConfig = Field(
        PidConfig(kp=1.5, ki=0.1, kd=0.1, integral_limit=0.1, output_limit=0.8), description="rad/s per rad"
    )
    height: PidConfig = Field(
        PidConfig(kp=1.0, ki=0.1, kd=0.0, integral_limit=0.1, output_limit=0.8), description="m/s per m"
    )
    max_tilt_deg: float = Field(10.0, gt=0, le=30, description="roll and pitch, each")
    max_tilt_rate_degps: float = Field(60.0, gt=0, le=360, description="change of a tilt setpoint")
    max_jerk_mps3: float = Field(12.0, gt=0.5, le=100, description="change of the horizontal acceleration")
    max_yaw_rate_degps: float = Field(45.0, gt=0, le=180)
    max_yaw_accel_degps2: float = Field(180.0, gt=5, le=2000)
    max_climb_mps: float = Field(0.8, gt=0, le=3)
    max_descend_mps: float = Field(0.9, gt=0, le=3)
    tilt_compensation: TiltCompensation = Field(
        TiltCompensation.EXACT, description="exact, first_order or none"
    )

    def limits(self) -> Limits:
        return Limits(
            math.radians(self.max_tilt_deg),
            math.radians(self.max_tilt_rate_degps),
            math.radians(self.max_yaw_rate_degps),
            self.max_climb_mps,
            self.max_descend_mps,
            self.max_jerk_mps3,
            math.radians(self.max_yaw_accel_degps2),
        )


class MissionConfig(Section):
    """What to fly and how fast.  Lengths in m, times in s."""

    site: Path = Field(description="site file, relative to this file")
    nodes: tuple[str, ...] = Field(
        (), description="nodes to visit in order; empty: every node, aisle by aisle"
    )
    order: VisitOrder = Field(
        VisitOrder.GIVEN, description="given: nodes as listed (all: aisle by aisle); best: the quickest order"
    )
    heading: Heading = Field(
        Heading.ALONG, description="along: nose in flight direction; shelf: nose to the shelf"
    )
    pad: str | None = Field(None, description="id of the pad that it stands on at first; none: the home pad")
    start_yaw_deg: float = Field(
        0.0, ge=-180, le=180, description="heading on the pad, clockwise from the aisles"
    )
    height_m: float = Field(1.6, ge=0.5, le=20)
    speed_mps: float = Field(0.8, gt=0, le=3)
    accel_mps2: float = Field(0.5, gt=0, le=2)
    climb_mps: float = Field(0.6, gt=0, le=2)
    land_mps: float = Field(0.35, gt=0, le=1)
    turn_rate_degps: float = Field(35.0, gt=0, le=120)
    dwell_s: float = Field(2.0, ge=0, le=600, description="hover at each node")
    settle_s: float = Field(0.4, ge=0, le=10)
    arrive_m: float = Field(0.08, gt=0, le=0.5)
    lines_hold_s: float = Field(0.25, gt=0, le=2, description="lines older than this: level and hold")
    lines_land_s: float = Field(4.0, gt=0, le=60, description="held for so long: land")
    integrity_min: float = Field(
        0.95, ge=0.5, lt=1, description="probability of the node below which it stops and relocates"
    )
    relocate_s: float = Field(30.0, gt=0, le=300, description="position not found again for so long: land")
    telemetry_hold_s: float = Field(0.3, gt=0, le=2)
    telemetry_land_s: float = Field(3.0, gt=0, le=30)
    battery_start: _Share = Field(0.30, description="least charge to start")
    battery_home: _Share = Field(0.20, description="fly home below")
    battery_land: _Share = Field(0.10, description="land at once below")
    progress: Path | None = Field(
        None, description="file that keeps the stops still to be made, relative to this file"
    )
    resume: bool = Field(False, description="fly what that file holds, if anything, instead of the nodes")
    autostart: bool = Field(False, description="start without waiting for the start command")
    recover_s: float = Field(
        2.0,
        ge=1.5,
        le=600,
        description="found flying at a restart: level for so long, for pilot or operator, then land",
    )

    def flown_between_m(self) -> tuple[float, float]:
        """The heights that the legs of the flight are flown between, with room to spare."""
        return self.height_m - HEIGHT_ROOM_M, self.height_m + HEIGHT_ROOM_M

    def params(self) -> MissionParams:
        return MissionParams(
            height_m=self.height_m,
            speed_mps=self.speed_mps,
            accel_mps2=self.accel_mps2,
            climb_mps=self.climb_mps,
            turn_rate_radps=math.radians(self.turn_rate_degps),
            dwell_s=self.dwell_s,
            settle_s=self.settle_s,
            arrive_m=self.arrive_m,
            land_mps=self.land_mps,
            lines_hold_s=self.lines_hold_s,
            lines_land_s=self.lines_land_s,
            integrity_min=self.integrity_min,
            relocate_s=self.relocate_s,
            telemetry_hold_s=self.telemetry_hold_s,
            telemetry_land_s=self.telemetry_land_s,
            battery_start_frac=self.battery_start,
            battery_home_frac=self.battery_home,
            battery_land_frac=self.battery_land,
            autostart=self.autostart,
            recover_s=self.recover_s,
        )

    @model_validator(mode="after")
    def _batteries_in_order(self) -> Self:
        if not self.battery_land < self.battery_home <= self.battery_start:
            raise ValueError("battery_land < battery_home <= battery_start is required")
        return self


class BatteryConfig(Section):
    """How long a battery flies, and what happens when it does not last."""

    flight_s: float = Field(
        600.0,
        ge=30,
        le=36_000,
        description="hovering time of a full battery; measured in flight from then on",
    )
    capacity_wh: float | None = Field(None, gt=0, le=10_000, description="with hover_w, in place of flight_s")
    hover_w: float | None = Field(None, gt=0, le=100_000, description="power that hovering takes")
    reserve: float = Field(0.10, ge=0, le=0.5, description="charge that stays when it is back on the pad")
    full: float = Field(0.90, gt=0, le=1, description="least charge of a battery put in to go on")
    swap: bool = Field(
        False,
        description="wait on the charge pad for a fresh battery and go on; false: the mission ends there",
    )
    swap_wait_s: float = Field(1800.0, gt=0, le=86_400, description="give up waiting after this")

    def params(self) -> BatteryParams:
        flight_s = self.flight_s
        if self.capacity_wh is not None and self.hover_w is not None:
            flight_s = 3600.0 * self.capacity_wh / self.hover_w
        return BatteryParams(flight_s, self.reserve, self.full, self.swap, self.swap_wait_s)

    @model_validator(mode="after")
    def _both_or_neither(self) -> Self:
        if (self.capacity_wh is None) != (self.hover_w is None):
            raise ValueError("capacity_wh and hover_w belong together: give both or neither")
        return self


class RecorderConfig(Section):
    """The black box."""

    folder: Path | None = Field(None, description="where flights are recorded; none: not at all")
    quota_gb: float = Field(20.0, gt=0, le=100_000, description="most that all flights may take; oldest go")
    reserve_gb: float = Field(1.0, ge=0, le=100_000, description="least that stays free on the disk")
    picture_fps: float = Field(2.0, ge=0, le=60, description="pictures recorded per second")


class Config(Section):
    """The whole file."""

    mission: MissionConfig
    camera: CameraConfig = CameraConfig()
    front_camera: FrontCameraConfig = FrontCameraConfig()
    scan: ScanConfig = ScanConfig()
    inventory: InventoryConfig = InventoryConfig()
    vision: VisionConfig = VisionConfig()
    vehicle: VehicleConfig = VehicleConfig()
    control: ControlConfig = ControlConfig()
    battery: BatteryConfig = BatteryConfig()
    recorder: RecorderConfig = RecorderConfig()
    ground: GroundConfig = GroundConfig()
    metrics: MetricsConfig = MetricsConfig()
    hazards: HazardConfig = HazardConfig()

    def heading_policy(self) -> HeadingPolicy:
        """The mission's heading, with which side of the down camera's picture lies along the nose."""
        camera = self.camera
        turned = abs(math.sin(math.radians(camera.mount_yaw_deg))) > math.sqrt(0.5)
        return HeadingPolicy(self.mission.heading, (camera.width_px > camera.height_px) == turned)

    def scan_params(self, highest_m: float) -> ScanParams:
        """How shelves are scanned, never above `highest_m`.  Facing the shelf, the picture's side that lies
        across the nose sees along the aisle: half of that is kept to, the rest is for drift and tilt."""
        camera = self.camera
        half = min(camera.width_px / camera.fx_px, camera.height_px / camera.fy_px) / 2
        return self.scan.params(highest_m, 0.5 * half)

    def _localiser(self) -> LocaliserParams:
        """What the down camera surely sees of the floor, at full tilt too."""
        camera = self.camera
        tilted = math.tan(math.radians(self.control.max_tilt_deg))
        long, short = (
            max(0.5 * pixels / focal - tilted - _RAGGED, 0.1)
            for pixels, focal in ((camera.width_px, camera.fx_px), (camera.height_px, camera.fy_px))
        )
        across = abs(math.sin(math.radians(camera.mount_yaw_deg))) > math.sqrt(0.5)
        return LocaliserParams(view_ahead=long if across else short, view_aside=short if across else long)

    def pilot_params(self, site: Site) -> PilotParams:
        return PilotParams(
            tracker=TrackerParams(
                self.camera.lens(),
                self.camera.mount(),
                self.control.tilt_compensation,
                width_m=site.line_width_m,
            ),
            gains=FlightGains(
                self.control.horizontal.gains(), self.control.yaw.gains(), self.control.height.gains()
            ),
            limits=self.control.limits(),
            localiser=self._localiser(),
            mission=replace(
                self.mission.params(),
                ground_lost_s=self.ground.lost_s,
                ground_lost=self.ground.lost_action,
                ceiling_m=site.ceiling_m - CEILING_MARGIN_M,
                overhead_m=tuple(area.from_m - KEEP_OUT_CLEARANCE_M for area in site.keep_outs),
                battery=self.battery.params(),
                hazards=self.hazards.params(),
            ),
        )


def load_config(path: Path) -> Config:
    """Read and check a configuration file.  Raises InputError naming the file, the key and the remedy."""
    return parse_config(load_table(path), path)


def load_table(path: Path) -> dict[str, Any]:
    """The file as it is, unchecked."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as err:
        raise InputError(f"config {path}: {err.strerror}; give the path of a TOML file") from err
    except UnicodeDecodeError as err:
        raise InputError(f"config {path}: not UTF-8 text") from err
    except tomllib.TOMLDecodeError as err:
        raise InputError(f"config {path}: not TOML: {err}") from err


def parse_config(table: dict[str, Any], path: Path) -> Config:
    """Check a table that was read from `path`; relative paths in it are taken from there."""
    if key := _key_with_null(table):
        raise InputError(f"config {path}: {key}: holds a null character; take it out")
    try:
        config = Config.model_validate(table)
    except ValidationError as err:
        first = err.errors()[0]
        key = ".".join(str(part) for part in first["loc"]) or "(top level)"
        more = f" (and {len(err.errors()) - 1} more)" if len(err.errors()) > 1 else ""
        raise InputError(f"config {path}: {key}: {_remedy(first['type'], first['msg'])}{more}") from err
    site = (path.parent / config.mission.site).resolve()
    kept = config.mission.progress
    progress = None if kept is None else (path.parent / kept).resolve()
    return config.model_copy(
        update={
            "mission": config.mission.model_copy(update={"site": site, "progress": progress}),
            "ground": config.ground.beside(path.parent),
            "inventory": config.inventory.beside(path.parent),
            "vehicle": config.vehicle.beside(path.parent),
        }
    )


def _key_with_null(value: object, key: str = "") -> str:
    """The first key whose text no file system takes, or an empty text."""
    if isinstance(value, str):
        return key if "\0" in value else ""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return next(filter(None, (_key_with_null(item, f"{key}.{name}".strip(".")) for name, item in inner)), "")


def _remedy(kind: str, message: str) -> str:
    if kind == "extra_forbidden":
        return "unknown key; take it out or correct its spelling"
    if kind == "missing":
        return "is missing; add it"
    return message[0].lower() + message[1:]
