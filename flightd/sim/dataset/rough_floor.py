"""Frames of the simulator's own rough floor, with exact truth: level `rough` of the generated frames.

Each hall is one that a flight in the rough world might meet: a random site, its lines beside their places,
paint gone, pallets and drains on it, old lines, tape of other colours, a worn and dirty look, mirrored lamps,
an automatic exposure that lags, bands of the mains in the rolling shutter, motion blur and vibration.  The
lens alone is one without distortion: a label is a straight line, the nearest to what vibration makes wavy.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from flightd.core.types import Image
from flightd.sim.appearance import DEFAULT
from flightd.sim.dataset.floor_labels import FloorSight, floor_labels
from flightd.sim.floor.paint_damage import Stripe
from flightd.sim.floor.renderer import Renderer
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.random_sites import random_site
from flightd.sim.sensors.cheap_camera import CheapCamera
from flightd.sim.sensors.optics import SimCamera, moved, wide_lens
from flightd.sim.unknowns import WorldKind, unknowns_of
from flightd.site.site import PaintedLine
from flightd.vision.training.labelled_frames import LabelledImage

FRAMES_A_HALL = 5
"""A hall takes longer to lay out than a frame to draw."""
_DAMAGED = 0.4
"""Share of the frames that look at damage; a flight along the lines meets it seldomer."""
_HEIGHT_M = (0.6, 2.4)
_TILT_RAD, _MOST_TILT_RAD = math.radians(2.5), math.radians(10.0)
_ASIDE_M = 0.25
_SPEED_MPS, _CLIMB_MPS, _TURN_RADPS = 0.4, 0.15, 0.1
_BEFORE_S = 1.0
"""How long before a frame its automatic exposure had settled."""


class RoughHall:
    """One hall of the rough world, and the down camera that flies through it; the same arguments always make
    the same."""

    def __init__(self, seed: int, width_px: int, height_px: int, colour: str | None = None) -> None:
        """The paint's `colour` is drawn with the site unless given."""
        site = random_site(seed)
        site = site if colour is None else replace(site, line_colour=colour)
        self._seed, self._unknowns = seed, unknowns_of(WorldKind.ROUGH, seed)
        painted = self._unknowns.floor(site, seed)
        self._damage = damage = self._unknowns.paint_damage(painted, seed)
        self.colour = painted.line_colour
        self._stripes = [*map(_stripe, painted.lines), *damage.false_lines]
        self._faded = [old.stripe for old in damage.old_lines]
        self._hidden = [*damage.gaps, *damage.pallets, *damage.gratings]
        self._lengths_m = np.array([stripe.length_m for stripe in self._stripes])
        lens = replace(wide_lens(width_px, height_px), distortion=(0.0, 0.0, 0.0, 0.0, 0.0))
        self._camera = self._unknowns.camera(SimCamera(lens=lens))
        look = replace(self._unknowns.look(DEFAULT, told=False), flicker=0.0)
        self._renderer = Renderer(painted, self._camera, look, seed, damage)

    def frame(self, number: int) -> tuple[Image, LabelledImage]:
        """A frame from a place of its own, as the camera takes it in flight."""
        rng = np.random.default_rng([self._seed, number, 0x726F756768])
        flown = self._motion(rng)
        cheap = self._unknowns.cheap(told=False)
        camera = CheapCamera(lambda: self._renderer, self._camera, cheap, self._seed)
        camera.render(moved(flown, -_BEFORE_S), 2 * number)
        bgr = camera.render(flown, 2 * number + 1)
        sight = FloorSight(self._camera, flown)
        lines, nodes = floor_labels(self._stripes, self._hidden, sight, self._faded)
        lens = self._camera.lens
        label = LabelledImage(
            file="",
            width=lens.width_px,
            height=lens.height_px,
            line_colour=self.colour,
            complete=True,
            negative=not lines,
            lines=lines,
            nodes=nodes,
            tags=["rough"],
        )
        return bgr, label

    def _motion(self, rng: np.random.Generator) -> Kinematics:
        """A pose along the paint, and as fast as one flies there."""
        x_m, y_m = self._looked_at(rng)
        roll, pitch = np.clip(rng.normal(0.0, _TILT_RAD, 2), -_MOST_TILT_RAD, _MOST_TILT_RAD)
        vx, vy = rng.normal(0.0, _SPEED_MPS, 2)
        roll_rate, pitch_rate, yaw_rate = rng.normal(0.0, _TURN_RADPS, 3)
        return Kinematics(
            stamp_ns=round(rng.uniform(1e9, 2e9)),
            x_m=x_m + float(rng.normal(0.0, _ASIDE_M)),
            y_m=y_m + float(rng.normal(0.0, _ASIDE_M)),
            height_m=float(rng.uniform(*_HEIGHT_M)),
            vx_mps=float(vx),
            vy_mps=float(vy),
            climb_mps=float(rng.normal(0.0, _CLIMB_MPS)),
            roll_rad=float(roll),
            pitch_rad=float(pitch),
            yaw_rad=float(rng.uniform(-math.pi, math.pi)),
            roll_rate_radps=float(roll_rate),
            pitch_rate_radps=float(pitch_rate),
            yaw_rate_radps=float(yaw_rate),
        )

    def _looked_at(self, rng: np.random.Generator) -> tuple[float, float]:
        """A point on a line, or where something is wrong with the paint."""
        damage = self._damage
        wrong = [*self._hidden, *(one.box() for one in (*damage.false_lines, *self._faded))]
        if wrong and rng.random() < _DAMAGED:
            x0, y0, x1, y1 = wrong[int(rng.integers(len(wrong)))]
            return (x0 + x1) / 2, (y0 + y1) / 2
        stripe = self._stripes[int(rng.choice(len(self._stripes), p=self._lengths_m / self._lengths_m.sum()))]
        along_m = rng.uniform(-0.5, 0.5) * stripe.length_m
        return (
            stripe.x_m + along_m * math.cos(stripe.turn_rad),
            stripe.y_m + along_m * math.sin(stripe.turn_rad),
        )


def _stripe(line: PaintedLine) -> Stripe:
    dx_m, dy_m = line.x1_m - line.x0_m, line.y1_m - line.y0_m
    middle_m = (line.x0_m + line.x1_m) / 2, (line.y0_m + line.y1_m) / 2
    return Stripe(*middle_m, math.hypot(dx_m, dy_m), line.width_m, math.atan2(dy_m, dx_m))


_hall = lru_cache(maxsize=1)(RoughHall)
"""Frames are asked for one after the other."""


def rough_frame(
    seed: int, width_px: int, height_px: int, colour: str | None = None
) -> tuple[Image, LabelledImage]:
    """The frame that belongs to these arguments; `FRAMES_A_HALL` seeds in a row share a hall."""
    hall = _hall(seed // FRAMES_A_HALL, width_px, height_px, colour)
    return hall.frame(seed % FRAMES_A_HALL)
