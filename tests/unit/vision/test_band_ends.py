"""A band is followed as far as its paint goes, where its colour is lost before it."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from flightd.core.types import Image
from flightd.vision.lines.band import Band, LinearFit
from flightd.vision.lines.band_ends import lengthen
from flightd.vision.lines.undistortion import Plane

WIDTH, HEIGHT = 640, 360
PLANE = Plane(WIDTH, HEIGHT)
SLOPE = 0.1


def picture(top_px: float, bottom_px: float, *, crossed_at_px: float | None = None) -> Image:
    """A white line, 10 px wide, from one height to the other (centred, + down), on a floor that grows
    brighter upwards."""
    floor = np.linspace(190, 120, HEIGHT).round().astype(np.uint8)
    bgr = np.ascontiguousarray(np.repeat(floor[:, None, None], WIDTH, axis=1).repeat(3, axis=2))
    points = [(round((WIDTH - 1) / 2 + SLOPE * y), round((HEIGHT - 1) / 2 + y)) for y in (top_px, bottom_px)]
    if crossed_at_px is not None:
        y = round((HEIGHT - 1) / 2 + crossed_at_px)
        cv2.line(bgr, (0, y), (WIDTH - 1, y), (235, 235, 235), 12)
    cv2.line(bgr, points[0], points[1], (235, 235, 235), 10, cv2.LINE_AA)
    return bgr


def band(u0: float, u1: float) -> Band:
    """The part of it that its colour showed."""
    half = 5.0 * (1 + SLOPE**2) ** 0.5
    centre, low, high = (LinearFit(by, SLOPE) for by in (0.0, -half, half))
    return Band(True, centre, low, high, u0, u1, 0.9, 0.8)


def test_it_goes_on_to_the_border_where_only_its_colour_ended() -> None:
    (found,) = lengthen(picture(-200.0, 100.0), [band(-60.0, 100.0)], PLANE)
    assert found.u0 == pytest.approx(-HEIGHT / 2)
    assert found.u1 == pytest.approx(100.0, abs=9.0)
    assert found.support > 0.9


@pytest.mark.parametrize("end_px", [-60.0, -110.0])
def test_it_ends_where_the_paint_ends(end_px: float) -> None:
    (found,) = lengthen(picture(end_px, 200.0), [band(-60.0, 100.0)], PLANE)
    assert found.u0 == pytest.approx(end_px, abs=9.0)
    assert found.u1 == pytest.approx(HEIGHT / 2)


def test_a_crossing_line_does_not_end_it_and_none_is_made_longer_by_one() -> None:
    (on,) = lengthen(picture(-200.0, 100.0, crossed_at_px=-100.0), [band(-60.0, 100.0)], PLANE)
    assert on.u0 == pytest.approx(-HEIGHT / 2)
    (ended,) = lengthen(picture(-60.0, 100.0, crossed_at_px=-100.0), [band(-60.0, 100.0)], PLANE)
    assert ended.u0 == pytest.approx(-60.0, abs=9.0)


def test_one_that_the_border_cuts_at_both_ends_is_left_alone() -> None:
    whole = band(-178.0, 178.0)
    assert lengthen(picture(-200.0, 200.0), [whole], PLANE) == [whole]
