"""Colour profiles: which pixels are paint, at memory speed.

A profile is the decision of a trained classifier baked into a table over BGR565, the colour cut to
16 bits: 0 not paint, 1 perhaps (weak), 2 surely (strong).  Region growing keeps the weak pixels that
touch strong ones, which closes bands under changing light.

Drift of brightness, white balance and local light is taken out before the table is asked, by what the
frame itself shows: the picture is divided by its floor, whose brightness is the median of a wide
neighbourhood, so that a shadow's floor and a sunlit one both come out as the same grey, and whose tint
is that of the frame's less colourful half.  Where paint fills the neighbourhood two limits keep it from
dividing itself away: the floor's brightness may differ only so much from the whole frame's median, and
its tint from grey only as much as cameras and lamps make it.
"""

from __future__ import annotations

import io
import json
import math
import tokenize
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import IO, TypeAlias
from zipfile import BadZipFile, ZipFile

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.errors import InputError
from flightd.core.types import Image

Levels: TypeAlias = NDArray[np.uint8]
"""(H, W) uint8: NONE, WEAK or STRONG for each pixel."""

NONE, WEAK, STRONG = 0, 1, 2
SHIPPED = ("yellow", "white", "red", "blue", "green", "black", "orange")
TABLE_SIZE = 65536
FORMAT_VERSION = 1
_MOST_UNPACKED_BYTES = 1 << 20
_UNREADABLE = (
    OSError, ValueError, KeyError, TypeError, EOFError, RuntimeError, SyntaxError, MemoryError,
    BadZipFile, zlib.error, tokenize.TokenError,
)  # fmt: skip
"""All that a spoilt file makes of numpy's reader."""

FLOOR_GREY = 112.0
"""Brightness to which the floor is brought; leaves a factor of two above it for white paint."""

_FIELD_WIDTH = 40
_NEIGHBOURHOOD = 13
"""Floor field: its width in cells, and the median's window: a third of the picture's width, so that a
band half as wide as that does not count as floor."""
_LOCAL_RANGE = {"white": (0.3, 1.7), "black": (0.6, 3.0)}
_OTHER_LOCAL_RANGE = (0.45, 2.2)
"""Floor's brightness over the frame's median: tight on the side where a field full of paint would pull."""

_TINT_RANGE = (0.65, 1.55)
_FEWEST_SEEDS = 20
"""One strong pixel in so many is enough to seed the bands of a picture."""

_WEAK_BAND, _WEAK_LENGTH, _WEAK_SAMPLES = 0.002, 0.15, 8.0
"""Weak pixels that touch no strong one are looked at when there are so many of all, and kept where they
hang together over this part of the picture's diagonal, and as many samples."""

_BRIGHT_FLOOR = 135.0
_MAX_STRETCH = 3.0
_LUMA_BGR = (0.114, 0.587, 0.299)
_LUT_TAKES_16_BITS = int(cv2.__version__.split(".")[0]) >= 5


@dataclass(frozen=True, slots=True)
class ColourProfile:
    """What counts as paint of one colour.

    `lut` is (65536,) uint8 indexed by the 16-bit BGR565 value of a levelled pixel.  `colour` also says
    how the light is levelled.  `score` is the cross-validated balanced accuracy of the classifier behind
    it, `training_hash` names the data it was trained on.
    """

    name: str
    lut: NDArray[np.uint8]
    colour: str
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


def read_profile(content: bytes, source: str) -> ColourProfile:
    """A profile by its file's content; `source` says whose it is.  InputError where it is none."""
    try:
        with ZipFile(io.BytesIO(content)) as packed:
            unpacked = sum(part.file_size for part in packed.infolist())
    except _UNREADABLE as err:
        raise InputError(f"profile {source}: not a colour profile ({err})") from err
    if unpacked > _MOST_UNPACKED_BYTES:
        raise InputError(f"profile {source}: not a colour profile (it unpacks to {unpacked} bytes)")
    return _read(io.BytesIO(content), source)


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
    except _UNREADABLE as err:
        raise InputError(f"profile {source}: not a colour profile ({err})") from err
    lut.flags.writeable = False
    return profile


def floor_field(small_bgr: Image, colour: str) -> Image:
    """The floor's colour under lines of `colour`: about 40 cells across, at least 1 in each channel."""
    height, width = small_bgr.shape[:2]
    size = (min(_FIELD_WIDTH, width), max(round(height * min(_FIELD_WIDTH, width) / width), 1))
    cells = np.asarray(cv2.resize(small_bgr, size, interpolation=cv2.INTER_LINEAR), np.uint8)
    grey = np.asarray(cv2.cvtColor(cells, cv2.COLOR_BGR2GRAY), np.uint8)
    frame = _middle(grey.ravel())
    darkest, brightest = _LOCAL_RANGE.get(colour, _OTHER_LOCAL_RANGE)
    floor = np.asarray(cv2.medianBlur(grey, _NEIGHBOURHOOD))
    floor = np.minimum(np.maximum(floor, int(frame * darkest)), min(int(frame * brightest), 255))
    tint = _floor_tint(cells[::2, ::2], colour)
    # Half a level off the rounding: down, as the profiles were trained with.
    field = cv2.transform(floor, np.array([(part, -0.5) for part in tint]))
    return np.maximum(np.asarray(field, np.uint8), 1)


def _middle(values: NDArray[np.uint8]) -> float:
    """The median; of an even number, the upper of the two in the middle."""
    middle, ordered = len(values) // 2, values.copy()
    ordered.partition(middle)
    return float(ordered[middle])


def _floor_tint(cells: Image, colour: str) -> list[float]:
    """Colour (BGR) of the floor in units of its brightness, as far as the light makes it.

    The light tints even the least colourful cells; the floor's own tint is the median of the less
    colourful half, within limits about the light's.  White lines are themselves among the least colourful,
    and on grass or a painted floor they have the light's tint, not the floor's: for them, half-way.
    """
    pixels = cells.reshape(-1, 3)
    blue, green, red = pixels.T
    most = np.maximum(np.maximum(blue, green), red)
    saturation = (most - np.minimum(np.minimum(blue, green), red)) / (most + 8.0)
    grey = pixels.take(saturation.argsort()[: len(pixels) // 2 + 1], axis=0)
    light = _tint(grey[: max(len(pixels) // 10, 1)].copy(), (1.0, 1.0, 1.0))
    floor = _tint(grey, light)
    return (
        [math.sqrt(one * other) for one, other in zip(light, floor, strict=True)]
        if colour == "white"
        else floor
    )


def _tint(pixels: Image, about: Sequence[float]) -> list[float]:
    """Median colour of the pixels, which are put in order, in units of its brightness; within `_TINT_RANGE`
    about another."""
    pixels.sort(axis=0)
    colour = [value + 1.0 for value in pixels[len(pixels) // 2].tolist()]
    brightness = sum(part * value for part, value in zip(_LUMA_BGR, colour, strict=True))
    darkest, brightest = _TINT_RANGE
    return [
        min(max(value / brightness, other * darkest), other * brightest)
        for value, other in zip(colour, about, strict=True)
    ]


def level(small_bgr: Image, colour: str) -> Image:
    """The picture with the floor under its lines of `colour` brought to `FLOOR_GREY` everywhere.

    On a bright floor the sensor's saturation has compressed what is brighter still: there the part above
    the floor is stretched again, up to threefold.
    """
    height, width = small_bgr.shape[:2]
    field = floor_field(small_bgr, colour)
    floor = cv2.resize(field, (width, height), interpolation=cv2.INTER_LINEAR)
    brightness = sum(cv2.mean(field)) / 3
    # In place: every new picture of this size would push another one out of the processor's cache.
    if brightness <= _BRIGHT_FLOOR:
        return np.asarray(cv2.divide(small_bgr, floor, dst=floor, scale=FLOOR_GREY), np.uint8)
    levelled = cv2.divide(small_bgr, floor, scale=FLOOR_GREY)
    stretch = min((255.0 - FLOOR_GREY) / max(255.0 - brightness, 1.0), _MAX_STRETCH)
    above = cv2.subtract(small_bgr, floor, dst=floor)
    cv2.convertScaleAbs(above, dst=above, alpha=stretch - FLOOR_GREY / brightness)
    cv2.add(levelled, above, dst=levelled)
    return np.asarray(levelled, np.uint8)


def table_index(bgr: Image) -> NDArray[np.uint16]:
    """(h, w) BGR565 values, the index into a profile's table."""
    index = np.asarray(cv2.cvtColor(bgr, cv2.COLOR_BGR2BGR565))
    return index.view(np.uint16).reshape(bgr.shape[:2])


def classify(small_bgr: Image, profile: ColourProfile) -> Levels:
    """(h, w) levels of a (h, w, 3) picture, its light levelled first."""
    return _look_up(profile.lut, table_index(level(small_bgr, profile.colour)))


def _look_up(table: NDArray[np.uint8], index: NDArray[np.uint16] | NDArray[np.int32]) -> NDArray[np.uint8]:
    """`table[index]`; for 16 bits, a table of 65,536, OpenCV 5 takes less than half of numpy's time."""
    if _LUT_TAKES_16_BITS and index.dtype == np.uint16:
        return np.asarray(cv2.LUT(index, table), np.uint8)
    return table.take(index)


def has_seeds(levels: Levels) -> bool:
    """Whether so much paint is strong that the weak is judged by it."""
    return cv2.countNonZero(levels & STRONG) * _FEWEST_SEEDS >= cv2.countNonZero(levels)


def grow(levels: Levels) -> NDArray[np.uint8]:
    """(h, w) mask, 255 where a pixel is strong, or weak and joined (8-neighbours) to a strong one.

    Where next to no paint is strong (a worn white on a light floor) the weak pixels are seeds themselves:
    what is no band among them does not pass the tests of shape and edge that follow.
    """
    if not has_seeds(levels):
        return np.where(levels, np.uint8(255), np.uint8(0))
    few = levels.size < TABLE_SIZE * 2  # too few pixels for more separate parts than 16 bits can number
    count, found = cv2.connectedComponents(levels, connectivity=8, ltype=cv2.CV_16U if few else cv2.CV_32S)
    parts = np.asarray(found, np.uint16) if few else np.asarray(found, np.int32)
    kept = np.zeros(TABLE_SIZE if few else count, np.uint8)
    kept[parts[levels == STRONG]] = 255
    mask = _look_up(kept, parts)
    if cv2.countNonZero(levels) - cv2.countNonZero(mask) > _WEAK_BAND * levels.size:
        mask |= _long_parts(np.where(mask, np.uint8(0), levels))
    return mask


def _long_parts(levels: Levels) -> NDArray[np.uint8]:
    """(h, w) mask of the parts that are as long as a band: light that fell off along a whole line has left
    no strong pixel on it, and what is no band does not pass the tests of shape and edge that follow."""
    _, parts, stats, _ = cv2.connectedComponentsWithStats(levels, connectivity=8, ltype=cv2.CV_32S)
    length = np.hypot(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT])
    enough = max(_WEAK_LENGTH * math.hypot(*levels.shape), _WEAK_SAMPLES)
    kept = np.where(length >= enough, np.uint8(255), np.uint8(0))
    kept[0] = 0
    return kept.take(np.asarray(parts))
