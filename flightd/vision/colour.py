"""Colour profiles: which pixels are paint, at memory speed.

A profile is the decision of a trained classifier baked into a table over BGR565, the colour cut to
16 bits: 0 not paint, 1 perhaps (weak), 2 surely (strong).  Region growing keeps the weak pixels that
touch strong ones, which closes bands under changing light.

Drift of brightness and white balance is taken out before the table is asked, by what the frame itself
shows: the median colour is the floor's, and it is brought to a standard grey.  Brightness is levelled on
the pixels; the colour gain acts on the table (an axis permutation of 64 KiB, cheaper than touching the
picture) and is clamped, so that a frame full of paint does not turn its own colour to grey.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import IO, TypeAlias
from zipfile import BadZipFile

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.errors import InputError
from flightd.core.types import Image

Levels: TypeAlias = NDArray[np.uint8]
"""(H, W) uint8: NONE, WEAK or STRONG for each pixel."""

NONE, WEAK, STRONG = 0, 1, 2
SHIPPED = ("yellow", "white", "red", "blue", "green", "black")
TABLE_SIZE = 65536
FORMAT_VERSION = 1

FLOOR_GREY = 112.0
"""Brightness to which the frame's floor is brought; leaves a factor of two above it for white paint."""

_MAX_BRIGHTNESS_GAIN = 8.0
_MAX_STRETCH = 3.0
_COLOUR_GAIN = (0.65, 1.55)
_REFERENCE_STRIDE = 4
_LUMA_BGR = np.array([0.114, 0.587, 0.299])


@dataclass(frozen=True, slots=True)
class ColourProfile:
    """What counts as paint of one colour.

    `lut` is (65536,) uint8 indexed by the 16-bit BGR565 value.  `score` is the cross-validated balanced
    accuracy of the classifier behind it, `training_hash` names the data it was trained on.
    """

    name: str
    lut: NDArray[np.uint8]
    colour: str = ""
    training_hash: str = ""
    score: float = 0.0
    version: int = FORMAT_VERSION

    def __post_init__(self) -> None:
        if self.lut.shape != (TABLE_SIZE,) or self.lut.dtype != np.uint8 or self.lut.max() > STRONG:
            raise ValueError(f"profile {self.name}: the table is not ({TABLE_SIZE},) uint8 of 0, 1, 2")


def load_profile(name_or_path: str | Path) -> ColourProfile:
    """A shipped profile by name (`SHIPPED`), or one from a file that `flightd train-colour` wrote.

    Raises InputError when there is no such profile or the file is not one.
    """
    if str(name_or_path) in SHIPPED:
        return _shipped(str(name_or_path))
    path = Path(name_or_path)
    if not path.is_file():
        raise InputError(
            f"profile {name_or_path}: neither a file nor a shipped profile ({', '.join(SHIPPED)}); "
            "make one with `flightd train-colour`"
        )
    with path.open("rb") as stream:
        return _read(stream, str(path))


def save_profile(profile: ColourProfile, path: Path) -> None:
    """Write `profile` as a compressed .npz, the same bytes for the same profile."""
    about = {
        "name": profile.name,
        "colour": profile.colour,
        "training_hash": profile.training_hash,
        "score": profile.score,
        "version": profile.version,
    }
    text = np.frombuffer(json.dumps(about, sort_keys=True).encode(), np.uint8)
    with path.open("wb") as stream:
        np.savez_compressed(stream, lut=profile.lut, about=text)


@lru_cache(maxsize=len(SHIPPED))
def _shipped(name: str) -> ColourProfile:
    with resources.files(__package__).joinpath("profiles", f"{name}.npz").open("rb") as stream:
        return _read(stream, name)


def _read(stream: IO[bytes], source: str) -> ColourProfile:
    try:
        with np.load(stream, allow_pickle=False) as data:
            about = json.loads(data["about"].tobytes())
            lut = np.ascontiguousarray(data["lut"])
        if about["version"] != FORMAT_VERSION:
            raise InputError(
                f"profile {source}: version {about['version']}, this program reads {FORMAT_VERSION}; "
                "train it again with `flightd train-colour`"
            )
        profile = ColourProfile(
            str(about["name"]), lut, str(about["colour"]), str(about["training_hash"]), float(about["score"])
        )
    except (OSError, ValueError, KeyError, TypeError, BadZipFile, EOFError) as err:
        raise InputError(f"profile {source}: not a colour profile ({err})") from err
    lut.flags.writeable = False
    return profile


def floor_light(small_bgr: Image) -> tuple[float, tuple[float, float, float]]:
    """The floor's brightness (1..256) and the gains (b, g, r) that make its colour neutral.

    Taken from the median of a sparse sample: exact while the floor covers more than half of the frame.
    The gains are clamped to what cameras do.
    """
    start, stride = _REFERENCE_STRIDE // 2, _REFERENCE_STRIDE
    sample = small_bgr[start::stride, start::stride]
    if sample.size == 0:
        sample = small_bgr
    floor = np.median(sample.reshape(-1, 3), axis=0) + 1.0
    luma = float(floor @ _LUMA_BGR)
    blue, green, red = np.clip(luma / floor, *_COLOUR_GAIN)
    return luma, (float(blue), float(green), float(red))


def level_brightness(small_bgr: Image, luma: float) -> Image:
    """The picture with a floor of brightness `luma` brought to `FLOOR_GREY`.

    A dark picture is multiplied.  A bright one is bent at the floor: its highlights were compressed by
    the sensor's saturation, so they are stretched again, up to threefold.
    """
    if luma <= FLOOR_GREY:
        gain = min(FLOOR_GREY / luma, _MAX_BRIGHTNESS_GAIN)
        return np.asarray(cv2.convertScaleAbs(small_bgr, alpha=gain), np.uint8)
    stretch = min((255.0 - FLOOR_GREY) / max(255.0 - luma, 1.0), _MAX_STRETCH)
    value = np.arange(256.0)
    below, above = value * (FLOOR_GREY / luma), FLOOR_GREY + (value - luma) * stretch
    table = np.clip(np.where(value < luma, below, above), 0, 255).astype(np.uint8)
    return np.asarray(cv2.LUT(small_bgr, table), np.uint8)


def relight(lut: NDArray[np.uint8], gain_bgr: tuple[float, float, float]) -> NDArray[np.uint8]:
    """The table that answers for a pixel p what `lut` answers for p * gain, channel by channel."""
    blue, green, red = (_gained_axis(gain, size) for gain, size in zip(gain_bgr, (32, 64, 32), strict=True))
    rows = (red[:, None] * 64 + green[None, :]).ravel()
    by_row = lut.reshape(2048, 32).take(rows, axis=0)
    by_column = np.asarray(cv2.transpose(by_row), np.uint8).take(blue, axis=0)
    return np.asarray(cv2.transpose(by_column), np.uint8).reshape(TABLE_SIZE)


def _gained_axis(gain: float, size: int) -> NDArray[np.intp]:
    axis: NDArray[np.intp] = np.clip((np.arange(size) + 0.5) * gain, 0, size - 1).astype(np.intp)
    return axis


def classify(small_bgr: Image, profile: ColourProfile) -> Levels:
    """(h, w) levels of a (h, w, 3) picture, after taking out its brightness and white balance."""
    luma, gain_bgr = floor_light(small_bgr)
    lit = level_brightness(small_bgr, luma)
    index = cv2.cvtColor(lit, cv2.COLOR_BGR2BGR565).view(np.uint16)[..., 0]
    return np.take(relight(profile.lut, gain_bgr), index)


def grow(levels: Levels) -> NDArray[np.uint8]:
    """(h, w) mask, 255 where a pixel is strong, or weak and joined (8-neighbours) to a strong one."""
    strong = levels >= STRONG
    if not strong.any():
        return np.zeros_like(levels)
    count, parts = cv2.connectedComponents(levels, connectivity=8, ltype=cv2.CV_32S)
    kept = np.zeros(count, np.uint8)
    kept[parts[strong]] = 255
    return kept.take(np.asarray(parts))
