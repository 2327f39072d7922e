"""What labelled pictures teach: paint, floor, and what is better left untold."""

from __future__ import annotations

import numpy as np
import pytest

from flightd.core.errors import InputError
from flightd.vision.training.colour_training import (
    FLOOR,
    PAINT,
    UNKNOWN,
    collect,
    take_pixels,
    teaching_from_label,
    teaching_from_mask,
    train,
)
from flightd.vision.training.labelled_frames import LabelledImage, LabelledLine, LabelledRegion

SHAPE = (90, 160)
LINE = LabelledLine(x1=0.0, y1=45.0, x2=159.0, y2=45.0, thickness=20.0)


def test_a_mask_teaches_its_black_and_white_only() -> None:
    mask = np.array([[0, 3, 100, 200, 255]], np.uint8)
    assert teaching_from_mask(mask).tolist() == [[FLOOR, FLOOR, UNKNOWN, UNKNOWN, PAINT]]


def test_lines_teach_paint_inside_floor_beside_and_nothing_at_the_edge() -> None:
    teaching = teaching_from_label(LabelledImage(file="a", complete=True, lines=[LINE]), SHAPE)
    column = teaching[:, 80]
    assert (column[41:50] == PAINT).all()
    assert (column[33:38] == UNKNOWN).all()
    assert (column[53:58] == UNKNOWN).all()
    assert (column[:28] == FLOOR).all()
    assert (column[63:] == FLOOR).all()


def test_beside_lines_is_no_floor_where_not_everything_is_labelled() -> None:
    teaching = teaching_from_label(LabelledImage(file="a", complete=False, lines=[LINE]), SHAPE)
    assert set(np.unique(teaching)) == {UNKNOWN, PAINT}


def test_boxes_and_strokes_teach_what_they_cover() -> None:
    regions = [
        LabelledRegion(paint=False, box=(0, 0, 40, 90)),
        LabelledRegion(paint=True, stroke=[(100.0, 10.0), (100.0, 80.0), (140.0, 80.0)], width=10),
    ]
    teaching = teaching_from_label(LabelledImage(file="a", regions=regions), SHAPE)
    assert (teaching[:, :40] == FLOOR).all()
    assert (teaching[20:70, 97:104] == PAINT).all()
    assert (teaching[77:84, 105:138] == PAINT).all()
    assert (teaching[:60, 120:] == UNKNOWN).all()


def test_saturated_floor_teaches_nothing() -> None:
    picture = np.full((*SHAPE, 3), 90, np.uint8)
    picture[:, 80:] = 255
    teaching = np.full(SHAPE, FLOOR, np.uint8)
    teaching[40:50] = PAINT
    colours, paint = take_pixels(picture, teaching, "white", np.random.default_rng(0))
    assert colours[~paint].max() < 200


def test_too_few_pictures_of_paint_are_refused() -> None:
    floor = (np.full((*SHAPE, 3), 90, np.uint8), np.full(SHAPE, FLOOR, np.uint8))
    with pytest.raises(InputError, match="only 0 pictures"):
        collect([floor] * 8, "yellow", 0)


@pytest.mark.parametrize("wrong", [None, 3])
def test_a_picture_whose_floor_runs_over_paint_is_doubtful(wrong: int | None) -> None:
    pytest.importorskip("sklearn", reason="training needs scikit-learn: pip install -e '.[train]'")
    pictures = []
    for number in range(8):
        picture = np.full((*SHAPE, 3), 100 + 5 * number, np.uint8)
        picture[30:60] = (40, 150, 200)
        teaching = np.full(SHAPE, UNKNOWN, np.uint8)
        teaching[35:55, :70] = PAINT
        teaching[35 : 55 if number == wrong else 36, 90:] = FLOOR if number == wrong else UNKNOWN
        teaching[70:80] = FLOOR
        pictures.append((picture, teaching))
    trained = train("hall", "yellow", collect(pictures, "yellow", 0), 0)
    assert trained.doubtful == (() if wrong is None else (wrong,))
