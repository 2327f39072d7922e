"""QR codes on creased cloth or foil: the module grid is found again before the modules are read.

The reader has found the finder patterns, but its plane grid misses modules in between.  The edges of all
modules lie on a lattice; where the surface bulges, the local phase of the edges (their energy against a
wave of one module's period) says by how much the lattice is shifted.  A polynomial shift is fitted to the
phases from coarse to fine, held at the finder patterns so that it cannot slip by a whole module.  The error
correction of the code is what vouches for the result.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import cv2
import numpy as np
import zxingcpp
from numpy.typing import NDArray

from flightd.core.geometry import Matrix
from flightd.core.types import Image

_Floats: TypeAlias = NDArray[np.float32]

_CELL = 8
"""Pixels of one module in the flattened picture."""
_BORDER = 4 * _CELL
_DEGREE = 5
_WINDOWS = (5, 5, 4, 4, 3, 3)
"""Modules over which the phase is averaged in each round."""
_HOLD = 0.1
"""Weight of the finder patterns' staying in place against the phases of as many modules."""
_STIFFNESS = 1e-3
_ROUNDS = 8
_LARGEST_VERSION = 10


def flatten_qr(grey: Image, corners: Matrix, version: int) -> str | None:
    """The text of the damaged QR code at `corners` ((4, 2) x y, clockwise from its top left), or None.

    Versions above 10 carry too many modules for the phases to hold; they give None.
    """
    if not 1 <= version <= _LARGEST_VERSION:
        return None
    grid = _Grid.of(17 + 4 * version)
    plane = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) * grid.modules * _CELL + _BORDER - 0.5
    source, target = plane.astype(np.float32), corners.astype(np.float32)
    picture_from_flat = np.asarray(cv2.getPerspectiveTransform(source, target), np.float64)
    if not np.isfinite(picture_from_flat).all():
        return None
    shift_x: Matrix = np.zeros(grid.terms.shape[-1])
    shift_y = shift_x
    for window in _WINDOWS:
        flat = _flattened(grey, picture_from_flat, grid, shift_x, shift_y)
        shift_x = grid.improved(shift_x, _floats(cv2.Sobel(flat, cv2.CV_32F, 1, 0)), 1, window)
        shift_y = grid.improved(shift_y, _floats(cv2.Sobel(flat, cv2.CV_32F, 0, 1)), 0, window)
    flat = _flattened(grey, picture_from_flat, grid, shift_x, shift_y)
    return _decoded(flat, grid.modules)


@dataclass(frozen=True, slots=True)
class _Grid:
    """The flattened picture's geometry: polynomial terms at each pixel (S, S, T) and at each module
    (N, T), the terms' order (T,), and which modules belong to finder patterns (N,)."""

    modules: int
    terms: Matrix
    at_modules: Matrix
    order: Matrix
    held: Matrix

    @staticmethod
    def of(modules: int) -> _Grid:
        size = modules * _CELL + 2 * _BORDER
        axis = (np.arange(size) - size / 2) / (modules * _CELL / 2)
        a, b = np.meshgrid(axis, axis)
        powers = [(i, j) for i in range(_DEGREE + 1) for j in range(_DEGREE + 1 - i)]
        terms = np.stack([a**i * b**j for i, j in powers], axis=-1)
        middles = slice(_BORDER + _CELL // 2, -_BORDER, _CELL)
        held = np.zeros((modules, modules), bool)
        held[:8, :8] = held[:8, -8:] = held[-8:, :8] = True
        if modules > 21:
            held[-9:-4, -9:-4] = True  # the alignment pattern
        at_modules = terms[middles, middles].reshape(-1, len(powers))
        order = np.array([float((i + j) ** 2) for i, j in powers])
        return _Grid(modules, terms, at_modules, order, at_modules[held.ravel()])

    def improved(self, shift: Matrix, gradient: _Floats, axis: int, window: int) -> Matrix:
        """Coefficients (T,) of the shift along `axis` (1: x, 0: y) with the remaining phase taken in."""
        inside = slice(_BORDER - _CELL // 2, -_BORDER + _CELL // 2)
        energy: _Floats = np.zeros(gradient.shape, np.float32)
        energy[inside, inside] = np.square(gradient[inside, inside])
        place = np.arange(gradient.shape[0]) - _BORDER + 0.5
        wave = np.exp(2j * np.pi * place / _CELL)
        wave = wave[None, :] if axis == 1 else wave[:, None]
        real = self._at_modules(_floats(energy * wave.real), window)
        imag = self._at_modules(_floats(energy * wave.imag), window)
        total = self._at_modules(energy, window)
        phase = np.arctan2(imag, real)
        clear = np.hypot(real, imag) / np.sqrt(total + 1e-3 * total.max() + 1e-9)
        clear /= clear.mean() + 1e-9
        hold = _HOLD * self.held.T @ self.held
        stiff = np.diag(_STIFFNESS * len(phase) * self.order)
        step = np.zeros_like(shift)
        for _ in range(_ROUNDS):
            left = phase - 2 * np.pi * (self.at_modules @ step) / _CELL
            left = (left + np.pi) % (2 * np.pi) - np.pi
            # phases half a module off say nothing about the direction
            weight = clear * np.clip(np.cos(left / 2) ** 4, 0.005, 1.0)
            weighted = self.at_modules.T * weight
            normal = weighted @ self.at_modules + hold + stiff
            target = weighted @ (left * _CELL / (2 * np.pi)) - (hold + stiff) @ (shift + step)
            step = step + np.linalg.solve(normal, target)
        improved: Matrix = shift + step
        return improved

    def _at_modules(self, field: _Floats, window: int) -> Matrix:
        middles = slice(_BORDER + _CELL // 2, -_BORDER, _CELL)
        smooth = cv2.GaussianBlur(field, (0, 0), window * _CELL / 4)
        return np.asarray(smooth[middles, middles], np.float64).ravel()


def _floats(field: NDArray[Any]) -> _Floats:
    return np.asarray(field, np.float32)


def _flattened(
    grey: Image, picture_from_flat: Matrix, grid: _Grid, shift_x: Matrix, shift_y: Matrix
) -> Image:
    size = grid.terms.shape[0]
    v, u = np.mgrid[0:size, 0:size].astype(np.float64)
    points = np.stack([u + grid.terms @ shift_x, v + grid.terms @ shift_y, np.ones_like(u)], axis=-1)
    there = points @ picture_from_flat.T
    there = (there[..., :2] / there[..., 2:]).astype(np.float32)
    flat = cv2.remap(grey, there[..., 0], there[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(flat, np.uint8)


def _decoded(flat: Image, modules: int) -> str | None:
    """Read the modules' middles as a clean drawing of the code."""
    quarter = slice(_CELL // 4, -_CELL // 4)
    code = flat[_BORDER:-_BORDER, _BORDER:-_BORDER].reshape(modules, _CELL, modules, _CELL)
    cells = code[:, quarter, :, quarter].mean(axis=(1, 3))
    light = cells > (cells.min() + cells.max()) / 2
    drawing = np.kron(np.where(light, 255, 0).astype(np.uint8), np.ones((4, 4), np.uint8))
    drawing = np.pad(drawing, 16, constant_values=255)
    codes = zxingcpp.read_barcodes(
        drawing,
        formats=zxingcpp.BarcodeFormats(zxingcpp.BarcodeFormat.QRCode),
        text_mode=zxingcpp.TextMode.Plain,
    )
    return str(codes[0].text) if codes else None
