"""Small pictures of painted floors with exact truth, and the comparison with what was seen."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.geometry import Lens
from flightd.core.types import Image, Line, LineSet
from flightd.vision.lines.undistortion import Plane

FLOOR = (118.0, 116.0, 112.0)
PAINT = (35.0, 190.0, 230.0)


@dataclass(frozen=True)
class Band:
    """x cos(theta) + y sin(theta) = rho about the picture's centre, `width` px wide, between `start` and
    `end` along (-sin(theta), cos(theta))."""

    rho: float
    theta: float
    width: float
    start: float = -1e6
    end: float = 1e6


def coverage(bands: list[Band], x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Part of each pixel that is painted, at ideal centred coordinates (x, y)."""
    paint = np.zeros(np.shape(x))
    for band in bands:
        across = np.abs(x * math.cos(band.theta) + y * math.sin(band.theta) - band.rho)
        along = y * math.cos(band.theta) - x * math.sin(band.theta)
        inside = np.clip(band.width / 2 - across + 0.5, 0, 1)
        inside *= np.clip(along - band.start + 0.5, 0, 1) * np.clip(band.end - along + 0.5, 0, 1)
        paint = np.maximum(paint, inside)
    return paint


def grid(width: int, height: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Centred coordinates of all pixels."""
    y, x = np.mgrid[0:height, 0:width].astype(float)
    return x - (width - 1) / 2, y - (height - 1) / 2


def mask_of(bands: list[Band], x: NDArray[np.float64], y: NDArray[np.float64]) -> Image:
    """255 where more than half is painted, at ideal centred coordinates (x, y); 0 elsewhere."""
    return np.where(coverage(bands, x, y) > 0.5, np.uint8(255), np.uint8(0))


def picture(paint: NDArray[np.float64], seed: int = 0, noise: float = 3.0, light: float = 1.0) -> Image:
    """The photograph of a floor with that paint: a little blur and noise, brightness times `light`."""
    colour = paint[..., None] * np.array(PAINT) + (1 - paint[..., None]) * np.array(FLOOR)
    return photographed(colour * light, seed, noise)


def photographed(colour: NDArray[np.float64], seed: int, noise: float) -> Image:
    """(H, W, 3) colours with a little blur and noise."""
    blurred = cv2.GaussianBlur(colour, (0, 0), 0.7)
    grainy = blurred + np.random.default_rng(seed).normal(0, noise, blurred.shape)
    drawn: Image = np.clip(grainy, 0, 255).astype(np.uint8)
    return drawn


def draw(
    bands: list[Band], width: int = 640, height: int = 360, seed: int = 0, lens: Lens | None = None
) -> Image:
    """The bands as a camera with that lens sees them."""
    x, y = Plane(width, height, lens).ideal(*grid(width, height))
    return picture(coverage(bands, x, y), seed)


def errors(line: Line, band: Band) -> tuple[float, float]:
    """(rho px, theta rad) of the line less the band's, as lines: (rho, theta) is (-rho, theta + pi)."""
    turn = line.theta_rad - band.theta
    rho = line.rho_px
    while abs(turn) > math.pi / 2:
        turn, rho = turn - math.copysign(math.pi, turn), -rho
    return rho - band.rho, turn


def nearest(seen: LineSet, band: Band) -> tuple[Line, float, float]:
    """The line that is most like the band, and its errors."""
    assert seen.lines, "no line found"
    best = min(seen.lines, key=lambda line: abs(errors(line, band)[0]) + 200 * abs(errors(line, band)[1]))
    return (best, *errors(best, band))
