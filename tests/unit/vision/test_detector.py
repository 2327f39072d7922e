"""Lines drawn with exact truth come back, by every method."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from flightd.core.errors import InputError
from flightd.core.types import Image, Line, LineSet
from flightd.vision.detector import METHODS, Detector

FLOOR = (118, 116, 112)
PAINT = (35, 190, 230)


def draw(
    lines: list[tuple[float, float, float]], width: int = 640, height: int = 360, seed: int = 0
) -> Image:
    """A noisy floor with antialiased painted lines (rho_px, theta_rad, width_px) about the centre."""
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    x -= (width - 1) / 2
    y -= (height - 1) / 2
    paint = np.zeros((height, width), np.float32)
    for rho, theta, thick in lines:
        off = np.abs(x * math.cos(theta) + y * math.sin(theta) - rho)
        paint = np.maximum(paint, np.clip(thick / 2 - off + 0.5, 0, 1))
    picture = paint[..., None] * np.array(PAINT) + (1 - paint[..., None]) * np.array(FLOOR)
    picture = cv2.GaussianBlur(picture, (0, 0), 0.7)
    picture = picture + np.random.default_rng(seed).normal(0, 3, picture.shape)
    drawn: Image = np.clip(picture, 0, 255).astype(np.uint8)
    return drawn


def nearest(seen: LineSet, rho_px: float, theta_rad: float) -> tuple[Line, float, float]:
    """The line nearest in angle and its errors (rho px, theta rad)."""
    best = None
    for line in seen.lines:
        turn = line.theta_rad - theta_rad
        rho = line.rho_px
        if abs(turn) > math.pi / 2:
            turn, rho = turn - math.copysign(math.pi, turn), -rho
        if best is None or abs(turn) * 100 + abs(rho - rho_px) < abs(best[2]) * 100 + abs(best[1]):
            best = (line, rho - rho_px, turn)
    assert best is not None, "no line found"
    return best


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("theta_deg", [0.0, 17.0, 45.0, 90.0, 133.0, 178.0])
def test_a_single_line_is_found_at_any_angle(method: str, theta_deg: float) -> None:
    theta = math.radians(theta_deg)
    seen = Detector(method).detect(draw([(31.0, theta, 24.0)]))
    _, rho_error, theta_error = nearest(seen, 31.0, theta)
    assert abs(rho_error) < {"naive": 4.0, "combined": 0.1}.get(method, 1.2)
    assert abs(math.degrees(theta_error)) < {"naive": 1.5, "combined": 0.05}.get(method, 0.2)


@pytest.mark.parametrize("method", METHODS)
def test_a_bare_floor_has_no_line(method: str) -> None:
    assert Detector(method).detect(draw([])).lines == ()


@pytest.mark.parametrize("shape", [(360, 640), (360, 640, 4), (0, 0, 3), (4, 640, 3)])
def test_pictures_of_another_shape_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError):
        Detector().detect(np.zeros(shape, np.uint8))


def test_sixteen_bit_pictures_are_refused() -> None:
    with pytest.raises(InputError, match="uint16"):
        Detector().detect(np.zeros((360, 640, 3), np.uint16))
