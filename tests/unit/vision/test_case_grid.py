"""Cases counted in drawn fronts: cartons with dark joints on a pallet, as an opening's raster shows them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.core.inventory import CaseGrid
from flightd.core.types import Image
from flightd.vision.shelf.case_grid import case_grid
from flightd.vision.shelf.opening_raster import BELOW_M, COLUMN_M, ROW_M

WIDTH_M, HIGH_M, PALLET_M = 0.60, 0.52, 0.10
WHITE, CARTON, WOOD, DARK = 226.0, (92, 138, 178), (96, 140, 172), (14, 14, 15)
INK, PAPER, TAPE = (52, 79, 101), (222, 224, 226), (110, 150, 185)


@dataclass(frozen=True, slots=True)
class Front:
    """Rows of cartons from the highest down, by how many stand in each, and what part of the load's height
    each takes; the joints are so wide."""

    rows: tuple[int, ...]
    parts: tuple[float, ...] = ()
    joint_px: int = 2
    tape: bool = False
    text: bool = False

    def raster(self) -> Image:
        """(rows, columns, 3), the lowest row first."""
        columns, below = round(WIDTH_M / ROW_M), round(BELOW_M / ROW_M)
        square = np.full((below + round((HIGH_M + 0.05) / ROW_M), columns, 3), DARK, np.uint8)
        square[:below] = (28, 84, 205)
        pallet, high = below + round(PALLET_M / ROW_M), below + round(HIGH_M / ROW_M)
        square[below : below + 8] = square[pallet - 8 : pallet] = WOOD
        for left in (0, columns // 2 - 20, columns - 40):
            square[below:pallet, left : left + 40] = WOOD
        ends = np.cumsum([0.0, *(self.parts or [1.0] * len(self.rows))])
        edges = np.round(high - ends / ends[-1] * (high - pallet)).astype(int)
        for upper, lower, count in zip(edges, edges[1:], self.rows, strict=False):
            cuts = np.round(np.linspace(0, columns, count + 1)).astype(int)
            for left, right in itertools.pairwise(cuts.tolist()):
                self._carton(square[lower:upper, left : right - self.joint_px])
            square[lower : lower + self.joint_px] = DARK
        noise = np.random.default_rng(3).normal(0.0, 2.0, square.shape)
        grain = np.random.default_rng(4).normal(1.0, 0.03, (*square.shape[:2], 1))
        return np.clip(square * grain + noise, 0, 255).astype(np.uint8)

    def _carton(self, area: Image) -> None:
        area[:] = CARTON
        height, width = area.shape[:2]
        if self.text:
            area[6:16, 8 : width - 12 : 3] = INK
        if self.tape:
            area[height // 2 - 9 : height // 2 + 9] = TAPE
            area[height // 2] = np.array(TAPE) * 0.85


def counted(raster: Image, codes_m: Sequence[tuple[float, float, float, float]] = ()) -> CaseGrid | None:
    tops_m = np.full(round(WIDTH_M / COLUMN_M), HIGH_M, np.float32)
    return case_grid(raster, WHITE, tops_m, 0, codes_m)


REGULAR = Front((3, 3))


@pytest.mark.parametrize("columns", [2, 3, 4, 5])
@pytest.mark.parametrize("rows", [2, 3])
def test_a_regular_stack_is_counted_and_its_pallet_is_no_row(columns: int, rows: int) -> None:
    assert counted(Front((columns,) * rows).raster()) == CaseGrid(columns, rows)


@pytest.mark.parametrize("joint_px", [1, 2, 5])
@pytest.mark.parametrize("text", [True, False])
def test_print_and_wide_or_narrow_joints_change_nothing(joint_px: int, text: bool) -> None:
    assert counted(replace(REGULAR, joint_px=joint_px, text=text).raster()) == CaseGrid(3, 2)


def test_a_slit_under_tape_all_across_is_no_joint() -> None:
    assert counted(replace(REGULAR, tape=True).raster()) is None
    assert counted(Front((3,), tape=True).raster()) is None


@pytest.mark.parametrize(
    "front",
    [
        Front((3, 2)),
        Front((2, 4)),
        Front((3, 4, 3)),
        Front((2, 2, 2), (1.0, 0.6, 1.0)),
        Front((2, 2), (1.0, 0.6)),
        Front((1,)),
        Front((1, 1, 1)),
        Front((3,)),
    ],
)
def test_what_is_no_plain_grid_is_not_counted(front: Front) -> None:
    assert counted(front.raster()) is None


def test_a_row_that_is_not_full_is_not_counted() -> None:
    raster = REGULAR.raster()
    middle = round((BELOW_M + PALLET_M + (HIGH_M - PALLET_M) / 2) / ROW_M)
    raster[middle:, 160:] = DARK
    tops_m = np.where(np.arange(60) < 40, HIGH_M, 0.31).astype(np.float32)
    assert case_grid(raster, WHITE, tops_m, 0) is None


def test_ribs_of_crates_are_no_joints() -> None:
    raster = Front((1, 1)).raster()
    for rib in np.linspace(4, raster.shape[1] - 5, 7).astype(int):
        raster[80:, rib - 2 : rib + 2] = np.minimum(raster[80:, rib - 2 : rib + 2] * 1.14, 255)
    assert counted(raster) is None


def test_a_joint_under_a_label_is_taken_from_the_other_rows() -> None:
    raster = Front((3, 3, 3)).raster()
    low, high, left, right = 136, 176, 60, 100
    raster[low:high, left:right] = PAPER
    code = (left * ROW_M + 0.01, low * ROW_M - BELOW_M, right * ROW_M - 0.01, high * ROW_M - BELOW_M)
    assert counted(raster, [code]) == CaseGrid(3, 3)


def test_a_row_of_which_a_label_hides_every_joint_is_not_taken_to_be_like_the_others() -> None:
    raster = Front((2, 3, 2)).raster()
    low, high, left, right = 136, 176, 60, 180
    raster[low:high, left:right] = PAPER
    code = (left * ROW_M + 0.01, low * ROW_M - BELOW_M, right * ROW_M - 0.01, high * ROW_M - BELOW_M)
    assert counted(raster, [code]) is None


def test_one_more_joint_that_is_hardly_seen_leaves_it_untold() -> None:
    raster = Front((2, 2)).raster()
    for at in (60, 180):
        raster[72:, at : at + 2] = raster[72:, at : at + 2] * 0.88
    assert counted(raster) is None


def test_dark_goods_and_stacks_beside_each_other_are_not_counted() -> None:
    raster = REGULAR.raster()
    assert counted((raster * 0.3).astype(np.uint8)) is None
    tops_m = np.full(60, HIGH_M, np.float32)
    tops_m[40:] = 0.3
    assert case_grid(raster, WHITE, tops_m, 0) is None


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.0, 0.6), st.integers(1, 90), st.floats(1.0, 300.0))
def test_whatever_a_raster_shows_a_grid_or_nothing_is_told(
    seed: int, high_m: float, columns: int, white: float
) -> None:
    rng = np.random.default_rng(seed)
    coarse = rng.integers(0, 256, (16, 24, 3), np.uint8)
    raster = np.asarray(cv2.resize(coarse, (240, 230), interpolation=cv2.INTER_NEAREST), np.uint8)
    tops_m = np.full(columns, high_m, np.float32)
    grid = case_grid(raster, white, tops_m, int(rng.integers(0, 6)), [(0.1, 0.1, 0.2, 0.2)])
    assert grid is None or grid.count > 1
