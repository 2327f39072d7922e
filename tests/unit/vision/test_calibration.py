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
from flightd.vision.charuco_board import CharucoBoard
from flightd.vision.lens_calibration import Board, Calibration, calibrate

BOARD = Board(9, 6)
WIDTH, HEIGHT = 640, 360
MATRIX = np.array([[380.0, 0, 322.0], [0, 382.0, 176.0], [0, 0, 1]])
DISTORTION = np.array([-0.06, 0.015, 0.001, -0.0005, 0.0])


def shown(board: Image, share: float, far: tuple[float, float], aside: float, count: int) -> list[Image]:
    """Pictures of a flat board, `share` squares to its pixel, tilted so far away (in squares) and shifted by
    up to `aside`, through a known lens, by sampling the board for every pixel."""
    rng = np.random.default_rng(5)
    fine = np.arange(-0.25, WIDTH - 0.5, 0.5), np.arange(-0.25, HEIGHT - 0.5, 0.5)
    u, v = np.meshgrid(*fine)
    pixels = np.stack([u.ravel(), v.ravel()], 1).reshape(-1, 1, 2)
    rays = cv2.undistortPoints(pixels, MATRIX, DISTORTION).reshape(-1, 2)
    directions = np.column_stack([rays, np.ones(len(rays))])
    middle = np.array([board.shape[1], board.shape[0], 0.0]) * share / 2.0
    pictures = []
    for _ in range(count):
        rotation, _ = cv2.Rodrigues(rng.uniform(-0.45, 0.45, 3))
        centre = np.array([rng.uniform(-aside, aside), rng.uniform(-aside, aside) / 2, rng.uniform(*far)])
        corner = centre - rotation @ middle
        normal = rotation[:, 2]
        points = directions * ((normal @ corner) / (directions @ normal))[:, None] - corner
        x, y = ((points @ rotation[:, axis] / share - 0.5).reshape(u.shape) for axis in range(2))
        seen = cv2.remap(
            board,
            x.astype(np.float32),
            y.astype(np.float32),
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=(220, 220, 220),
        )
        smooth = cv2.resize(
            cv2.GaussianBlur(seen, (3, 3), 0.7), (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA
        )
        pictures.append(np.asarray(smooth, np.uint8))
    return pictures


def boards(count: int) -> list[Image]:
    """A chessboard, all of which is seen."""
    squares = (np.add.outer(np.arange(7), np.arange(10)) % 2 * 190 + 30).astype(np.uint8)
    grey = np.kron(squares, np.ones((20, 20), np.uint8))
    return shown(np.repeat(grey[..., None], 3, axis=2), 0.05, (11.0, 15.0), 3.0, count)


def charuco_boards(count: int, *, old: bool = False) -> list[Image]:
    """A ChArUco board of 8x6 squares, which hangs over the edge of most pictures."""
    markers = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    board = cv2.aruco.CharucoBoard((8, 6), 1.0, 0.7, markers)
    board.setLegacyPattern(old)
    grey = np.asarray(board.generateImage((480, 360)), np.uint8)
    return shown(np.repeat(grey[..., None], 3, axis=2), 1 / 60, (5.5, 8.0), 4.0, count)


def assert_is_the_lens(result: Calibration) -> None:
    lens = result.lens
    assert result.error_px < 0.3
    assert lens.fx_px == pytest.approx(380, rel=0.01)
    assert lens.fy_px == pytest.approx(382, rel=0.01)
    assert lens.cx_px == pytest.approx(322, abs=4)
    assert lens.cy_px == pytest.approx(176, abs=4)
    edge = 0.6  # distortion where it matters, as a displacement at the picture's border
    bent = sum(k * edge ** (2 * i) for i, k in ((1, lens.distortion[0]), (2, lens.distortion[1])))
    assert bent == pytest.approx(-0.06 * edge**2 + 0.015 * edge**4, abs=0.004)


def test_the_lens_is_found_again() -> None:
    seen = [view for picture in boards(24) if (view := BOARD.view_of(picture)) is not None]
    assert_is_the_lens(calibrate(seen, BOARD, WIDTH, HEIGHT))


@pytest.mark.parametrize("old", [False, True])
def test_parts_of_a_charuco_board_tell_the_lens_too(old: bool) -> None:
    board = CharucoBoard(7, 5, "dict_4x4_50")
    seen = [view for picture in charuco_boards(20, old=old) if (view := board.view_of(picture)) is not None]
    whole = [len(view.corners_px) == 35 for view in seen]
    assert len(whole) >= 15
    assert sum(whole) < len(whole) / 2
    assert_is_the_lens(calibrate(seen, board, WIDTH, HEIGHT))


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


def test_the_command_takes_charuco_boards_and_says_what_does_not_fit(tmp_path: Path) -> None:
    for i, picture in enumerate(charuco_boards(12)):
        cv2.imwrite(str(tmp_path / f"{i}.png"), picture)

    def calibrated(*options: str) -> str:
        done = CliRunner().invoke(app, ["calibrate", str(tmp_path), "--json", *options])
        assert isinstance(done.exception, InputError | None)
        return str(done.exception) if done.exception is not None else done.stdout

    found = json.loads(calibrated("--board", "7x5", "--charuco", "4X4_50"))
    assert found["boards"] >= 8
    assert found["camera"]["fx_px"] == pytest.approx(380, rel=0.02)
    assert "called 'stars'" in calibrated("--charuco", "stars")
    assert "a 20x10 board has 115 markers" in calibrated("--board", "20x10", "--charuco", "4X4_50")
    assert "12 more: check --board" in calibrated("--board", "6x8", "--charuco", "4X4_50")
    assert "check --charuco" in calibrated("--board", "7x5", "--charuco", "5X5_100")
    by_log = CliRunner().invoke(app, ["calibrate", "--from-log", "a.mcap", "--charuco", "4X4_50"])
    assert "give pictures of a board, or --from-log" in str(by_log.exception)
