"""What a front camera's frame costs a reader of codes, in units of one BGR-to-HSV conversion of the same
picture.

`pytest -s tests/bench/test_reader_cost.py` prints the milliseconds of one core's time too.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from statistics import median, quantiles

import cv2
import numpy as np
import pytest

from flightd.core.types import Image
from flightd.vision.shelf.code_reader import read_codes
from flightd.vision.shelf.code_regions import CodeSearch
from tools.bench_reader import Shelf, cost, line, shelf_cost, shelves, small


@pytest.fixture(scope="module")
def seen() -> Iterator[list[Shelf]]:
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    yield list(shelves(12, 1))
    cv2.setNumThreads(threads)


@pytest.fixture(scope="module")
def shrunk(seen: list[Shelf]) -> list[Image]:
    return [small(shelf.picture) for shelf in seen]


def test_a_frame_with_places_in_view_costs_some_tens_of_conversions(seen: list[Shelf]) -> None:
    found = shelf_cost(seen)
    print("\n" + line("reader, places in view", found))
    assert median(found.units) < 45


def test_a_small_picture_of_goods_costs_no_more_than_its_first_look(shrunk: list[Image]) -> None:
    found, first = cost(shrunk), cost(shrunk, partial(read_codes, deeper=False))
    print("\n" + line("codes, 640x480", found))
    assert median(found.units) < 60
    assert quantiles(found.units, n=10)[-1] < 3 * median(first.units)


def test_nothing_in_goods_without_labels_looks_like_a_code(shrunk: list[Image]) -> None:
    greys = [np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), np.uint8) for picture in shrunk]
    assert [CodeSearch(grey).regions() for grey in greys] == [[]] * len(greys)
