"""How far the edges of a region are turned, whatever stands upright around them."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
import zxingcpp

from flightd.core.types import Image
from flightd.vision.shelf.edge_turn import edges_turn_rad

LEAST_RAD = math.radians(4.0)


def turned(kind: str, turn_deg: float) -> Image:
    """A code turned clockwise on paper, in an upright frame, before a wall with noise."""
    code = zxingcpp.create_barcode("4012345678901", getattr(zxingcpp.BarcodeFormat, kind))
    drawn = np.asarray(code.to_image(scale=3 if kind in {"Code128", "EAN13"} else 7), np.uint8)
    picture = np.full((400, 500), 120, np.uint8)
    cv2.rectangle(picture, (20, 20), (480, 380), 60, 5)
    height, width = drawn.shape
    turn = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), -turn_deg, 1.0)
    turn[:, 2] += (500 - width) / 2, (400 - height) / 2
    cv2.warpAffine(drawn, turn, (500, 400), dst=picture, borderMode=cv2.BORDER_TRANSPARENT)
    noisy = picture + np.random.default_rng(5).normal(0.0, 4.0, picture.shape)
    return np.clip(noisy, 0, 255).astype(np.uint8)


@pytest.mark.parametrize("turn_deg", [-40, -17, -8, 8, 15, 30, 43])
@pytest.mark.parametrize("kind", ["Code128", "EAN13", "DataMatrix", "QRCode"])
def test_the_turn_of_a_code_is_told_within_two_degrees(kind: str, turn_deg: float) -> None:
    found = edges_turn_rad(turned(kind, turn_deg), LEAST_RAD)
    assert found is not None
    assert math.degrees(found) == pytest.approx(turn_deg, abs=2.0)


def test_directions_a_right_angle_apart_are_one() -> None:
    found = edges_turn_rad(turned("Code128", 80), LEAST_RAD)
    assert found is not None
    assert math.degrees(found) == pytest.approx(-10.0, abs=2.0)


@pytest.mark.parametrize("kind", ["Code128", "DataMatrix"])
def test_nothing_is_turned_in_an_upright_region(kind: str) -> None:
    assert edges_turn_rad(turned(kind, 0), LEAST_RAD) is None


def test_a_region_without_edges_has_no_turn() -> None:
    assert edges_turn_rad(np.full((50, 60), 90, np.uint8), LEAST_RAD) is None
