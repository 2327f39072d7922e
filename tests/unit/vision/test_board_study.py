"""Pictures of a board, for the page Studio: where it was shown, how well one lens fits, what to do."""

from __future__ import annotations

import tomllib
from pathlib import Path

import cv2
import numpy as np
import pytest

from flightd.config.camera import CameraConfig
from flightd.config.front_camera import FrontCameraConfig
from flightd.ground.studio.board_study import study_boards
from tests.unit.vision.test_calibration import BOARD, boards


def kept(folder: Path, count: int) -> list[str]:
    """The pictures of the known lens, and one of no board at all."""
    for i, picture in enumerate(boards(count)):
        cv2.imwrite(str(folder / f"{i}.png"), picture)
    cv2.imwrite(str(folder / "bare.png"), np.full((360, 640, 3), 200, np.uint8))
    return [*(f"{i}.png" for i in range(count)), "bare.png"]


def test_coverage_residuals_and_the_configurations_keys_are_told(tmp_path: Path) -> None:
    study = study_boards(tmp_path, kept(tmp_path, 12), BOARD)
    assert study.pictures == 13
    assert 8 <= len(study.boards) <= 12
    assert sum(map(sum, study.coverage)) == len(study.boards) * 54
    assert study.coverage[3][4] > study.coverage[0][0]  # the middle is seen more than the corner
    assert study.error_px is not None
    assert study.error_px < 0.3
    assert all(one.error_px is not None and one.error_px < 0.5 for one in study.boards)
    down, front = (tomllib.loads(study.config[camera]) for camera in ("down", "front"))
    assert down["camera"]["fx_px"] == pytest.approx(380, rel=0.02)
    assert front["front_camera"] == down["camera"]
    assert CameraConfig.model_validate(down["camera"]).fx_px == down["camera"]["fx_px"]
    assert FrontCameraConfig.model_validate(front["front_camera"]).fx_px == down["camera"]["fx_px"]


def test_too_few_boards_say_how_many_are_needed_and_still_show_where_they_were(tmp_path: Path) -> None:
    study = study_boards(tmp_path, kept(tmp_path, 2), BOARD)
    assert "8 are needed" in study.refused
    assert study.config == {}
    assert len(study.boards) <= 2
    assert study_boards(tmp_path, [], BOARD).boards == []
