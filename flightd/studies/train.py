"""Teach a colour profile from labelled folders."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2

from flightd.core.errors import InputError, cannot_write
from flightd.core.types import Image
from flightd.studies.frame_files import read_image
from flightd.studies.progress_bar import track
from flightd.vision.lines.colour_profile import save_profile
from flightd.vision.training.colour_training import (
    FLOOR,
    PAINT,
    UNKNOWN,
    Teaching,
    Trained,
    collect,
    teaching_from_label,
    teaching_from_mask,
    train,
)
from flightd.vision.training.labelled_frames import LabelledImage, read_labels


def train_colour(datasets: Sequence[Path], colour: str, out: Path, name: str, seed: int) -> Trained:
    """Train on every picture of `datasets`, and write the profile to `out`.

    In pictures whose lines are of another colour, those lines count as floor.
    """
    labelled = [(folder / label.file, label) for folder, label in _labels(datasets)]
    if not any(_shows(label, colour) for _, label in labelled):
        raise InputError(f"no picture has `line_colour` {colour}: nothing to learn from", file=datasets[0])
    trained = train(name, colour, collect(_lessons(labelled, colour), colour, seed), seed)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        save_profile(trained.profile, out)
    except OSError as err:
        raise cannot_write(out, err) from err
    return trained


def _labels(datasets: Sequence[Path]) -> Iterator[tuple[Path, LabelledImage]]:
    for dataset in datasets:
        folder, labels = read_labels(dataset)
        for label in labels.images:
            yield folder, label


def _shows(label: LabelledImage, colour: str) -> bool:
    """Pictures that tell no colour are taken to show the one asked for."""
    return label.line_colour == colour or (label.line_colour in ("none", "") and not label.negative)


def _lessons(labelled: Sequence[tuple[Path, LabelledImage]], colour: str) -> Iterator[tuple[Image, Teaching]]:
    for path, label in track(labelled, "reading"):
        yield lesson(path, label, colour)


def lesson(path: Path, label: LabelledImage, colour: str) -> tuple[Image, Teaching]:
    """A labelled picture, and what it teaches of `colour`.  InputError for a picture that cannot be read."""
    bgr = read_image(path)
    if label.mask:
        mask = cv2.cvtColor(read_image(path.parent / label.mask), cv2.COLOR_BGR2GRAY)
        if mask.shape != bgr.shape[:2]:
            raise InputError(f"not of the size of {path.name}", file=path.parent / label.mask)
        teaching = teaching_from_mask(mask.astype("uint8"))
    else:
        teaching = teaching_from_label(label, bgr.shape[:2])
    if label.negative and not label.mask and not label.regions:
        teaching[:] = FLOOR
    if not _shows(label, colour):
        teaching[teaching == PAINT] = FLOOR if label.line_colour != "none" else UNKNOWN
    return bgr, teaching


def as_json(trained: Trained, out: Path) -> str:
    """The one JSON document of `flightd train-colour --json`."""
    profile = trained.profile
    return json.dumps(
        {
            "profile": str(out),
            "name": profile.name,
            "colour": profile.colour,
            "training_hash": profile.training_hash,
            "version": profile.version,
            "pictures": trained.pictures,
            "pixels": trained.pixels,
            "cross_validated": {
                "balanced_accuracy": round(trained.balanced_accuracy, 4),
                "paint_kept": round(trained.paint_kept, 4),
                "floor_refused": round(trained.floor_refused, 4),
            },
            "strong_colours": int((profile.lut == 2).sum()),
            "weak_colours": int((profile.lut == 1).sum()),
        },
        indent=1,
    )


def as_text(trained: Trained, out: Path) -> str:
    """The same for people."""
    profile = trained.profile
    return (
        f"{out}: {profile.colour}, trained on {trained.pixels} pixels of {trained.pictures} pictures\n"
        f"held-out pictures: {100 * trained.paint_kept:.1f} % of the paint kept, "
        f"{100 * trained.floor_refused:.1f} % of the rest refused, "
        f"balanced accuracy {trained.balanced_accuracy:.3f}; training hash {profile.training_hash}"
    )
