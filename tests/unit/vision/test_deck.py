"""The lit strip that tells an empty place: as high as the deck is deep, higher than what goods stand on."""

from __future__ import annotations

import numpy as np
import pytest

from flightd.core.scanning import Quad
from flightd.vision.shelf.empty_deck import is_seen

WIDTH, HEIGHT = 640, 720
NEAR = 606
"""Row in which the front's edge is expected."""
CORE_PX = 216


def shown(strip_px: int, expected_px: float, off_px: int = 0) -> bool:
    """What is said of a strip so high, its lower end so far below the front's edge."""
    picture = np.full((HEIGHT, WIDTH, 3), 18, np.uint8)
    near = NEAR + off_px
    picture[near - strip_px : near, :] = 94
    core = picture[NEAR - 40 - CORE_PX : NEAR - 40, 150:450]
    middle = np.array([WIDTH, HEIGHT]) / 2 - 0.5
    corners = np.array([(180, NEAR - expected_px), (420, NEAR - expected_px), (430, NEAR), (170, NEAR)])
    deck: Quad = tuple((float(x), float(y)) for x, y in corners - middle)
    return is_seen(picture, deck, core, 224.0)


def test_a_deck_is_seen_as_deep_as_is_looked_or_deeper() -> None:
    assert shown(60, 56.0)
    assert shown(80, 60.0)
    assert not shown(50, 60.0)


@pytest.mark.parametrize("expected_px", [25.0, 32.0, 36.0, 40.0, 60.0])
def test_a_light_foot_below_dark_goods_is_no_deck(expected_px: float) -> None:
    assert not shown(36, expected_px)


def test_a_strip_elsewhere_is_no_deck_and_one_seen_too_flat_tells_nothing() -> None:
    assert shown(60, 56.0, off_px=30)
    assert not shown(60, 56.0, off_px=60)
    assert not shown(60, 15.0)
