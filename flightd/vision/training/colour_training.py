"""Teach a colour: labelled pixels in, a support vector machine's decision baked into a profile out.

The pixels are taken just as the detector will see them: sampled, then their light levelled.  Needs
scikit-learn (extra `train`); the profile that comes out needs nothing.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.errors import InputError
from flightd.core.extras import missing_extra
from flightd.core.types import Image
from flightd.vision.lines.colour_profile import STRONG, TABLE_SIZE, WEAK, ColourProfile, level
from flightd.vision.lines.sampling import grid_for, sample
from flightd.vision.training.labelled_frames import LabelledImage

Teaching: TypeAlias = NDArray[np.uint8]
"""(H, W) uint8: UNKNOWN, PAINT or FLOOR (anything that is not this paint) for each pixel."""

UNKNOWN, PAINT, FLOOR = 0, 1, 2

MASK_PAINT, MASK_FLOOR = 250, 5
"""In a mask image, at least and at most; values between mean "not sure"."""

_INSIDE, _OUTSIDE = 0.7, 1.4
"""Of a labelled line's half width: pixels nearer its axis are paint, pixels farther are floor."""
_EDGE_PX = 2.0

_PIXELS_PER_IMAGE = 36
_PIXELS_WITHOUT_PAINT = 6
"""Taken of a picture that shows none of the paint; both for each light."""

_SATURATED = 250
"""Floor as bright as this in all channels (a lamp's mirror image) could be anything, and teaches nothing."""

_LIGHTS = 2
_EXPOSURE = (0.25, 4.0)
_CAST = 1.3
_BRIGHTEST_FLOOR = 215.0
"""Each picture teaches under its own light, and under others: exposed and tinted at random, but never so
that the floor is lost in the sensor's saturation."""

_FOLDS = FEWEST_PICTURES = 5
_SVM_C = 4.0
_UNSEEN = 0.06
"""Colours drawn at random and called floor, as a part of the pixels: what was never seen is not paint."""

_CONTRADICTED = 0.1, 0.5
"""A picture is doubtful when more than this part of its marked floor is paint by what the other pictures
teach, or more than that part of its marked paint floor: under another light some is, too."""

_STRONG = (0.003, 0.01, 0.75, 0.0)
_WEAK = (0.02, 0.05, 0.95, -0.6)
"""Part of the held-out floor that may pass; that may pass at most, if that part of the held-out paint
would not pass otherwise; and the least decision value (the machine's margin is -1..1)."""


@dataclass(frozen=True, slots=True)
class Pixels:
    """Levelled colours, (N, 3) uint8 BGR; whether each is paint, (N,) bool; its picture, (N,)."""

    bgr: NDArray[np.uint8]
    paint: NDArray[np.bool_]
    picture: NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Trained:
    """A profile, and how its classifier did on pictures that were held out."""

    profile: ColourProfile
    balanced_accuracy: float
    paint_kept: float
    floor_refused: float
    pixels: int
    pictures: int
    doubtful: tuple[int, ...] = ()
    """Pictures, in the order they were given in, whose marks the others contradict."""


def teaching_from_mask(mask: NDArray[np.uint8]) -> Teaching:
    """What a (H, W) mask image says: white is paint, black is floor, grey is not told."""
    teaching = np.full(mask.shape, UNKNOWN, np.uint8)
    teaching[mask >= MASK_PAINT] = PAINT
    teaching[mask <= MASK_FLOOR] = FLOOR
    return teaching


def teaching_from_label(label: LabelledImage, shape: tuple[int, int]) -> Teaching:
    """What regions and lines say.  Beside lines is floor only where the label is `complete`."""
    teaching = np.full(shape, UNKNOWN, np.uint8)
    if label.lines and not label.regions:
        if label.complete:
            teaching[:] = FLOOR
        for factor, value in ((_OUTSIDE, UNKNOWN), (_INSIDE, PAINT)):
            for line in label.lines:
                margin = _EDGE_PX if value == UNKNOWN else -_EDGE_PX
                reach = factor * line.thickness / 2 + margin
                if reach > 0.5 and (value == UNKNOWN or line.grade == "main"):
                    _band(teaching, (line.x1, line.y1), (line.x2, line.y2), reach, value)
    for region in label.regions:
        value = PAINT if region.paint else FLOOR
        if region.box is not None:
            x, y, width, height = (round(edge) for edge in region.box)
            teaching[max(y, 0) : max(y + height, 0), max(x, 0) : max(x + width, 0)] = value
        for first, second in zip(region.stroke, region.stroke[1:], strict=False):
            _band(teaching, first, second, region.width / 2, value)
    return teaching


def _band(
    teaching: Teaching, first: tuple[float, float], second: tuple[float, float], reach: float, value: int
) -> None:
    dx, dy = second[0] - first[0], second[1] - first[1]
    length = math.hypot(dx, dy)
    if length == 0.0:
        return
    nx, ny = -dy / length * reach, dx / length * reach
    corners = [
        (p[0] + s * nx, p[1] + s * ny) for p, s in ((first, 1), (second, 1), (second, -1), (first, -1))
    ]
    points = np.round(np.array(corners) * 16).astype(np.int32)
    cv2.fillConvexPoly(teaching, points, value, cv2.LINE_8, 4)


def take_pixels(
    bgr: Image, teaching: Teaching, colour: str, rng: np.random.Generator
) -> tuple[Image, NDArray[np.bool_]]:
    """Some paint and as much floor of one picture, levelled: ((n, 3) BGR, (n,) paint)."""
    grid = grid_for(bgr.shape[1], bgr.shape[0])
    raw = sample(bgr, grid)
    small = level(raw, colour).reshape(-1, 3)
    rows, columns = (grid.offset + grid.step * np.arange(count) for count in (grid.height, grid.width))
    told = teaching[np.ix_(rows, columns)].ravel()
    told[(told == FLOOR) & (raw.reshape(-1, 3).min(axis=1) >= _SATURATED)] = UNKNOWN
    count = _PIXELS_PER_IMAGE if (told == PAINT).any() else _PIXELS_WITHOUT_PAINT
    chosen = [rng.permutation(np.flatnonzero(told == value))[:count] for value in (PAINT, FLOOR)]
    return small[np.concatenate(chosen)], np.repeat([True, False], [len(chosen[0]), len(chosen[1])])


def _relit(bgr: Image, rng: np.random.Generator) -> Image:
    """The picture as if exposed otherwise, under a lamp of another tint."""
    floor = float(np.median(bgr[::8, ::8])) + 1.0
    gain = min(math.exp(rng.uniform(*np.log(_EXPOSURE))), max(_BRIGHTEST_FLOOR / floor, 1.0))
    cast = gain * np.exp(rng.uniform(-1, 1, 3) * math.log(_CAST))
    return np.asarray(cv2.convertScaleAbs(bgr * cast), np.uint8)


def collect(
    pictures: Iterable[tuple[Image, Teaching]], colour: str, seed: int, fewest: int = FEWEST_PICTURES
) -> Pixels:
    """The training pixels of all pictures.  Raises InputError where fewer than `fewest` show paint, and
    without floor."""
    rng = np.random.default_rng(seed)
    colours, paint, numbers = [], [], []
    for number, (bgr, teaching) in enumerate(pictures):
        for light in range(_LIGHTS):
            taken, is_paint = take_pixels(_relit(bgr, rng) if light else bgr, teaching, colour, rng)
            colours.append(taken)
            paint.append(is_paint)
            numbers.append(np.full(len(taken), number, np.intp))
    if not colours:
        raise InputError("there is no picture to learn from")
    together = Pixels(np.concatenate(colours), np.concatenate(paint), np.concatenate(numbers))
    shown = len(set(together.picture[together.paint].tolist()))
    if together.paint.all():
        raise InputError("no floor is marked", remedy="show what is no paint, too")
    if shown < fewest:
        raise InputError(
            f"only {shown} pictures show paint of this colour; at least {fewest} are needed, and floor"
        )
    return together


def train(name: str, colour: str, pixels: Pixels, seed: int) -> Trained:
    """Fit, cross-validate by picture, choose the levels on what was held out, and bake the table.

    The same pixels and seed give the same table.  Raises UnavailableError without scikit-learn.
    """
    features, paint = _with_unseen(pixels, seed)
    groups = np.concatenate([pixels.picture, np.full(len(paint) - len(pixels.paint), -1)])
    held_out = np.zeros(len(pixels.paint))
    folds = np.random.default_rng(seed).permutation(pixels.picture.max() + 1) % _FOLDS
    for fold in range(_FOLDS):
        out = np.append(folds, -1)[groups] == fold
        machine = _fit(features[~out], paint[~out])
        held_out[out[: len(held_out)]] = machine.decision_function(features[out])
    kept = float((held_out[pixels.paint] > 0).mean())
    refused = float((held_out[~pixels.paint] <= 0).mean())

    on_paint, on_floor = held_out[pixels.paint], held_out[~pixels.paint]
    strong = _threshold(on_paint, on_floor, _STRONG)
    weak = min(_threshold(on_paint, on_floor, _WEAK), strong)
    lut = _baked(_fit(features, paint), weak, strong)
    score = (kept + refused) / 2
    profile = ColourProfile(name, lut, colour, _digest(colour, pixels, seed), round(score, 4))
    shown = int(pixels.picture.max()) + 1
    doubtful = _contradicted(pixels, held_out)
    return Trained(profile, score, kept, refused, len(pixels.paint), shown, doubtful)


def _contradicted(pixels: Pixels, held_out: NDArray[np.float64]) -> tuple[int, ...]:
    """The pictures whose marks are not what the decision values of the others say."""
    wrong = (held_out > 0) != pixels.paint
    found = []
    for number in range(int(pixels.picture.max()) + 1):
        for marked, most in zip((~pixels.paint, pixels.paint), _CONTRADICTED, strict=True):
            here = marked & (pixels.picture == number)
            if here.any() and wrong[here].mean() > most:
                found.append(number)
                break
    return tuple(found)


def sketch(name: str, colour: str, pixels: Pixels, seed: int) -> ColourProfile:
    """A profile fitted once, to see at once what a few strokes teach: nothing is held out, so that its score
    is 0, not known, and its levels are chosen by what it learnt from.  Raises as `train`."""
    features, paint = _with_unseen(pixels, seed)
    machine = _fit(features, paint)
    values = machine.decision_function(features[: len(pixels.paint)])
    on_paint, on_floor = values[pixels.paint], values[~pixels.paint]
    strong = _threshold(on_paint, on_floor, _STRONG)
    weak = min(_threshold(on_paint, on_floor, _WEAK), strong)
    return ColourProfile(name, _baked(machine, weak, strong), colour, _digest(colour, pixels, seed))


def _baked(machine: Any, weak: float, strong: float) -> NDArray[np.uint8]:
    """(65536,) the machine's decision on every colour of the table."""
    decision = machine.decision_function(_features(_table_colours()))
    lut = np.zeros(TABLE_SIZE, np.uint8)
    lut[decision > weak] = WEAK
    lut[decision > strong] = STRONG
    return lut


def _digest(colour: str, pixels: Pixels, seed: int) -> str:
    """Names what was learnt from."""
    digest = hashlib.sha256(repr((colour, seed, _SVM_C, _UNSEEN)).encode())
    digest.update(pixels.bgr.tobytes() + pixels.paint.tobytes() + pixels.picture.tobytes())
    return digest.hexdigest()[:16]


def _threshold(
    on_paint: NDArray[np.float64], on_floor: NDArray[np.float64], aim: tuple[float, float, float, float]
) -> float:
    """The decision value above which a pixel passes."""
    wanted, most, least_paint, least_value = aim
    ideal, limit = np.quantile(on_floor, [1 - wanted, 1 - most])
    return float(max(min(ideal, np.quantile(on_paint, 1 - least_paint)), limit, least_value))


def _fit(features: NDArray[np.float64], paint: NDArray[np.bool_]) -> Any:
    try:
        from sklearn.svm import SVC  # noqa: PLC0415
    except ImportError as err:
        raise missing_extra("train", "training a colour profile") from err
    return SVC(C=_SVM_C, gamma="scale", class_weight="balanced", cache_size=500).fit(features, paint)


def _features(bgr: NDArray[np.uint8]) -> NDArray[np.float64]:
    """(N, 3) of the HSV cone: chroma towards hue 0 and 90 degrees, and value, all in 0..1 or -1..1.

    Hue as an angle would tear red apart, and is noise where there is no colour; chroma is neither.
    """
    hsv = cv2.cvtColor(np.ascontiguousarray(bgr[None]).astype(np.float32) / 255.0, cv2.COLOR_BGR2HSV)[0]
    hue, chroma = np.radians(hsv[:, 0]), hsv[:, 1] * hsv[:, 2]
    features = np.stack([chroma * np.cos(hue), chroma * np.sin(hue), hsv[:, 2]], axis=-1)
    return features.astype(np.float64)


def _with_unseen(pixels: Pixels, seed: int) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Features and labels, with random colours added as floor."""
    rng = np.random.default_rng(seed + 1)
    unseen = rng.integers(0, 256, (int(_UNSEEN * len(pixels.paint)), 3)).astype(np.uint8)
    features = _features(np.concatenate([pixels.bgr, unseen]))
    return features, np.concatenate([pixels.paint, np.zeros(len(unseen), bool)])


def _table_colours() -> NDArray[np.uint8]:
    """(65536, 3) BGR at the middle of each of the table's cells."""
    index = np.arange(TABLE_SIZE)
    blue, green, red = index & 31, (index >> 5) & 63, index >> 11
    return np.stack([blue * 8 + 4, green * 4 + 2, red * 8 + 4], axis=-1).astype(np.uint8)
