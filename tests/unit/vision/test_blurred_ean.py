"""EAN-13 codes beyond what edges tell: read through blur, perspective and uneven light, and never wrongly."""

from __future__ import annotations

import itertools

import cv2
import numpy as np
import pytest
import zxingcpp
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from flightd.core.geometry import Matrix
from flightd.core.types import Image
from flightd.vision.shelf.blurred_ean import BlurredRead, read_blurred_ean
from flightd.vision.shelf.code_reader import read_codes
from flightd.vision.shelf.ean_symbol import LEFT_DIGITS, check_digit, likeliest_text, symbol_modules

FINE = 8
"""Pixels of a module before the picture is taken."""


def digits(rng: np.random.Generator) -> str:
    first = "".join(map(str, rng.integers(0, 10, 12)))
    return first + check_digit(first)


def bars(text: str) -> Image:
    quiet = np.zeros(11)
    row = np.repeat(np.concatenate([quiet, symbol_modules(text), quiet]), FINE)
    return np.tile((255 - 235 * row).astype(np.uint8), (60 * FINE, 1))


def photograph(drawn: Image, rng: np.random.Generator, *, module_px: float, blur: float) -> Image:
    """Tilted, blurred by so many modules, in uneven light, with noise."""
    wide = drawn.shape[1] * module_px / FINE
    width, height = int(wide) + 80, int(wide / 2) + 60
    corners = np.array([(40, 30), (width - 40, 30), (width - 40, height - 30), (40, height - 30)])
    corners = corners + rng.normal(0.0, 0.015 * width, (4, 2))
    size = drawn.shape[1], drawn.shape[0]
    flat = np.array([(0, 0), (size[0], 0), size, (0, size[1])])
    tilted = cv2.getPerspectiveTransform(flat.astype(np.float32), (2 * corners).astype(np.float32))
    large = cv2.warpPerspective(drawn, tilted, (2 * width, 2 * height), borderValue=90)
    soft = cv2.GaussianBlur(large, (0, 0), 2 * blur * module_px)
    seen = cv2.resize(soft, (width, height), interpolation=cv2.INTER_AREA).astype(np.float64)
    light = 0.6 + 0.1 * np.linspace(-1.0, 1.0, width)
    return np.clip(40 + seen * light + rng.normal(0.0, 1.5, seen.shape), 0, 255).astype(np.uint8)


def test_what_no_edge_tells_is_read_in_its_place() -> None:
    rng = np.random.default_rng(3)
    for text in ("4006381333931", "0036000291452", digits(rng)):
        picture = photograph(bars(text), rng, module_px=2.4, blur=1.05)
        assert zxingcpp.read_barcodes(picture) == []
        (read,) = read_codes(picture)
        printed = ("UPC-A", text[1:]) if text[0] == "0" else ("EAN-13", text)
        assert (read.symbology, read.text) == printed
        assert read.believed
        assert not read.sure, "one picture of a blurred code is no proof yet"
        x, y = np.mean(read.corners_px, axis=0)
        assert abs(x) < 15
        assert abs(y) < 25


def read_anyhow(drawn: Image, rng: np.random.Generator, blur: float) -> BlurredRead | None:
    return read_blurred_ean(photograph(drawn, rng, module_px=rng.uniform(1.3, 3.0), blur=blur))


def test_whatever_the_blur_it_says_the_right_thing_or_nothing() -> None:
    rng, told = np.random.default_rng(5), 0
    for blur in np.linspace(0.5, 2.5, 12):
        text = digits(rng)
        read = read_anyhow(bars(text), rng, float(blur))
        assert read is None or read.text == text
        told += read is not None
    assert told >= 4


@pytest.mark.parametrize(
    ("kind", "text"), [("Code128", "PALLET-0042"), ("ITF", "30885909173820"), ("EAN8", "96385074")]
)
def test_another_kind_of_code_is_not_taken_for_one(kind: str, text: str) -> None:
    made = np.asarray(
        zxingcpp.create_barcode(text, getattr(zxingcpp.BarcodeFormat, kind)).to_image(scale=FINE)
    )
    drawn = np.tile(np.pad(made[made.shape[0] // 3], 11 * FINE, constant_values=255), (400, 1)).astype(
        np.uint8
    )
    rng = np.random.default_rng(7)
    assert all(read_anyhow(drawn, rng, blur) is None for blur in (0.4, 1.0, 1.6))


def test_a_symbol_half_covered_is_not_guessed() -> None:
    drawn = bars("4006381333931")
    drawn[:, drawn.shape[1] // 2 : -11 * FINE] = 120
    rng = np.random.default_rng(9)
    assert all(read_anyhow(drawn, rng, blur) is None for blur in (0.5, 1.0))


COSTS = arrays(np.float64, (12, 20), elements=st.floats(0.0, 1.0))


@given(COSTS)
def test_the_likeliest_text_is_valid_and_no_other_valid_one_costs_less(costs: Matrix) -> None:
    left, right = costs[:6], costs[6:, :10]
    ranked = likeliest_text(left, right)
    assert check_digit(ranked.text[:12]) == ranked.text[12]
    best = cost_of(ranked.text, left, right)
    assert ranked.forced == pytest.approx(best - left.min(axis=1).sum() - right.min(axis=1).sum(), abs=1e-9)
    for place, other in itertools.product(range(11), range(10)):
        digits = list(ranked.text[:12])
        digits[place] = str(other)
        text = "".join(digits) + check_digit("".join(digits))
        if text != ranked.text:
            assert cost_of(text, left, right) >= best + ranked.margin - 1e-9


def cost_of(text: str, left: Matrix, right: Matrix) -> float:
    modules = symbol_modules(text)
    cost = 0.0
    for place in range(6):
        drawn = modules[3 + 7 * place : 10 + 7 * place]
        (kind,) = np.flatnonzero((drawn == LEFT_DIGITS).all(axis=1))
        cost += float(left[place][kind])
    return cost + sum(float(right[place][int(text[7 + place])]) for place in range(6))
