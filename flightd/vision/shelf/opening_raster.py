"""The opening of a place squarely from before it: one raster in metres, whatever the camera's pose."""

from __future__ import annotations

from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.geometry import Matrix
from flightd.core.scanning import PlaceOpening
from flightd.core.types import Image

ROW_M: Final = 0.0025
COLUMN_M: Final = 0.01
BELOW_M: Final = 0.08
"""So much below the deck is in the raster, too: the beam's face."""
_MOST_M = 4.0
"""Openings that are larger are nothing that a raster is made of."""


def deck_strip_m(opening: PlaceOpening, depth_m: float) -> float:
    """How far up the deck reaches in the raster, up to that depth; negative where it is seen from below."""
    _, eye_m, before_m = opening.eye_m
    return eye_m * depth_m / (before_m + depth_m)


def onto_opening(points_px: Matrix, opening: PlaceOpening) -> Matrix:
    """(N, 2) metres from the opening's left end and above its deck of (N, 2) centred pixels, as if all were
    in the plane of the rack's face."""
    width_m, height_m = opening.width_m, opening.height_m
    corners_m = np.array([(0.0, height_m), (width_m, height_m), (width_m, 0.0), (0.0, 0.0)], np.float32)
    onto = cv2.getPerspectiveTransform(np.array(opening.front_px, np.float32), corners_m)
    return np.asarray(cv2.perspectiveTransform(points_px[None].astype(np.float64), onto)[0], np.float64)


def brightest(bgr: Image) -> Image:
    """(H, W) of a picture, (H, W, 3) BGR: the largest of each pixel's three parts."""
    blue, green, red = cv2.split(bgr)
    return np.asarray(cv2.max(cv2.max(blue, green), red), np.uint8)


def largest(parts: NDArray[np.float32]) -> NDArray[np.float32]:
    """(H, W) of (H, W, 3): the largest of each pixel's three parts."""
    blue, green, red = cv2.split(parts)
    return np.asarray(cv2.max(cv2.max(blue, green), red), np.float32)


def in_columns(square: Image) -> Image:
    """(rows, columns, 3) BGR of an opening's raster with `COLUMN_M` to a column."""
    size = round(square.shape[1] * ROW_M / COLUMN_M), square.shape[0]
    return np.asarray(cv2.resize(square, size, interpolation=cv2.INTER_AREA), np.uint8)


def opening_raster(picture: Image, opening: PlaceOpening) -> Image | None:
    """(rows, columns, 3) BGR of an opening in a picture, (H, W, 3) BGR: square pixels of `ROW_M`, the lowest
    row first, `BELOW_M` below the deck; None for an opening of no usual size."""
    width_m, height_m = opening.width_m, opening.height_m
    if not (COLUMN_M < width_m <= _MOST_M and ROW_M < height_m <= _MOST_M):
        return None
    columns, rows = round(width_m / ROW_M), round((height_m + BELOW_M) / ROW_M)
    deck_row = BELOW_M / ROW_M - 0.5
    right, top = columns - 0.5, rows - 0.5
    edges = np.array([(-0.5, top), (right, top), (right, deck_row), (-0.5, deck_row)], np.float32)
    centre = np.array(picture.shape[1::-1]) / 2 - 0.5
    corners = (np.array(opening.front_px) + centre).astype(np.float32)
    low = np.maximum(np.floor(corners.min(axis=0)) - 40, 0).astype(int)
    high = np.minimum(np.ceil(corners.max(axis=0)) + 40, picture.shape[1::-1]).astype(int)
    if (high - low < 8).any():
        return None
    cut = picture[low[1] : high[1], low[0] : high[0]]
    onto = cv2.getPerspectiveTransform(edges, corners - low.astype(np.float32))
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    square = cv2.warpPerspective(cut, onto, (columns, rows), flags=flags, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(square, np.uint8)
