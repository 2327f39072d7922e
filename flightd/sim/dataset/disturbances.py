"""What happens to a picture of a floor between the paint and the file: dirt, light, lens, sensor, codec."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.types import Image
from flightd.sim.dataset.paint import Picture, Plane, bgr_of, paint_bgr
from flightd.sim.dataset.severity import DARKNESS, Severity

_MARGIN_PX = 14


def add_seams(rng: np.random.Generator, picture: Picture, count: int) -> None:
    """Thin expansion joints across the floor, a little darker than it."""
    height, width = picture.shape[:2]
    for _ in range(int(rng.integers(0, count + 1))):
        strokes = np.zeros((height, width), np.uint8)
        x, y, angle = rng.uniform(0, width), rng.uniform(0, height), rng.uniform(0, math.pi)
        reach = width + height
        ends = [
            (round(x + sign * reach * math.cos(angle)), round(y + sign * reach * math.sin(angle)))
            for sign in (-1, 1)
        ]
        cv2.line(strokes, ends[0], ends[1], 255, max(round(rng.uniform(2, 4) * width / 1920), 1), cv2.LINE_AA)
        picture *= 1.0 - (rng.uniform(0.1, 0.3) / 255.0) * strokes.astype(np.float32)[..., None]


def add_tyre_marks(rng: np.random.Generator, picture: Picture, count: int) -> None:
    """Wide curved streaks of rubber over floor and paint, up to 35 % darker."""
    height, width = picture.shape[:2]
    for _ in range(int(rng.integers(0, count + 1))):
        strokes = np.zeros((height, width), np.uint8)
        radius, angle = rng.uniform(0.6, 3.0) * width, rng.uniform(0, math.tau)
        x, y = (
            rng.uniform(0, width) + radius * math.cos(angle),
            rng.uniform(0, height) + radius * math.sin(angle),
        )
        thickness = max(round(rng.uniform(15, 60) * width / 1920), 2)
        cv2.circle(strokes, (round(x), round(y)), round(radius), 255, thickness, cv2.LINE_AA)
        streaks = rng.uniform(0.4, 1.0, (height, 1)).astype(np.float32)
        picture *= 1.0 - (rng.uniform(0.08, 0.35) / 255.0) * (strokes.astype(np.float32) * streaks)[..., None]


def add_distractors(
    rng: np.random.Generator, picture: Picture, covered: Plane, line_colour: str, count: int
) -> NDArray[np.bool_]:
    """Compact things on the floor, clear of the lines: some in the paint's own colour, never elongated.

    Returns (H, W): where the paint's colour is seen though no line is there.
    """
    height, width = picture.shape[:2]
    alike = np.zeros((height, width), bool)
    taken = cv2.dilate((covered > 0.02).astype(np.uint8), np.ones((3, 3), np.uint8), iterations=_MARGIN_PX)
    for _ in range(int(rng.integers(0, count + 1))):
        shape = _blob(rng, width, height, rng.uniform(0.015, 0.06) * width)
        if np.any(taken[shape > 0]):
            continue
        similar = rng.random() < 0.5
        tone = paint_bgr(rng, line_colour, 1.0) if similar else _anything(rng)
        _blend(picture, shape, tone * np.float32(rng.uniform(0.7, 1.0)), rng)
        alike |= (shape > 0) & similar
    return alike


def add_occluders(
    rng: np.random.Generator, picture: Picture, line_colour: str, count: int
) -> NDArray[np.bool_]:
    """Boxes and cables lying over the paint, of another colour.  Returns (H, W): where they lie."""
    height, width = picture.shape[:2]
    hidden = np.zeros((height, width), bool)
    for _ in range(int(rng.integers(0, count + 1))):
        shape = _blob(rng, width, height, rng.uniform(0.03, 0.08) * width)
        _blend(picture, shape, _unlike(rng, line_colour), rng)
        hidden |= shape > 0
    return hidden


def _blob(rng: np.random.Generator, width: int, height: int, radius: float) -> NDArray[np.uint8]:
    """(H, W) 0/255 mask of a box, a disc or a ragged polygon."""
    mask = np.zeros((height, width), np.uint8)
    x, y = rng.uniform(0, width), rng.uniform(0, height)
    kind = int(rng.integers(3))
    if kind == 0:
        cv2.circle(mask, (round(x), round(y)), max(round(radius), 2), 255, -1, cv2.LINE_AA)
        return mask
    corners = 4 if kind == 1 else int(rng.integers(5, 9))
    angles = rng.uniform(0, math.tau) + np.arange(corners) * math.tau / corners
    reach = radius * (np.full(corners, 1.2) if kind == 1 else rng.uniform(0.7, 1.3, corners))
    points = np.stack([x + reach * np.cos(angles), y + reach * np.sin(angles)], axis=-1)
    cv2.fillPoly(mask, [np.round(points).astype(np.int32)], 255, cv2.LINE_AA)
    return mask


def _blend(
    picture: Picture, mask: NDArray[np.uint8], bgr: NDArray[np.float32], rng: np.random.Generator
) -> None:
    alpha = mask.astype(np.float32)[..., None] / 255.0
    shade = np.float32(rng.uniform(0.9, 1.1))
    picture += alpha * (bgr * shade - picture)


def _anything(rng: np.random.Generator) -> NDArray[np.float32]:
    return bgr_of(rng.uniform(0, 360), rng.uniform(0, 0.6), rng.uniform(40, 210))


def _unlike(rng: np.random.Generator, line_colour: str) -> NDArray[np.float32]:
    """Cardboard or grey plastic, which is like none of the paints; mid grey for black and white."""
    if line_colour in ("white", "black"):
        return bgr_of(rng.uniform(0, 360), 0.1, rng.uniform(95, 125))
    return bgr_of(rng.uniform(0, 360), rng.uniform(0.0, 0.15), rng.uniform(50, 200))


def illumination(rng: np.random.Generator, width: int, height: int, severity: Severity) -> Plane:
    """(H, W) factor of the light: a slope, vignetting and soft-edged shadows."""
    w, h = width // 4 + 1, height // 4 + 1
    x = np.linspace(-1, 1, w, dtype=np.float32)[None, :]
    y = np.linspace(-1, 1, h, dtype=np.float32)[:, None]
    angle, slope = rng.uniform(0, math.tau), rng.uniform(0, severity.gradient)
    light: Plane = 1.0 + np.float32(slope) * (
        x * np.float32(math.cos(angle)) + y * np.float32(math.sin(angle))
    )
    light *= 1.0 - np.float32(rng.uniform(0, severity.gradient) / 4) * (x * x + y * y)
    for _ in range(int(rng.integers(0, severity.shadows + 1))):
        mask = np.zeros((h, w), np.uint8)
        corners = np.stack([rng.uniform(-0.3, 1.3, 4) * w, rng.uniform(-0.3, 1.3, 4) * h], axis=-1)
        cv2.fillConvexPoly(mask, cv2.convexHull(np.round(corners).astype(np.int32)), 255, cv2.LINE_AA)
        soft = cv2.GaussianBlur(mask, (0, 0), rng.uniform(0.5, 10) * width / 1920)
        light *= 1.0 - np.float32(rng.uniform(*severity.shadow_depth) / 255.0) * soft.astype(np.float32)
    return cv2.resize(light, (width, height), interpolation=cv2.INTER_LINEAR).astype(np.float32)


def glare(rng: np.random.Generator, width: int, height: int, count: int) -> Plane | None:
    """(H, W) light added by lamps mirrored in the floor, or None."""
    spots = int(rng.integers(0, count + 1))
    if spots == 0:
        return None
    w, h = width // 8 + 1, height // 8 + 1
    x, y = np.arange(w, dtype=np.float32)[None, :], np.arange(h, dtype=np.float32)[:, None]
    added = np.zeros((h, w), np.float32)
    for _ in range(spots):
        sx, sy = rng.uniform(0.02, 0.08) * w, rng.uniform(0.02, 0.08) * w
        dx, dy = (x - rng.uniform(0, w)) / sx, (y - rng.uniform(0, h)) / sy
        added += np.float32(rng.uniform(40, 170)) * np.exp(-0.5 * (dx * dx + dy * dy)).astype(np.float32)
    return cv2.resize(added, (width, height), interpolation=cv2.INTER_CUBIC).astype(np.float32)


def blur(rng: np.random.Generator, picture: Picture, severity: Severity) -> Picture:
    """Defocus and motion, both symmetric: they move no line."""
    scale = picture.shape[1] / 1920
    sigma = max(rng.uniform(*severity.blur_px) * max(scale, 0.5), 0.3)
    blurred = cv2.GaussianBlur(picture, (0, 0), sigma)
    length = rng.uniform(0, severity.motion_px) * scale
    if length > 1.5:
        blurred = cv2.filter2D(blurred, -1, _motion_kernel(length, rng.uniform(0, math.pi)))
    return np.asarray(blurred, np.float32)


def _motion_kernel(length: float, angle: float) -> NDArray[np.float32]:
    reach = math.ceil(length / 2) + 1
    kernel = np.zeros((2 * reach + 1, 2 * reach + 1), np.float32)
    for along in np.linspace(-length / 2, length / 2, 8 * reach + 1):
        x, y = reach + along * math.cos(angle), reach + along * math.sin(angle)
        left, top = int(x), int(y)
        for i, wx in ((left, left + 1 - x), (left + 1, x - left)):
            for j, wy in ((top, top + 1 - y), (top + 1, y - top)):
                kernel[j, i] += wx * wy
    kernel /= kernel.sum()
    return kernel


def expose(rng: np.random.Generator, picture: Picture, severity: Severity) -> Image:
    """Exposure, white balance and sensor noise (constant plus growing with the light), to uint8."""
    dark = rng.random() < severity.dark_probability
    gain = rng.uniform(*DARKNESS) if dark else rng.uniform(*severity.exposure)
    cast = gain * (1.0 + severity.cast * rng.uniform(-1, 1, 3))
    sigma = rng.uniform(*severity.noise)
    grain = rng.standard_normal(picture.shape[:2], dtype=np.float32)
    height, width = picture.shape[:2]
    lit = picture * cast.astype(np.float32)
    for channel in range(3):
        shift = int(rng.integers(1, 1 + height * width))
        lit[..., channel] += np.float32(sigma) * np.roll(grain, shift)
    return np.asarray(cv2.convertScaleAbs(np.maximum(lit, 0.0)), np.uint8)


def jpeg(rng: np.random.Generator, picture: Image, quality: tuple[int, int]) -> Image:
    """The picture after a round trip through JPEG."""
    level = int(rng.integers(quality[0], quality[1] + 1))
    _, coded = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, level])
    return np.asarray(cv2.imdecode(coded, cv2.IMREAD_COLOR), np.uint8)
