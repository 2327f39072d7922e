"""What the page Studio has worked out in the reading process: pictures taken in, masks, training, scores."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from flightd.core.errors import InputError
from flightd.core.geometry import Lens
from flightd.core.preview import found_lines
from flightd.core.types import Image
from flightd.ground.flights.log_folder import path_of
from flightd.ground.messages import framed_picture
from flightd.ground.studio.profile_score import LogScore, ProfileScore, picture_score, score_on_log
from flightd.ground.studio.verdict import Verdict, verdict
from flightd.replay.playback.pictures import PicturePlace, read_picture
from flightd.studies.train import lesson
from flightd.vision.line_detector import Detector
from flightd.vision.lines.colour_profile import (
    STRONG,
    ColourProfile,
    classify,
    grow,
    load_profile,
    read_profile,
    save_profile,
)
from flightd.vision.lines.sampling import grid_for, sample
from flightd.vision.training.colour_training import (
    FEWEST_PICTURES,
    PAINT,
    Teaching,
    collect,
    sketch,
    train,
)
from flightd.vision.training.labelled_frames import LabelledImage

STROKES = "strokes"
"""Instead of a profile's name: what the strokes drawn so far teach."""
HELD_BACK_EACH = 4
"""Every fourth picture is held back from training, to score by."""
FEWEST_SHOWING = 7
"""So many pictures have to show paint: five to learn from, two to score by."""
_SEED = 0
_METHOD = "combined"
_SKETCHED = 16
_MOST_LOG_PICTURES = 60
_MOST_SIDE_PX = 4096
_JPEG_QUALITY = 95
_PAINT_RGBA, _DOUBT_RGBA, _DROPPED_RGBA = (255, 0, 200, 150), (255, 0, 200, 95), (40, 200, 255, 110)


@dataclass(frozen=True, slots=True)
class TakenIn:
    """A picture as the set keeps it."""

    jpeg: bytes
    width: int
    height: int


class Reference(msgspec.Struct, frozen=True):
    """A profile to compare with: `name` for people, `profile` a shipped name or a file."""

    name: str
    profile: str


class Scored(msgspec.Struct, frozen=True):
    """One profile's figures."""

    name: str
    pictures: ProfileScore
    logs: LogScore


class Outcome(msgspec.Struct, frozen=True):
    """What training came to: the new profile first in `scores`, then those it is compared with; `doubtful`
    are the pictures whose marks those of the others contradict."""

    training_hash: str
    trained_on: int
    held_back: tuple[str, ...]
    paint_kept: float
    floor_refused: float
    scores: tuple[Scored, ...]
    verdict: Verdict
    doubtful: tuple[str, ...] = ()


def from_log(root: Path, relative: str, place: PicturePlace) -> TakenIn:
    """A picture of a recorded log, as it was recorded."""
    jpeg = read_picture(path_of(root, relative), place, None).jpeg
    height, width = _decoded(jpeg).shape[:2]
    return TakenIn(jpeg, width, height)


def get_ready() -> None:
    """All that is to be read before the first picture is read with this module."""


def from_upload(file: Path) -> TakenIn:
    """A photograph or a live picture, written anew as JPEG.  InputError for what is none, or too large."""
    picture = _decoded(file.read_bytes())
    height, width = picture.shape[:2]
    if max(height, width) > _MOST_SIDE_PX:
        raise InputError(f"the picture is {width}x{height}; {_MOST_SIDE_PX} px a side at most")
    return TakenIn(
        cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])[1].tobytes(), width, height
    )


def training_hash_of(content: bytes, source: str) -> str:
    """What the profile in a file's content was trained on.  InputError where it is none."""
    return read_profile(content, source).training_hash


def mask_of(folder: Path, paint: str, labels: Sequence[LabelledImage], file: str, by: str) -> bytes:
    """How a picture is seen `by` a profile (a name, a file, STROKES): a PNG of the samples, transparent where
    there is no paint, behind a head with the share of paint and the lines that are found.

    Strong paint and weak paint that was grown into are tinted, weak paint that was dropped another way."""
    profile = _sketched(folder, paint, labels, file) if by == STROKES else load_profile(by)
    bgr = _decoded((folder / file).read_bytes())
    levels = classify(sample(bgr, grid_for(bgr.shape[1], bgr.shape[0])), profile)
    mask = grow(levels)
    tinted = np.zeros((*levels.shape, 4), np.uint8)
    tinted[levels > 0] = _bgra(_DROPPED_RGBA)
    tinted[mask > 0] = _bgra(_DOUBT_RGBA)
    tinted[(mask > 0) & (levels == STRONG)] = _bgra(_PAINT_RGBA)
    seen = Detector(_METHOD, profile).detect(bgr)
    plain = Lens(seen.width_px, seen.height_px, 1.0, 1.0, (seen.width_px - 1) / 2, (seen.height_px - 1) / 2)
    head = {"share": round(float((mask > 0).mean()), 4), "lines": found_lines(seen, plain)}
    return framed_picture(head, cv2.imencode(".png", tinted)[1].tobytes())


def train_and_score(
    folder: Path,
    paint: str,
    labels: Sequence[LabelledImage],
    references: Sequence[Reference],
    logs: Sequence[Path],
    out: Path,
) -> Outcome:
    """Train on some of a set's pictures, score on the others and on logs beside the `references`, and write
    the profile to `out`.  InputError where the set does not show enough, UnavailableError without
    scikit-learn."""
    told = [(label, *lesson(folder / label.file, label, paint)) for label in labels if _teaches(label)]
    showing = sum(bool((teaching == PAINT).any()) for _, _, teaching in told)
    if showing < FEWEST_SHOWING:
        raise InputError(
            f"paint is marked in {showing} pictures; {FEWEST_SHOWING} are needed, {FEWEST_PICTURES} to learn"
            " from and the others to score by",
            remedy="mark paint and floor in more pictures, under every light that the floor has",
        )
    # those that show paint first: both parts have their share of them, whatever was marked in which order
    told.sort(key=lambda one: not (one[2] == PAINT).any())
    held = [one for i, one in enumerate(told) if i % HELD_BACK_EACH == HELD_BACK_EACH - 1 or i == 0]
    taught = [one for one in told if all(one is not other for other in held)]
    pixels = collect(((bgr, teaching) for _, bgr, teaching in taught), paint, _SEED)
    trained = train(folder.name, paint, pixels, _SEED)
    save_profile(trained.profile, out)
    profiles = [("new", trained.profile)] + [(one.name, load_profile(one.profile)) for one in references]
    scores = tuple(_scored(name, profile, held, logs) for name, profile in profiles)
    return Outcome(
        trained.profile.training_hash,
        len(taught),
        tuple(label.file for label, _, _ in held),
        trained.paint_kept,
        trained.floor_refused,
        scores,
        verdict([(one.name, one.pictures, one.logs) for one in scores]),
        tuple(taught[number][0].file for number in trained.doubtful),
    )


def _scored(
    name: str,
    profile: ColourProfile,
    held: Sequence[tuple[LabelledImage, Image, Teaching]],
    logs: Sequence[Path],
) -> Scored:
    detector = Detector(_METHOD, profile)
    return Scored(name, picture_score(detector, held), score_on_log(detector, logs, _MOST_LOG_PICTURES))


def _sketched(folder: Path, paint: str, labels: Sequence[LabelledImage], file: str) -> ColourProfile:
    """What the marks teach: those of `file` first, and so many others that it takes no time."""
    teaching = sorted((label for label in labels if _teaches(label)), key=lambda label: label.file != file)
    lessons = (lesson(folder / label.file, label, paint) for label in teaching[:_SKETCHED])
    return sketch("strokes", paint, collect(lessons, paint, _SEED, fewest=1), _SEED)


def _teaches(label: LabelledImage) -> bool:
    return bool(label.regions or label.lines or label.negative or label.mask)


def _bgra(rgba: tuple[int, int, int, int]) -> tuple[int, int, int, int]:
    red, green, blue, alpha = rgba
    return blue, green, red, alpha


def _decoded(data: bytes) -> Image:
    if not data:
        raise InputError("the picture is empty")
    given: NDArray[np.uint8] = np.frombuffer(data, np.uint8)
    try:
        picture = cv2.imdecode(given, cv2.IMREAD_COLOR)
    except cv2.error:
        picture = None
    if picture is None:
        raise InputError("this is no picture", remedy="take a JPEG or PNG")
    return np.asarray(picture, np.uint8)
