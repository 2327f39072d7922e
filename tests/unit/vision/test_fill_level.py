"""How full a place is, told of drawn openings: boxes on a lit deck before the dark of the rack."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from flightd.core.scanning import PlaceOpening
from flightd.core.types import Image
from flightd.vision.shelf.fill_level import OpeningLook, fill_level

WIDTH_M, HEIGHT_M, BACK_M = 0.65, 0.6, 0.9
EYE_M = (0.2, 0.28, 1.2)
FOCAL_PX, SIZE_PX = 900.0, (1280, 800)
WHITE, BEAM, DECK = 226, (28, 84, 205), (70, 84, 92)
FRONT, SIDE, BACK, DARK = (92, 138, 178), (40, 62, 84), (44, 46, 48), (12, 12, 13)
TOP = (64, 96, 122)
Colour = tuple[int, int, int]
Box = tuple[float, float, float, float]
"""Left and right end from the opening's middle, height, and depth behind the rack's face; metres."""


def project(points_m: Sequence[tuple[float, float, float]]) -> NDArray[np.float64]:
    """Centred pixels of points (right, above the deck, behind the face)."""
    right, above, before = EYE_M
    return np.array(
        [
            ((x - right) / (before + depth) * FOCAL_PX, (above + 0.02 - z) / (before + depth) * FOCAL_PX)
            for x, z, depth in points_m
        ]
    )


class Shelf:
    """A picture that is drawn from behind to before."""

    def __init__(self) -> None:
        self.picture = np.full((SIZE_PX[1], SIZE_PX[0], 3), 15, np.uint8)
        self._grain = np.random.default_rng(1).normal(1.0, 0.05, (SIZE_PX[1], SIZE_PX[0], 1))
        half_m = WIDTH_M / 2
        for row in range(12):  # something to see at the back
            z = row * 0.05
            ends = [(x, z + up, BACK_M) for x, up in ((-1, 0.0), (1, 0.0), (1, 0.02), (-1, 0.02))]
            self.area(ends, BACK)
        self.area([(-1, 0, 0), (1, 0, 0), (1, 0, 0.4), (-1, 0, 0.4)], DECK)
        self.beam = [(-half_m, -0.1, 0), (half_m, -0.1, 0), (half_m, 0, 0), (-half_m, 0, 0)]
        self.area(self.beam, BEAM)

    def area(
        self, corners_m: Sequence[tuple[float, float, float]], colour: Colour, grained: bool = False
    ) -> None:
        centre = (np.array(SIZE_PX) - 1) / 2
        mask = np.zeros(self.picture.shape[:2], np.uint8)
        cv2.fillConvexPoly(mask, np.round(project(corners_m) + centre).astype(np.int32), 1)
        tone = np.array(colour) * (self._grain if grained else 1.0) * np.ones_like(self.picture)
        self.picture[mask > 0] = np.clip(tone, 0, 255).astype(np.uint8)[mask > 0]

    def box(self, box: Box, colour: Colour = FRONT) -> None:
        left, right, high, depth = box
        back = max(depth, 0.0) + 0.4
        for x in (left, right):
            self.area([(x, 0, depth), (x, 0, back), (x, high, back), (x, high, depth)], SIDE)
        if high < EYE_M[1]:
            self.area(
                [(left, high, depth), (right, high, depth), (right, high, back), (left, high, back)], TOP
            )
        front = [(left, 0, depth), (right, 0, depth), (right, high, depth), (left, high, depth)]
        self.area(front, colour, grained=True)

    def leaning(self, box: Box, lean_m: float) -> None:
        """A front whose top is so far to the right of its foot, before the dark."""
        left, right, high, depth = box
        top = [(right + lean_m, high, depth), (left + lean_m, high, depth)]
        self.area([(left, 0, depth), (right, 0, depth), *top], FRONT, grained=True)

    def opening(self) -> PlaceOpening:
        half_m = WIDTH_M / 2
        corners = project([(-half_m, HEIGHT_M, 0), (half_m, HEIGHT_M, 0), (half_m, 0, 0), (-half_m, 0, 0)])
        front = tuple((float(x), float(y)) for x, y in corners)
        return PlaceOpening(front, WIDTH_M, HEIGHT_M, EYE_M, (False, False))


def seen(
    shelf: Shelf, *, white: float = WHITE, codes: Sequence[tuple[float, ...]] = (), width_px: int = SIZE_PX[0]
) -> OpeningLook:
    """What the middle of the picture tells, so wide."""
    noisy = shelf.picture + np.random.default_rng(2).normal(0.0, 2.0, shelf.picture.shape)
    aside = (SIZE_PX[0] - width_px) // 2
    picture: Image = np.clip(noisy, 0, 255).astype(np.uint8)[:, aside : SIZE_PX[0] - aside]
    return fill_level(picture, shelf.opening(), white, [(a, b, c, d) for a, b, c, d in codes])


def told(
    *boxes: Box, colour: Colour = FRONT, white: float = WHITE, codes: Sequence[tuple[float, ...]] = ()
) -> tuple[float | None, float | None]:
    shelf = Shelf()
    for box in boxes:
        shelf.box(box, colour)
    fill = seen(shelf, white=white, codes=codes).fill
    return fill.share, fill.overhang_m


def share_of(*boxes: Box) -> float:
    return sum((right - left) * high for left, right, high, _ in boxes) / (WIDTH_M * HEIGHT_M)


@pytest.mark.parametrize(
    "boxes",
    [
        ((-0.3, 0.3, 0.5, 0.0),),
        ((-0.3, -0.05, 0.4, 0.02),),
        ((-0.3, -0.1, 0.2, 0.0), (0.05, 0.3, 0.55, 0.0)),
        ((-0.25, 0.1, 0.12, 0.0),),
    ],
)
def test_the_share_is_that_of_the_fronts_and_not_of_sides_and_tops(boxes: tuple[Box, ...]) -> None:
    share, _ = told(*boxes)
    assert share == pytest.approx(share_of(*boxes), abs=0.05)


def test_the_top_of_low_goods_counts_for_nothing() -> None:
    low = (-0.3, 0.3, 0.1, 0.0)
    assert told(low)[0] == pytest.approx(share_of(low), abs=0.03)


def test_goods_that_stand_deep_in_the_rack_are_told_in_their_true_size() -> None:
    deep = (-0.3, 0.2, 0.45, 0.3)
    share, overhang_m = told(deep)
    assert share == pytest.approx(share_of(deep), abs=0.06)
    assert overhang_m is None


def test_goods_that_stand_out_are_told_in_their_true_size_with_how_far() -> None:
    out = (-0.3, 0.0, 0.45, -0.1)
    share, overhang_m = told(out)
    assert share == pytest.approx(share_of(out), abs=0.05)
    assert overhang_m == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize("lean_m", [-0.05, -0.03, 0.0, 0.04])
@pytest.mark.parametrize("depth_m", [0.0, 0.15])
def test_how_far_a_top_is_aside_of_its_foot_is_told_to_a_centimetre(lean_m: float, depth_m: float) -> None:
    shelf = Shelf()
    shelf.leaning((-0.2, 0.12, 0.4, depth_m), lean_m)
    assert seen(shelf).fill.lean_m == pytest.approx(abs(lean_m), abs=0.01)


def test_a_front_whose_edges_do_not_tell_leans_by_nobody_knows_what() -> None:
    shelf = Shelf()
    wider_above = [(-0.2, 0.0, 0.0), (0.1, 0.0, 0.0), (0.14, 0.4, 0.0), (-0.2, 0.4, 0.0)]
    shelf.area(wider_above, FRONT, grained=True)
    assert seen(shelf).fill.lean_m is None
    low = Shelf()
    low.leaning((-0.2, 0.1, 0.1, 0.0), 0.04)
    assert seen(low).fill.lean_m is None


def test_an_empty_place_has_no_share_of_goods() -> None:
    assert told() == (0.0, None)


def test_an_opening_is_clear_where_goods_are_seen_nowhere_between_its_ends() -> None:
    assert seen(Shelf()).is_clear
    for box in ((-0.31, -0.2, 0.3, 0.0), (0.2, 0.31, 0.12, 0.03)):
        shelf = Shelf()
        shelf.box(box)
        assert not seen(shelf).is_clear
    shelf = Shelf()
    shelf.box((-0.3, -0.15, 0.3, 0.0), DARK)
    assert not seen(shelf).is_clear


def test_an_opening_is_not_clear_where_the_picture_cuts_it_off() -> None:
    assert seen(Shelf(), width_px=840).is_clear
    assert not seen(Shelf(), width_px=780).is_clear


def test_the_hall_past_the_end_of_a_rack_is_no_goods_in_it() -> None:
    shelf = Shelf()
    end_m = -WIDTH_M / 2
    hall = [(end_m, 0.0, 0.0), (end_m, 0.0, BACK_M), (end_m, HEIGHT_M, BACK_M), (end_m, HEIGHT_M, 0.0)]
    shelf.area(hall, FRONT, grained=True)
    assert seen(shelf).is_clear
    shelf.box((end_m + 0.03, end_m + 0.15, 0.3, 0.0))
    assert not seen(shelf).is_clear


def test_goods_as_dark_as_the_rack_are_unknown() -> None:
    assert told((-0.3, 0.3, 0.5, 0.0), colour=DARK)[0] is None


BLACK: Colour = (60, 60, 62)


def test_a_black_box_beside_a_white_one_on_a_light_pallet_counts_in_its_whole_height() -> None:
    shelf = Shelf()
    shelf.box((-0.25, 0.2, 0.45, 0.02), BLACK)
    shelf.box((-0.25, 0.2, 0.1, 0.02))
    shelf.box((0.0, 0.2, 0.45, 0.02), (205, 208, 210))
    assert seen(shelf).fill.share == pytest.approx(share_of((-0.25, 0.2, 0.45, 0.0)), abs=0.05)


def test_a_code_above_all_that_was_found_makes_the_share_unknown() -> None:
    low = (-0.3, 0.3, 0.1, 0.0)
    assert told(low)[0] is not None
    assert told(low, codes=[(0.3, 0.3, 0.4, 0.4)])[0] is None


@pytest.mark.parametrize("white", [255.0, float("nan")])
def test_nothing_is_told_where_white_is_not_known(white: float) -> None:
    assert told((-0.3, 0.3, 0.5, 0.0), white=white) == (None, None)


@settings(max_examples=60, deadline=None)
@given(
    st.tuples(st.floats(0.005, 5.0), st.floats(0.1, 5.0)),
    st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.5), st.floats(0.05, 3.0)),
    st.tuples(st.booleans(), st.booleans()),
    st.tuples(st.floats(5.0, 150.0), st.floats(5.0, 110.0)),
    st.integers(0, 9),
)
@example((0.08, 0.6), (0.0, 0.3, 1.2), (True, True), (40.0, 90.0), 1)
def test_an_opening_of_any_size_and_from_anywhere_tells_a_share_or_nothing(
    size_m: tuple[float, float],
    eye_m: tuple[float, float, float],
    posts: tuple[bool, bool],
    half_px: tuple[float, float],
    seed: int,
) -> None:
    coarse = np.random.default_rng(seed).integers(0, 256, (24, 32, 3), np.uint8)
    picture: Image = np.ascontiguousarray(coarse.repeat(10, axis=0).repeat(10, axis=1))
    x, y = half_px
    front = ((-x, -y), (x, -y), (x, y), (-x, y))
    look = fill_level(picture, PlaceOpening(front, *size_m, eye_m, posts), 200.0, [(0.1, 0.1, 0.2, 0.2)])
    assert look.fill.share is None or 0.0 <= look.fill.share <= 1.0
