"""What pictures of a chessboard say of a lens: where the board was shown, and how well one lens fits."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from flightd.core.errors import InputError
from flightd.core.preview import CameraName
from flightd.studies.calibrate import lens_keys
from flightd.studies.frame_files import read_image
from flightd.vision.lens_calibration import FEWEST_PICTURES, Board, BoardView, calibrate

COVERAGE = (8, 6)
"""The picture in cells across and down: each should have seen a corner of the board."""
_MOST_PICTURES = 60
_SECTIONS = {CameraName.DOWN: "camera", CameraName.FRONT: "front_camera"}


class ShownBoard(msgspec.Struct, frozen=True):
    """A picture with the whole board: its corners as parts of width and height; how far the fitted lens has
    them off, root mean square in pixels, None without a lens."""

    file: str
    corners: list[tuple[float, float]]
    error_px: float | None = None


class BoardStudy(msgspec.Struct, frozen=True):
    """`coverage` counts corners by cell, row by row; `refused` says why there is no lens, `config` is the
    lens as a configuration has it, by camera ("down", "front")."""

    pictures: int
    needed: int
    width: int
    height: int
    boards: list[ShownBoard]
    coverage: list[list[int]]
    error_px: float | None = None
    sigma_focal_px: float | None = None
    config: dict[str, str] = {}
    refused: str = ""


def study_boards(folder: Path, files: Sequence[str], board: Board) -> BoardStudy:
    """In the reading process: the newest pictures that show the whole board, all of one size."""
    views: list[BoardView] = []
    shown: list[str] = []
    width = height = 0
    looked = files[-_MOST_PICTURES:]
    for file in looked:
        bgr = read_image(folder / file)
        view = board.view_of(bgr)
        if view is None:
            continue
        if views and (bgr.shape[1], bgr.shape[0]) != (width, height):
            raise InputError("the pictures of the board differ in size", remedy="take them with one camera")
        height, width = bgr.shape[:2]
        views.append(view)
        shown.append(file)
    seen = [view.corners_px for view in views]
    coverage = _coverage(seen, width, height)
    parts = [[(float(x) / width, float(y) / height) for x, y in corners] for corners in seen]
    boards = [ShownBoard(file, corners) for file, corners in zip(shown, parts, strict=True)]
    plain = BoardStudy(len(looked), FEWEST_PICTURES, width, height, boards, coverage)
    try:
        found = calibrate(views, board, width, height)
    except InputError as err:
        return msgspec.structs.replace(plain, refused=str(err))
    fitted = [
        ShownBoard(one.file, one.corners, round(error, 3))
        for one, error in zip(boards, found.view_errors_px, strict=True)
    ]
    keys = "\n".join(f"{key} = {json.dumps(value)}" for key, value in lens_keys(found.lens).items())
    return msgspec.structs.replace(
        plain,
        boards=fitted,
        error_px=round(found.error_px, 3),
        sigma_focal_px=round(found.sigma_focal_px, 2),
        config={camera: f"[{section}]\n{keys}" for camera, section in _SECTIONS.items()},
    )


def _coverage(seen: Sequence[NDArray[np.float32]], width: int, height: int) -> list[list[int]]:
    across, down = COVERAGE
    if not seen:
        return [[0] * across for _ in range(down)]
    corners = np.concatenate(seen)
    counts, _, _ = np.histogram2d(
        corners[:, 1], corners[:, 0], bins=(down, across), range=((0, height), (0, width))
    )
    rows: list[list[int]] = counts.astype(int).tolist()
    return rows
