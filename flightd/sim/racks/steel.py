"""What the racks themselves look like: beams with the locations' labels, uprights, the mesh at the back."""

from __future__ import annotations

from typing import TypeAlias, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.types import Image
from flightd.sim.racks.code_symbols import Symbol, Symbology, modules
from flightd.sim.racks.panels import texels_per_m, texture_shape
from flightd.sim.racks.rack_layout import UPRIGHT_M, Opening

Floats: TypeAlias = NDArray[np.float32]

BACK_TEXELS_PER_M = 200.0
ORANGE = (28.0, 84.0, 205.0)
BLUE = (112.0, 62.0, 22.0)
_LABEL_INK, _LABEL_PAPER = 24.0, 226.0
_HOLE_PITCH_M = 0.05
_LABEL_PX_PER_MODULE = 3.3
_MOST_LABEL_PART = 0.86
"""A location's label is at most so high, in heights of its beam."""


def upright(height_m: float, seed: int) -> Image:
    """(H, W, 3) BGR face of an upright: painted steel with two rows of slots."""
    rng = np.random.default_rng([seed, 0x75707269])
    density = texels_per_m(UPRIGHT_M, height_m)
    shape = texture_shape(UPRIGHT_M, height_m, density)
    face = np.empty((*shape, 3), np.float32)
    face[:] = BLUE
    x = np.arange(shape[1], dtype=np.float32) / np.float32(shape[1])
    face *= (0.75 + 0.5 * np.exp(-(((x - 0.3) / 0.25) ** 2)))[None, :, None]
    _scuff(face, rng, 60)
    pitch = max(round(_HOLE_PITCH_M * density), 2)
    for top in range(pitch // 2, shape[0] - pitch, pitch):
        for column in (0.3, 0.7):
            left = round(column * shape[1]) - 6
            face[top : top + 26, left : left + 12] = 12.0
    return _picture(face)


def beam(
    openings: list[Opening],
    x0_m: float,
    x1_m: float,
    beam_m: float,
    right: float,
    px_per_m: float | None,
    seed: int,
) -> Image:
    """(H, W, 3) BGR face, `beam_m` high, of the beam between two uprights, seen from the aisle, with the
    labels of the openings above it; `px_per_m` None leaves the labels out."""
    rng = np.random.default_rng([seed, round(x0_m * 1000) & 0xFFFF, len(openings)])
    density = texels_per_m(x1_m - x0_m, beam_m)
    shape = texture_shape(x1_m - x0_m, beam_m, density)
    face = np.empty((*shape, 3), np.float32)
    face[:] = ORANGE
    y = np.arange(shape[0], dtype=np.float32) / np.float32(shape[0])
    face *= (1.12 - 0.35 * y)[:, None, None]
    _scuff(face, rng, 25)
    face[:4] *= 1.2
    face[-5:] *= 0.6
    if px_per_m is None:
        return _picture(face)
    for opening in openings:
        from_left_m = opening.x_m - x0_m if right > 0 else x1_m - opening.x_m
        most_module_m = _LABEL_PX_PER_MODULE / px_per_m
        _stick_location(face, opening.location.code, from_left_m * density, most_module_m, density)
    return _picture(face)


def back(width_m: float, height_m: float, seed: int) -> Image:
    """(H, W, 3) BGR back of an empty opening: wire mesh, and behind it, dim, the back of other goods."""
    rng = np.random.default_rng([seed, 0x6261636B])
    shape = round(height_m * BACK_TEXELS_PER_M), round(width_m * BACK_TEXELS_PER_M)
    area = np.empty((*shape, 3), np.float32)
    area[:] = (17.0, 18.0, 20.0)
    left = 0
    while left < shape[1]:
        width = int(rng.integers(60, 150))
        if rng.random() < 0.75:
            top = int(rng.uniform(0.1, 0.5) * shape[0])
            tone = np.array((22.0, 33.0, 42.0)) * rng.uniform(0.6, 1.3)
            area[top:, left : left + width - 6] = tone
        left += width
    step = round(0.05 * BACK_TEXELS_PER_M)
    area[::step] += 16.0
    area[:, ::step] += 16.0
    area = cast("Floats", cv2.GaussianBlur(area, (0, 0), 1.0))
    return _picture(area)


def _stick_location(face: Floats, code: str, x_px: float, most_module_m: float, density: float) -> None:
    """The small label of one location: its code as a Data Matrix, and in plain letters beside it."""
    symbol = Symbol(Symbology.DATA_MATRIX, code)
    pattern = modules(symbol)
    quiet = symbol.symbology.quiet_modules
    rows = pattern.shape[0] + 2 * quiet
    module_m = min(most_module_m, _MOST_LABEL_PART * face.shape[0] / density / rows)
    height = max(round(rows * module_m * density), 1)
    padded = cv2.copyMakeBorder(pattern, quiet, quiet, quiet, quiet, cv2.BORDER_CONSTANT, value=(255.0,))
    large = cv2.resize(padded, None, fx=16, fy=16, interpolation=cv2.INTER_NEAREST)
    square = cv2.resize(large, (height, height), interpolation=cv2.INTER_AREA)
    font, size = cv2.FONT_HERSHEY_DUPLEX, 0.36 * height / 22
    (width, tall), _ = cv2.getTextSize(code, font, size, 3)
    paper = np.full((height, height + width + height // 4), 255, np.uint8)
    paper[:, :height] = square
    cv2.putText(paper, code, (height, (height + tall) // 2), font, size, 0, 3, cv2.LINE_AA)
    top, left = (face.shape[0] - height) // 2, round(x_px - paper.shape[1] / 2)
    right_end = min(left + paper.shape[1], face.shape[1])
    cut = paper[:, max(-left, 0) : right_end - left].astype(np.float32) / 255.0
    tone = _LABEL_INK + (_LABEL_PAPER - _LABEL_INK) * cut
    face[top : top + height, max(left, 0) : right_end] = tone[..., None]


def _scuff(face: Floats, rng: np.random.Generator, count: int) -> None:
    height, width = face.shape[:2]
    marks = np.zeros((height, width), np.uint8)
    for _ in range(count):
        x, y = int(rng.integers(width)), int(rng.integers(height))
        dx, dy = (int(v) for v in rng.normal(0, 18, 2))
        cv2.line(
            marks, (x, y), (x + dx, y + dy), int(rng.integers(20, 90)), int(rng.integers(1, 4)), cv2.LINE_AA
        )
    face *= 1.0 - marks.astype(np.float32)[..., None] / 255.0


def _picture(face: Floats) -> Image:
    return np.clip(np.round(face), 0.0, 255.0).astype(np.uint8)
