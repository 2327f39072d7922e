"""The section of the configuration on the tracks of the lines on the floor."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, ClassVar, TypeAlias

from pydantic import Field

from flightd.config.section import Section, unit

_WidthShare: TypeAlias = Annotated[float, Field(gt=0, le=10, allow_inf_nan=False)]


class MotionNoise(Section):
    """What the motion model does not know, as densities (per square root of a second) and first sigmas.

    A disturbance is a steady part (trim, draught: its mean over `steady_s`) and a gust that fades within
    `gust_s`.  Its density is `changed_mps2` while what is seen all errs to one side (process noise adapted
    to the innovations: Jazwinski, Automatica 5, 1969)."""

    accel_mps2: float = Field(0.2, gt=0, le=5, description="density of the acceleration")
    disturbance_mps2: float = Field(0.15, gt=0, le=5, description="density of the disturbance")
    changed_mps2: float = Field(1.0, gt=0, le=10, description="the same while all lines err to one side")
    drag_per_s: float = Field(0.25, ge=0, le=5, description="loss of speed by drag")
    start_velocity_mps: float = Field(0.3, gt=0, le=5, description="sigma of the velocity at first")
    start_disturbance_mps2: float = Field(0.2, gt=0, le=5, description="sigma of the disturbance at first")
    max_disturbance_mps2: float = Field(1.2, gt=0, le=10, description="largest disturbance believed")
    gust_s: float = Field(2.5, gt=0, le=60, description="time within which a gust fades")
    steady_s: float = Field(10.0, gt=0, le=600, description="time over which the steady part is averaged")


class SensorPriors(Section):
    """What may be wrong with a drone's own sensors before the lines have told, as sigmas."""

    attitude_deg: float = Field(0.7, gt=0, le=10, description="wandering error of the told roll and pitch")
    attitude_s: float = Field(8.0, gt=0, le=600, description="time within which that error wanders")
    stand_deg: float = Field(
        0.5, gt=0, le=10, description="roll and pitch in which the drone stands on its legs"
    )
    leak_per_s: float = Field(
        0.1, gt=0, le=1, description="rate at which that attitude leaks towards what accelerometers feel"
    )
    mount_deg: float = Field(
        1.5, gt=0, le=10, description="error of the camera's roll and pitch in the airframe"
    )
    mount_yaw_deg: float = Field(2.0, gt=0, le=20, description="error of its yaw there")
    delay_s: float = Field(0.03, gt=0, le=0.5, description="error of camera.latency_s")
    scale_share: float = Field(
        0.03, gt=0, le=0.5, description="error of the focal length", json_schema_extra=unit("share")
    )
    height_share: float = Field(
        0.02, gt=0, le=0.5, description="lasting error of the told height", json_schema_extra=unit("share")
    )
    heading_degps: float = Field(0.1, gt=0, le=5, description="drift of the vehicle's heading")
    shake_deg: float = Field(0.15, gt=0, le=5, description="picture against attitude, frame by frame")
    most_shake_deg: float = Field(1.5, gt=0, le=10, description="the most that is believed of it")

    @property
    def attitude_rad(self) -> float:
        return math.radians(self.attitude_deg)

    @property
    def stand_rad(self) -> float:
        return math.radians(self.stand_deg)

    @property
    def mount_rad(self) -> float:
        return math.radians(self.mount_deg)

    @property
    def mount_yaw_rad(self) -> float:
        return math.radians(self.mount_yaw_deg)

    @property
    def heading_radps(self) -> float:
        return math.radians(self.heading_degps)

    @property
    def shake_rad(self) -> float:
        return math.radians(self.shake_deg)

    @property
    def shake_bounds_rad(self) -> tuple[float, float]:
        """The least and the most that is believed of the shaking.

        Less than a tenth of a degree cannot be told from what single lines err by; were it taken for none,
        the speeds that it shakes would tell a delay that is not there."""
        return math.radians(0.1), math.radians(self.most_shake_deg)


class TrackingExpert(Section):
    """How far the down camera's lines are trusted."""

    sigma_tilt_deg: float = Field(
        0.3, gt=0, le=10, description="sigma of the tilt where it is not compensated"
    )
    min_sigma_m: float = Field(0.004, gt=0, le=0.1, description="least sigma of a line's offset")
    feature_sigma_px: float = Field(
        1.0, gt=0, le=50, description="sigma of the place of a feature of the floor in the picture"
    )
    width_share: tuple[_WidthShare, _WidthShare] = Field(
        (0.55, 1.7),
        description="least and largest width of a guide line against the site's line_width_m",
        json_schema_extra=unit("share"),
    )
    gate_m: float = Field(0.35, gt=0, le=2, description="farthest from its track that a line is taken for it")
    forget_s: float = Field(2.5, gt=0, le=60, description="a track not seen for so long is given up")
    start_yaw_sigma_deg: float = Field(
        5.0, gt=0, le=45, description="sigma of the heading on the pad, and after a compass is contradicted"
    )
    noise: MotionNoise = MotionNoise()
    priors: SensorPriors = SensorPriors()

    @property
    def sigma_tilt_rad(self) -> float:
        return math.radians(self.sigma_tilt_deg)

    @property
    def start_yaw_sigma_rad(self) -> float:
        return math.radians(self.start_yaw_sigma_deg)


class TrackingConfig(Section):
    """How lines are followed from frame to frame."""

    files: ClassVar = ("learnt",)

    learnt: Path | None = Field(
        None,
        description="file that keeps what flights learn of the camera's delay and mount, relative to this "
        "file; none: each begins with what is configured",
    )
    expert: TrackingExpert = TrackingExpert()
