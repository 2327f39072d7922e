"""What the camera itself does to the picture: blur of lens and motion, vignetting, exposure, noise."""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import cv2
import numpy as np

from flightd.core.geometry import Lens, Matrix
from flightd.core.types import Image
from flightd.sim.appearance import Appearance
from flightd.sim.sensors.optics import Floats

Levels: TypeAlias = np.ndarray[Any, np.dtype[np.uint8 | np.uint16]]

_MIDDLE = 128
"""A gain of one in the sensor's tables."""
_TABLE_PIXELS = 6 * 640 * 360
"""Enough tables that their repetition does not show, few enough to fit in memory."""
_MAX_SMEAR_PX = 24.0
_OBLIQUE_PX = 1.0
"""A smear that is no longer than this along one axis looks the same if it is taken axis by axis."""
_MAINS_HZ = 100.0


class Sensor:
    """Vignetting, photon noise, read noise, exposure and mains flicker of one camera.

    Photon noise (a share of the signal) is baked into a few gain tables together with the vignetting;
    read noise is cut from a larger bank.  `seq` chooses both, so the same frame always gets the same."""

    def __init__(self, lens: Lens, look: Appearance, seed: int) -> None:
        self._seed = seed
        self._look = look
        rng = np.random.default_rng([seed, 0x6E6F6973])
        shape = (lens.height_px, lens.width_px)
        fall = _vignette(lens, look.vignetting)
        self._gains = []
        if look.noise > 0.0 or look.vignetting > 0.0:
            for _ in range(max(3, _TABLE_PIXELS // (shape[0] * shape[1])) if look.noise > 0.0 else 1):
                # at mid grey two thirds of the variance is the photons', spread over three channels
                grain = rng.standard_normal((*shape, 3), dtype=np.float32) * np.float32(
                    0.8 * look.noise / 128
                )
                gain = fall[..., None] * (1.0 + grain) * _MIDDLE
                self._gains.append(np.clip(np.round(gain), 0, 255).astype(np.uint8))
        self._bank: tuple[Image, Image] | None = None
        if look.noise > 0.0:
            size = (shape[0] + _BANK_MARGIN, shape[1] + _BANK_MARGIN)
            read = rng.standard_normal((*size, 1), dtype=np.float32) * np.float32(0.45)
            read = (read + rng.standard_normal((*size, 3), dtype=np.float32) * np.float32(0.4)) * np.float32(
                look.noise
            )
            steps = np.round(read)
            self._bank = (
                np.clip(steps, 0, 255).astype(np.uint8),
                np.clip(-steps, 0, 255).astype(np.uint8),
            )

    def expose(
        self,
        picture: Image,
        stamp_ns: int,
        seq: int,
        part: float = 1.0,
        gain: float = 1.0,
        light: Image | None = None,
        usual_light: float = 1.0,
    ) -> None:
        """Turn an ideal picture into one taken with parts of the usual exposure and gain, in place.
        `light` is that on each of its pixels, (H, W, 3), where it is not `usual_light` all over."""
        draw = np.random.default_rng([self._seed, seq]) if self._bank is not None else None
        beat = math.sin(math.tau * ((stamp_ns * 1e-9 * _MAINS_HZ) % 1.0))
        exposure = part * gain * self._look.exposure * (1.0 + self._look.flicker * beat)
        lit: Levels = picture
        if light is not None:  # in 16 bits: what is too light may be exposed for less
            lit = np.asarray(cv2.multiply(picture, light, dtype=cv2.CV_16U), np.uint16)
            exposure /= usual_light
        if self._gains:
            table = self._gains[int(draw.integers(len(self._gains))) if draw is not None else 0]
            cv2.multiply(lit, table, dst=picture, scale=exposure / _MIDDLE, dtype=cv2.CV_8U)
        elif exposure != 1.0:
            cv2.convertScaleAbs(lit, dst=picture, alpha=exposure)
        if self._bank is not None and draw is not None:
            row, column = (int(v) for v in draw.integers(_BANK_MARGIN, size=2))
            cut = (slice(row, row + picture.shape[0]), slice(column, column + picture.shape[1]))
            more, less = (noise[cut] if gain == 1.0 else _louder(noise[cut], gain) for noise in self._bank)
            cv2.add(picture, more, dst=picture)
            cv2.subtract(picture, less, dst=picture)


_BANK_MARGIN = 64


def _louder(noise: Image, gain: float) -> Image:
    return np.asarray(cv2.convertScaleAbs(noise, alpha=gain), np.uint8)


def _vignette(lens: Lens, depth: float) -> Floats:
    """(H, W) gain: 1 in the middle, 1 - depth in the corners, by the fourth power of the angle's cosine
    stretched to that depth."""
    cx, cy = lens.centre_px
    x = (np.arange(lens.width_px, dtype=np.float32) - np.float32(cx)) / np.float32(lens.fx_px)
    y = (np.arange(lens.height_px, dtype=np.float32) - np.float32(cy)) / np.float32(lens.fy_px)
    cosine4 = 1.0 / (1.0 + x[None, :] ** 2 + y[:, None] ** 2) ** 2
    fall: Floats = 1.0 - np.float32(depth) * (1.0 - cosine4) / (1.0 - cosine4.min())
    return fall


def blur_kernel(smear_px: tuple[float, float], soft_px: float) -> Floats | None:
    """Kernel of a straight smear (right, down; the whole way in pixels) and a Gaussian lens blur,
    centred, sum 1; None when it would hardly show."""
    length = math.hypot(*smear_px)
    if length > _MAX_SMEAR_PX:
        smear_px = (smear_px[0] * _MAX_SMEAR_PX / length, smear_px[1] * _MAX_SMEAR_PX / length)
        length = _MAX_SMEAR_PX
    if length < 0.3 and soft_px < 0.2:
        return None
    # a uniform smear and a round blur, joined: Gaussians strung along the way
    sigma = max(soft_px, 0.3)
    half_x = max(1, math.ceil(abs(smear_px[0]) / 2 + 1.6 * sigma - 0.3))
    half_y = max(1, math.ceil(abs(smear_px[1]) / 2 + 1.6 * sigma - 0.3))
    xs = np.arange(-half_x, half_x + 1)[None, :]
    ys = np.arange(-half_y, half_y + 1)[:, None]
    kernel = np.zeros((2 * half_y + 1, 2 * half_x + 1))
    beads = max(1, math.ceil(length * 2))
    for bead in range(beads):
        at = (bead + 0.5) / beads - 0.5
        kernel += np.exp(-((xs - at * smear_px[0]) ** 2 + (ys - at * smear_px[1]) ** 2) / (2 * sigma**2))
    normal: Floats = (kernel / kernel.sum()).astype(np.float32)
    return normal


def blur_vibrating(
    picture: Image, smear_px: tuple[float, float], vibration_px: Matrix, soft_px: float
) -> None:
    """Blur in place what a camera sees that vibrates besides: each of its equal strips of rows along what
    it sweeps by `vibration_px` (strips, moments of the exposure, 2), which leaves its mean in place.

    The axes vibrate by tones of their own, so it is done by columns and by rows, at a quarter of the time; a
    smear that is oblique is laid first, as if it had nothing to do with them."""
    if min(map(abs, smear_px)) > _OBLIQUE_PX:
        kernel = blur_kernel(smear_px, soft_px)
        if kernel is not None:
            cv2.filter2D(picture, -1, kernel, dst=picture, borderType=cv2.BORDER_REPLICATE)
        smear_px, soft_px = (0.0, 0.0), 0.0
    strips, moments, _ = vibration_px.shape
    steady = ((np.arange(moments) + 0.5) / moments - 0.5)[:, None] * np.clip(
        smear_px, -_MAX_SMEAR_PX, _MAX_SMEAR_PX
    )
    sharp, bounds = picture.copy(), np.linspace(0, len(picture), strips + 1).astype(int)
    for swept_px, top, bottom in zip(vibration_px + steady, bounds[:-1], bounds[1:], strict=True):
        across, down = (_swept_kernel(axis_px, soft_px) for axis_px in swept_px.T)
        above = max(top - len(down) // 2, 0)
        seen = sharp[above : bottom + len(down) // 2]
        blurred = cv2.sepFilter2D(seen, -1, across, down, borderType=cv2.BORDER_REPLICATE)
        picture[top:bottom] = blurred[top - above : bottom - above]


def _swept_kernel(swept_px: Matrix, soft_px: float) -> Floats:
    """Of one axis: a pixel is lit by all that comes over it by the (N,) places that are swept, softened.  A
    place between pixels is shared by both, so that the mean of them all stays where it is.  For a
    correlation, as OpenCV filters: what comes from one side stands on the other."""
    half = max(1, math.ceil(float(np.abs(swept_px).max())))
    shared = np.clip(1.0 - np.abs(np.arange(-half, half + 1) + swept_px[:, None]), 0.0, None)
    reach = math.ceil(1.6 * soft_px)
    soft = np.exp(-((np.arange(-reach, reach + 1) / max(soft_px, 0.1)) ** 2) / 2)
    kernel: Floats = (np.convolve(shared.mean(axis=0), soft) / soft.sum()).astype(np.float32)
    return kernel
