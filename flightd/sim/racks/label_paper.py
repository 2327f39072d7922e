"""One label as paper: the code, the text below it, and what has happened to it."""

from __future__ import annotations

import math
from typing import TypeAlias, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.types import Image
from flightd.sim.racks.code_symbols import Symbol, Symbology, modules
from flightd.sim.racks.stock import Condition, Label

Floats: TypeAlias = NDArray[np.float32]

_INK, _PAPER = 28, 232
_PX_PER_MODULE = 5
_PX_PER_SMALL_MODULE = 2
_TORN_PART = (0.45, 0.6)
"""Share of the code's length that a tear takes away: far more than any error correction mends."""
_SHINE = 95.0
"""Grey levels that a lamp adds in the middle of its image on a glossy label: the code still shows."""


def stick(texture: Image, label: Label, x_px: float, y_px: float, px_per_m: float, looks: int) -> None:
    """Draw `label` into a goods' front, its middle at (x, y) pixels."""
    rng = np.random.default_rng([looks, 0x6C61626C])
    small = label.condition is Condition.TOO_SMALL
    module_px = _PX_PER_SMALL_MODULE if small else _PX_PER_MODULE
    paper = _paper(label, module_px)
    whole = np.full(paper.shape, 255, np.uint8)
    if label.condition is Condition.TORN:
        whole = _torn(label.symbol, paper.shape, module_px, rng)
    scale = label.module_m * px_per_m / module_px
    c, s = math.cos(label.turn_rad) * scale, math.sin(label.turn_rad) * scale
    middle = (paper.shape[1] - 1) / 2, (paper.shape[0] - 1) / 2
    half_x = abs(c) * middle[0] + abs(s) * middle[1] + 2.0
    half_y = abs(s) * middle[0] + abs(c) * middle[1] + 2.0
    x0, y0 = max(math.floor(x_px - half_x), 0), max(math.floor(y_px - half_y), 0)
    x1, y1 = math.ceil(x_px + half_x) + 1, math.ceil(y_px + half_y) + 1
    under = texture[y0 : max(y1, 0), x0 : max(x1, 0)]
    if not under.size:
        return
    x_px, y_px = x_px - x0, y_px - y0
    place = np.array(
        [[c, -s, x_px - c * middle[0] + s * middle[1]], [s, c, y_px - s * middle[0] - c * middle[1]]]
    )
    size = (under.shape[1], under.shape[0])
    ink = cv2.warpAffine(paper, place, size, flags=cv2.INTER_LINEAR, borderValue=(_PAPER,))
    mask = cv2.warpAffine(whole, place, size, flags=cv2.INTER_LINEAR)
    if label.condition is Condition.GLOSSY:
        ink = cv2.add(ink, _shine(size, x_px, y_px, label, px_per_m, rng))
    part = mask.astype(np.float32)[..., None] / 255.0
    tint = np.array((0.985, 0.995, 1.0), np.float32)
    under[:] = np.round(under * (1.0 - part) + ink.astype(np.float32)[..., None] * tint * part)


def _paper(label: Label, module_px: int) -> Image:
    """The label upright, (H, W) grey, `module_px` to the module."""
    px_per_m = module_px / label.module_m
    width_m, height_m = label.paper_size_m
    paper = np.full((round(height_m * px_per_m), round(width_m * px_per_m)), _PAPER, np.uint8)
    code_height_m = label.code_size_m[1]
    pattern = modules(label.symbol)
    width_px, height_px = pattern.shape[1] * module_px, round(code_height_m * px_per_m)
    code = cv2.resize(pattern, (width_px, height_px), interpolation=cv2.INTER_NEAREST)
    x = (paper.shape[1] - width_px) // 2
    quiet_m = (
        0.01 if label.symbol.symbology.is_linear else label.symbol.symbology.quiet_modules * label.module_m
    )
    y = round(quiet_m * px_per_m)
    paper[y : y + height_px, x : x + width_px] = np.where(code == 0, _INK, _PAPER)
    below_m = height_m - quiet_m - code_height_m
    _write(paper, label.symbol.content, y + height_px, below_m * px_per_m)
    cv2.rectangle(paper, (0, 0), (paper.shape[1] - 1, paper.shape[0] - 1), 190, max(1, module_px // 2))
    return paper


def _write(paper: Image, text: str, top_px: int, room_px: float) -> None:
    """Set `text` in one line, centred in the room below the code."""
    font, wide_px = cv2.FONT_HERSHEY_SIMPLEX, paper.shape[1] * 0.86
    (width, height), _ = cv2.getTextSize(text, font, 1.0, 2)
    size = min(wide_px / width, 0.45 * room_px / height)
    thick = max(1, round(2 * size))
    (width, height), _ = cv2.getTextSize(text, font, size, thick)
    origin = (round((paper.shape[1] - width) / 2), round(top_px + (room_px + height) / 2))
    cv2.putText(paper, text, origin, font, size, _INK, thick, cv2.LINE_AA)


def _torn(symbol: Symbol, shape: tuple[int, ...], module_px: int, rng: np.random.Generator) -> Image:
    """255 where the paper is still there: an end of a linear code is gone over its whole height, or the
    side of a matrix code with its finder."""
    height, width = shape[0], shape[1]
    quiet_px = symbol.symbology.quiet_modules * module_px
    gone_px = quiet_px + float(rng.uniform(*_TORN_PART)) * (width - 2 * quiet_px)
    rows = np.arange(height)
    ragged = np.cumsum(rng.normal(0.0, module_px * 0.35, height))
    ragged -= ragged.mean()
    slope = float(rng.uniform(-0.12, 0.12)) * (rows - height / 2)
    edge = gone_px + np.clip(ragged, -2 * module_px, 2 * module_px) + slope
    whole = np.where(np.arange(width)[None, :] > edge[:, None], 255, 0).astype(np.uint8)
    # a finder of a Data Matrix is on its left, all linear codes need both ends, a QR code has two on the left
    if symbol.symbology is not Symbology.DATA_MATRIX and rng.random() < 0.5 and symbol.symbology.is_linear:
        whole = np.ascontiguousarray(whole[:, ::-1])
    return whole


def _shine(
    size: tuple[int, int], x_px: float, y_px: float, label: Label, px_per_m: float, rng: np.random.Generator
) -> Image:
    """(H, W) grey levels that the image of a lamp tube adds on a glossy label."""
    width_m, height_m = label.paper_size_m
    at_x = x_px + float(rng.uniform(-0.4, 0.4)) * width_m * px_per_m
    at_y = y_px + float(rng.uniform(-0.4, 0.4)) * height_m * px_per_m
    long_px, short_px = 0.09 * px_per_m, 0.022 * px_per_m
    lean = float(rng.uniform(-0.5, 0.5))
    x = np.arange(size[0], dtype=np.float32)[None, :] - np.float32(at_x)
    y = np.arange(size[1], dtype=np.float32)[:, None] - np.float32(at_y)
    u, v = (x + lean * y) / np.float32(long_px), (y - lean * x) / np.float32(short_px)
    shine: Floats = np.float32(_SHINE) * np.exp(-(u * u + v * v))
    return cast("Image", shine.astype(np.uint8))
