"""What the tracker knows of the floor at one time: lines, junctions, pads and markers, from the drone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TrackedLine:
    """One line across an axis: `offset_m` from the drone along the axis, at the time of the set.  When
    last seen it was in view from `from_m` to `to_m` along itself, from the drone; equal where unknown."""

    id: int
    offset_m: float
    sigma_m: float
    width_m: float
    seen_ns: int
    hits: int
    from_m: float = 0.0
    to_m: float = 0.0

    def moved(self, across_m: float, along_m: float, sigma_m: float = 0.0) -> TrackedLine:
        """The line as the drone sees it after moving so far across it, known to `sigma_m`, and along it."""
        return TrackedLine(
            self.id,
            self.offset_m - across_m,
            math.hypot(self.sigma_m, sigma_m),
            self.width_m,
            self.seen_ns,
            self.hits,
            self.from_m - along_m,
            self.to_m - along_m,
        )


@dataclass(frozen=True, slots=True)
class FloorJunction:
    """Where lines meet or one ends, from the drone in grid axes; `arms` has a bit for each grid direction
    in which paint leaves it: +x 1, +y 2, -x 4, -y 8."""

    dx_m: float
    dy_m: float
    arms: int

    def moved(self, x_m: float, y_m: float) -> FloorJunction:
        """The junction as the drone sees it after moving so far along the axes."""
        return FloorJunction(self.dx_m - x_m, self.dy_m - y_m, self.arms)


@dataclass(frozen=True, slots=True)
class PadOffset:
    """A pad on the floor: its centre from the drone in grid axes, and the length of its sides."""

    x_m: float
    y_m: float
    side_m: float

    def moved(self, x_m: float, y_m: float) -> PadOffset:
        """The pad as the drone sees it after moving so far along the axes."""
        return PadOffset(self.x_m - x_m, self.y_m - y_m, self.side_m)


@dataclass(frozen=True, slots=True)
class MarkerOffset:
    """A floor marker: its centre from the drone in grid axes, and the length of its sides."""

    id: int
    x_m: float
    y_m: float
    side_m: float

    def moved(self, x_m: float, y_m: float) -> MarkerOffset:
        """The marker as the drone sees it after moving so far along the axes."""
        return MarkerOffset(self.id, self.x_m - x_m, self.y_m - y_m, self.side_m)


@dataclass(frozen=True, slots=True)
class SensorEstimate:
    """What the lines say of the drone's own sensors, beyond the configuration, with standard deviations.

    Frames are exposed `delay_s` later than their stamps say: the camera's delay is that much shorter than
    configured, against the attitude's.  The camera sits rolled, pitched and turned by `mount` more than
    configured, the told roll and pitch are too small by `tilt`, its focal length is shorter by `scale_share`,
    the told height too small for good by `height_share`.
    `shake_rad` is what the picture shakes against the attitude from frame to frame (rms)."""

    delay_s: float = math.nan
    delay_sigma_s: float = math.nan
    mount_roll_rad: float = math.nan
    mount_pitch_rad: float = math.nan
    mount_sigma_rad: float = math.nan
    tilt_roll_rad: float = math.nan
    tilt_pitch_rad: float = math.nan
    tilt_sigma_rad: float = math.nan
    scale_share: float = math.nan
    scale_sigma: float = math.nan
    shake_rad: float = math.nan
    mount_yaw_rad: float = math.nan
    mount_yaw_sigma_rad: float = math.nan
    height_share: float = math.nan
    height_sigma: float = math.nan

    @property
    def is_known(self) -> bool:
        """Whether any line was seen; all numbers are NaN before."""
        return not math.isnan(self.delay_s)

    @property
    def focal_share(self) -> float:
        """By which share the focal length is longer than configured."""
        return 1.0 / (1.0 + self.scale_share) - 1.0


NOT_SEEN = SensorEstimate()
"""Nothing is known yet, or a log does not tell it."""


def last_known(told: Sequence[SensorEstimate]) -> SensorEstimate:
    """The newest in which anything is known, oldest first; `NOT_SEEN` where there is none."""
    return next((one for one in reversed(told) if one.is_known), NOT_SEEN)


@dataclass(frozen=True, slots=True)
class TrackSet:
    """The tracks at one time, in grid axes (x along the aisles, y to the right of x).

    `across_x` are the lines that cross the x axis (parallel to y), offsets in x; `across_y` the others.
    `lines_ns` is the capture time of the newest frame in which any line was taken; `junctions` and
    `markers` are those of the newest frame, taken at `junctions_ns`; `push` is the acceleration that no
    lean explains, as far as it is expected to last.
    """

    stamp_ns: int
    lines_ns: int
    yaw_rad: float
    yaw_sigma_rad: float
    vx_mps: float
    vy_mps: float
    ax_mps2: float
    ay_mps2: float
    across_x: tuple[TrackedLine, ...]
    across_y: tuple[TrackedLine, ...]
    pads: tuple[PadOffset, ...] = ()
    pads_ns: int = 0
    """Capture time of the frame in which the `pads` were seen."""
    junctions: tuple[FloorJunction, ...] = ()
    junctions_ns: int = 0
    push_x_mps2: float = 0.0
    push_y_mps2: float = 0.0
    markers: tuple[MarkerOffset, ...] = ()
    sensors: SensorEstimate = NOT_SEEN
    features_ns: tuple[int, int] = (0, 0)
    """Capture time of the newest frame in which features of the floor, and no line, told the motion along
    x, and along y."""
    velocity_sigma_mps: tuple[float, float] = (0.15, 0.15)
    """Of vx, and of vy."""
