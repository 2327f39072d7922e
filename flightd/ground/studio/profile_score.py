"""How well a colour profile does: on pictures whose paint, floor and lines people marked, and on flight logs.

Lines are scored as `flightd evaluate` scores them.  In a log nobody marked anything: there it counts whether
the lines by which the drone flew are found again, as `flightd replay` compares them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np

from flightd.core.errors import InputError
from flightd.core.types import Image, LineSet
from flightd.replay.perception_compare import replay_pictures
from flightd.replay.playback.pictures import find_pictures
from flightd.vision.line_detector import Detector
from flightd.vision.lines.colour_profile import classify, grow
from flightd.vision.lines.sampling import grid_for, sample
from flightd.vision.training.colour_training import FLOOR, PAINT, Teaching
from flightd.vision.training.labelled_frames import LabelledImage
from flightd.vision.training.line_score import Gate, LineScore, score_picture


class ProfileScore(msgspec.Struct, frozen=True):
    """Of the samples marked `paint` so many are `paint_kept`, of those marked `floor` so many are
    `floor_refused`; of the `lines` labelled as main so many are `lines_found`; of the
    `lines_judged`, found in pictures with every line labelled, so many are `lines_right`."""

    pictures: int
    paint: int
    paint_kept: int
    floor: int
    floor_refused: int
    lines: int
    lines_found: int
    lines_judged: int
    lines_right: int


class LogScore(msgspec.Struct, frozen=True):
    """In so many `pictures` of the `logs` that could be read: of the `lines` found in flight so many are
    found `again`, and `new` ones that were not."""

    logs: int
    pictures: int
    lines: int
    again: int
    new: int


def picture_score(
    detector: Detector, marked: Sequence[tuple[LabelledImage, Image, Teaching]]
) -> ProfileScore:
    """On labelled pictures, each with what it teaches."""
    paint = paint_kept = floor = floor_refused = 0
    score = LineScore()
    for label, bgr, teaching in marked:
        grid = grid_for(bgr.shape[1], bgr.shape[0])
        seen = grow(classify(sample(bgr, grid), detector.profile)) > 0
        rows, columns = (grid.offset + grid.step * np.arange(count) for count in (grid.height, grid.width))
        told = teaching[np.ix_(rows, columns)]
        paint += int((told == PAINT).sum())
        paint_kept += int(seen[told == PAINT].sum())
        floor += int((told == FLOOR).sum())
        floor_refused += int((~seen[told == FLOOR]).sum())
        if label.lines or label.negative or label.complete:
            judged = label if not label.negative else msgspec.structs.replace(label, complete=True)
            score_picture(score, judged, detector.detect(bgr), Gate())
    return ProfileScore(
        len(marked),
        paint,
        paint_kept,
        floor,
        floor_refused,
        score.labelled,
        score.labelled - score.missed,
        score.detected,
        score.detected - score.false,
    )


def score_on_log(detector: Detector, logs: Sequence[Path], most_pictures: int) -> LogScore:
    """On flight logs, of which at most so many pictures each are looked at, evenly spread."""

    def detect(bgr: Image, seq: int, stamp_ns: int) -> LineSet:
        return detector.detect(bgr, seq, stamp_ns)

    read = pictures = lines = again = new = 0
    for log in logs:
        try:
            every = max(-(-len(find_pictures(log)) // most_pictures), 1)
            drift = replay_pictures(log, detect, every)
        except InputError:  # cut off, or of another version: there are others
            continue
        read += 1
        pictures += drift.pictures
        lines += drift.pairs + drift.gone
        again += drift.pairs
        new += drift.new
    return LogScore(read, pictures, lines, again, new)
