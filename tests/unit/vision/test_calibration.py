"""Calibration: the lens that drew the boards is the lens that is found."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from flightd.cli.main import app
from flightd.core.errors import InputError
from flightd.core.types import Image
from flightd.vision.lens_calibration import Board, calibrate, find_board

BOARD = Board(9, 6)
WIDTH, HEIGHT = 640, 360
MATRIX = np.array([[380.0, 0, 322.0], [0, 382.0, 176.0], [0, 0, 1]])
DISTORTION = np.array([-0.06, 0.015, 0.001, -0.0005, 0.0])


def boards(count: int) -> list[Image]:
    """Pictures of a tilted chessboard through a known lens, by sampling the board for every pixel."""
    rng = np.random.default_rng(5)
    u, v = np.meshgrid(np.arange(WIDTH, dtype=np.float64), np.arange(HEIGHT, dtype=np.float64))
    pixels = np.stack([u.ravel(), v.ravel()], 1).reshape(-1, 1, 2)
    rays = cv2.undistortPoints(pixels, MATRIX, DISTORTION).reshape(-1, 2)
    pictures = []
    for _ in range(count):
        rotation, _ = cv2.Rodrigues(rng.uniform(-0.45, 0.45, 3))
        centre = np.array([rng.uniform(-3, 3), rng.uniform(-1.5, 1.5), rng.uniform(11, 15)])
        corner = centre - rotation @ np.array([4.0, 2.5, 0.0])
        normal = rotation[:, 2]
        directions = np.column_stack([rays, np.ones(len(rays))])
        points = directions * ((normal @ corner) / (directions @ normal))[:, None] - corner
        x, y = points @ rotation[:, 0], points @ rotation[:, 1]
        dark = (np.floor(x).astype(int) + np.floor(y).astype(int)) % 2 == 0
        on_board = (x > -1) & (x < 9) & (y > -1) & (y < 6)
        grey = np.where(on_board & dark, 30.0, 220.0).reshape(HEIGHT, WIDTH).astype(np.uint8)
        smooth = np.asarray(cv2.GaussianBlur(grey, (3, 3), 0.7), np.uint8)
        pictures.append(np.repeat(smooth[..., None], 3, axis=2))
    return pictures


def test_the_lens_is_found_again() -> None:
    seen = [corners for picture in boards(24) if (corners := find_board(picture, BOARD)) is not None]
    result = calibrate(seen, BOARD, WIDTH, HEIGHT)
    lens = result.lens
    assert result.error_px < 0.3
    assert lens.fx_px == pytest.approx(380, rel=0.01)
    assert lens.fy_px == pytest.approx(382, rel=0.01)
    assert lens.cx_px == pytest.approx(322, abs=4)
    assert lens.cy_px == pytest.approx(176, abs=4)
    edge = 0.6  # distortion where it matters, as a displacement at the picture's border
    bent = sum(k * edge ** (2 * i) for i, k in ((1, lens.distortion[0]), (2, lens.distortion[1])))
    assert bent == pytest.approx(-0.06 * edge**2 + 0.015 * edge**4, abs=0.004)


def test_too_few_boards_are_refused_with_advice() -> None:
    with pytest.raises(InputError, match="found in 0 pictures, 8 are needed"):
        calibrate([], BOARD, WIDTH, HEIGHT)


def test_the_command_prints_the_keys_of_the_configuration(tmp_path: Path) -> None:
    for i, picture in enumerate(boards(12)):
        cv2.imwrite(str(tmp_path / f"{i}.png"), picture)
    done = CliRunner().invoke(app, ["calibrate", str(tmp_path), "--json"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["boards"] >= 8
    assert found["camera"]["fx_px"] == pytest.approx(380, rel=0.02)
    wrong = CliRunner().invoke(app, ["calibrate", str(tmp_path), "--board", "9by6"])
    assert isinstance(wrong.exception, InputError)
