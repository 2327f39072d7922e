"""The section of the configuration on the control loops and their limits."""

from __future__ import annotations

import enum
import math

from pydantic import Field

from flightd.config.section import Section, unit


class TiltCompensation(enum.StrEnum):
    """How the camera's tilt is taken out of the lines: by the homography of the floor, by the paper's
    first-order step, or not at all."""

    EXACT = "exact"
    FIRST_ORDER = "first_order"
    NONE = "none"


class PidGains(Section):
    """Gains of one loop: on the error, on its integral and on the measured rate."""

    kp: float = Field(ge=0, le=100)
    ki: float = Field(ge=0, le=100)
    kd: float = Field(ge=0, le=100)


class HorizontalGains(PidGains):
    """The position loop, one each for the grid's x and y."""

    kp: float = Field(
        10.0, ge=0, le=100, description="acceleration per metre off", json_schema_extra=unit("m/s^2 per m")
    )
    ki: float = Field(
        0.7, ge=0, le=100, description="its growth per metre off", json_schema_extra=unit("m/s^2 per m s")
    )
    kd: float = Field(
        5.8, ge=0, le=100, description="acceleration against speed", json_schema_extra=unit("m/s^2 per m/s")
    )


class YawGains(PidGains):
    """The heading loop."""

    kp: float = Field(
        1.5, ge=0, le=100, description="yaw rate per radian off", json_schema_extra=unit("rad/s per rad")
    )
    ki: float = Field(
        0.1,
        ge=0,
        le=100,
        description="its growth per radian off",
        json_schema_extra=unit("rad/s per rad s"),
    )
    kd: float = Field(
        0.1,
        ge=0,
        le=100,
        description="yaw rate against the measured one",
        json_schema_extra=unit("rad/s per rad/s"),
    )


class HeightGains(PidGains):
    """The height loop."""

    kp: float = Field(
        1.0, ge=0, le=100, description="climb rate per metre off", json_schema_extra=unit("m/s per m")
    )
    ki: float = Field(
        0.1, ge=0, le=100, description="its growth per metre off", json_schema_extra=unit("m/s per m s")
    )
    kd: float = Field(
        0.0,
        ge=0,
        le=100,
        description="climb rate against the measured one",
        json_schema_extra=unit("m/s per m/s"),
    )


class ControlExpert(Section):
    """What each loop may ask for, and how fast a setpoint may change."""

    horizontal_integral_limit_mps2: float = Field(
        0.8, ge=0, le=100, description="most that the position loop's integral asks for"
    )
    horizontal_output_limit_mps2: float = Field(
        1.7, gt=0, le=100, description="most that the position loop asks for"
    )
    yaw_integral_limit_radps: float = Field(
        0.1, ge=0, le=100, description="most that the yaw loop's integral asks for"
    )
    yaw_output_limit_radps: float = Field(0.8, gt=0, le=100, description="most that the yaw loop asks for")
    height_integral_limit_mps: float = Field(
        0.1, ge=0, le=100, description="most that the height loop's integral asks for"
    )
    height_output_limit_mps: float = Field(0.8, gt=0, le=100, description="most the height loop asks for")
    max_tilt_rate_degps: float = Field(150.0, gt=0, le=360, description="fastest change of a tilt setpoint")
    max_jerk_mps3: float = Field(
        30.0, gt=0.5, le=100, description="fastest change of the horizontal acceleration, g tan(tilt)"
    )
    max_yaw_accel_degps2: float = Field(
        180.0, gt=5, le=2000, description="fastest change of the yaw rate setpoint"
    )
    stale_s: float = Field(
        0.4, gt=0.05, le=2, description="by measurements older than this nothing leans or turns"
    )

    @property
    def max_tilt_rate_radps(self) -> float:
        return math.radians(self.max_tilt_rate_degps)

    @property
    def max_yaw_accel_radps2(self) -> float:
        return math.radians(self.max_yaw_accel_degps2)


class ControlConfig(Section):
    """Loops and limits; the limits have the last word before the wire."""

    horizontal: HorizontalGains = HorizontalGains()
    yaw: YawGains = YawGains()
    height: HeightGains = HeightGains()
    max_tilt_deg: float = Field(10.0, gt=0, le=30, description="largest roll and pitch, each")
    max_yaw_rate_degps: float = Field(45.0, gt=0, le=180, description="fastest turn")
    max_climb_mps: float = Field(0.8, gt=0, le=3, description="fastest climb")
    max_descend_mps: float = Field(0.9, gt=0, le=3, description="fastest descent")
    tilt_compensation: TiltCompensation = Field(
        TiltCompensation.EXACT, description="how the camera's tilt is taken out of the lines"
    )
    expert: ControlExpert = ControlExpert()

    @property
    def max_tilt_rad(self) -> float:
        return math.radians(self.max_tilt_deg)

    @property
    def max_yaw_rate_radps(self) -> float:
        return math.radians(self.max_yaw_rate_degps)
