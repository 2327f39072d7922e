"""A picture whose rows were exposed one after the other, as if all had been at its middle row's time.  Pure.

What moves through the picture meanwhile is bent by it: a line along the way leans while the drone rolls, one
across it is seen at another time at the picture's top than in its middle.  Each point is put back along the
motion field of a static floor (Longuet-Higgins and Prazdny, The interpretation of a moving retinal image,
Proc. R. Soc. Lond. B 208, 1980) by the time between its row and the middle one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, TypeVar

import numpy as np

from flightd.core.geometry import Lens, Matrix, Mount, heading_rotation, normalise_line
from flightd.core.types import FloorFeature, Junction, Line, LineSet, MarkerSight, PadSight

_Seen = TypeVar("_Seen", Junction, PadSight, MarkerSight, FloorFeature)


class ImageMotion(NamedTuple):
    """How the camera moves, in its own axes (right, down, optical): how fast it turns (rad/s), and its
    velocity over its height (1/s)."""

    turn_radps: Matrix
    travel_per_s: Matrix

    @classmethod
    def of(
        cls,
        rates_radps: tuple[float, float, float],
        velocity_mps: tuple[float, float],
        yaw_rad: float,
        height_m: float,
        mount: Mount,
    ) -> ImageMotion:
        """Of a body that rolls, pitches and yaws so fast, nearly level, with a velocity along grid axes, at
        a height above the floor."""
        image_from_body = mount.body_from_image().T
        along_body = heading_rotation(yaw_rad).T @ np.array([*velocity_mps, 0.0])
        return cls(image_from_body @ np.array(rates_radps), image_from_body @ along_body / height_m)


def as_of_one_moment(seen: LineSet, lens: Lens, motion: ImageMotion, readout_s: float) -> LineSet:
    """All that was seen where it was when the middle row was exposed; `readout_s` lie between the first row
    and the last, top to bottom."""
    if not readout_s:
        return seen

    def put_back(points_px: Sequence[tuple[float, float]]) -> Matrix:
        return _put_back(np.array(points_px, np.float64).reshape(-1, 2), lens, motion, readout_s)

    def moved(things: tuple[_Seen, ...]) -> tuple[_Seen, ...]:
        if not things:
            return ()
        places = put_back([(thing.x_px, thing.y_px) for thing in things]).tolist()
        return tuple(replace(thing, x_px=x, y_px=y) for thing, (x, y) in zip(things, places, strict=True))

    ends = [line.point_at(s) for line in seen.lines for s in (line.start_px, line.end_px)]
    straight = put_back(ends).reshape(-1, 2, 2).tolist()
    return replace(
        seen,
        lines=tuple(_through(line, *both) for line, both in zip(seen.lines, straight, strict=True)),
        junctions=moved(seen.junctions),
        pads=moved(seen.pads),
        markers=moved(seen.markers),
        features=moved(seen.features),
    )


def _put_back(points_px: Matrix, lens: Lens, motion: ImageMotion, readout_s: float) -> Matrix:
    """(N, 2) centred pixels where they were at the middle row's time."""
    centre, focal = np.array(lens.centre_px), np.array([lens.fx_px, lens.fy_px])
    rays = (points_px + centre - (lens.cx_px, lens.cy_px)) / focal
    (x, y), (right, down, optical) = rays.T, motion.turn_radps.tolist()
    # the rays are (x, y, 1), and np.cross takes nearly three times as long for as few
    turned = np.column_stack([down - optical * y, optical * x - right, right * y - down * x])
    speeds = -motion.travel_per_s - turned
    flow_px: Matrix = (speeds[:, :2] - rays * speeds[:, 2:]) * focal
    # a lens without distortion would show more than the picture's rows
    late_s = np.clip(points_px[:, 1:] / lens.height_px, -0.5, 0.5) * readout_s
    back: Matrix = points_px - flow_px * late_s
    return back


def _through(line: Line, start: Sequence[float], end: Sequence[float]) -> Line:
    """The line with these ends."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    if math.hypot(dx, dy) < 1.0:
        return line
    turned = math.atan2(-dx, dy)
    rho_px, theta_rad = normalise_line(start[0] * math.cos(turned) + start[1] * math.sin(turned), turned)
    ends = sorted(y * math.cos(theta_rad) - x * math.sin(theta_rad) for x, y in (start, end))
    is_flipped = math.cos(theta_rad - line.theta_rad) < 0.0
    return replace(
        line,
        rho_px=rho_px,
        theta_rad=theta_rad,
        start_px=ends[0],
        end_px=ends[1],
        rho_theta_cov=-line.rho_theta_cov if is_flipped else line.rho_theta_cov,
    )
