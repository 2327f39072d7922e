"""A part of a longer code is never told as a short one, however often it is read so; short codes are read.

`FLIGHTD_LABELS=6` looks at so many pictures of each kind.
"""

from __future__ import annotations

import os
from dataclasses import replace

import cv2
import numpy as np
import pytest
import zxingcpp

from flightd.core.types import Image
from flightd.sim.racks.code_symbols import Symbol, Symbology
from flightd.sim.racks.label_paper import stick
from flightd.sim.racks.stock import Condition, Label
from flightd.vision.shelf.code_reader import read_codes
from flightd.vision.shelf.quiet_zones import ends_in_quiet_zones
from tools.bench_damage import told_of
from tools.damaged_labels import Damage, DamagedLabel, Kind, Printed, Seen, upc_a_of

PAPER, INK, CARDBOARD = 232, 28, 145
HALVES = ("4094819312344", "4094864912346", "4026813312341", "1234567890128", "5012345678900")
"""The first three are a UPC-E of number system 1 with a true check digit by their left halves."""
LEFT_HALF = 50
BESIDE = (INK, CARDBOARD, 205, PAPER)
ENDS = ((3, 50.2), (4, 50.8), (4, 52.5))
"""Pixels of a module, and where the half ends, modules."""
LABELS = int(os.environ.get("FLIGHTD_LABELS", "1"))
STRONG = {"EAN-13", "UPC-A", "Code 128", "Code 93", "DataBar"}


def row_of(text: str, kind: str) -> Image:
    """(1, modules) of 0 and 255."""
    code = zxingcpp.create_barcode(text, getattr(zxingcpp.BarcodeFormat, kind))
    return np.array(code.to_image(scale=1, add_quiet_zones=False), np.uint8)[:1]


def half(text: str, px: int, beside: int, end: float = LEFT_HALF) -> Image:
    """The left half of an EAN-13 on white paper; what is right of `end` modules is `beside`, as bright."""
    row = np.repeat(np.where(row_of(text, "EAN13") == 0, INK, PAPER).astype(np.uint8), px, axis=1)
    picture = np.full((300, 117 * px + 200), CARDBOARD, np.uint8)
    picture[70:230, 100:-100] = PAPER
    left = 100 + 11 * px
    picture[90:200, left : left + row.shape[1]] = row
    picture[70:230, left + round(end * px) :] = beside
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), 0.3 * px), np.uint8)


def weak(picture: Image) -> list[str]:
    """What is believed of what no strong checksum vouches for."""
    return [r.symbology for r in read_codes(picture) if r.believed and r.symbology not in STRONG]


@pytest.mark.parametrize("beside", BESIDE)
@pytest.mark.parametrize("text", HALVES)
def test_half_an_ean_13_is_no_upc_e(text: str, beside: int) -> None:
    """Each text with each end, and each end beside each brightness."""
    first = HALVES.index(text) + BESIDE.index(beside)
    for more in range(min(LABELS, len(ENDS))):
        px, end = ENDS[(first + more) % len(ENDS)]
        assert weak(half(text, px, beside, end)) == []


def test_half_an_ean_13_is_a_upc_e_to_a_reader_of_bars_alone() -> None:
    """The other tests mean something."""
    read = zxingcpp.read_barcodes(half("4094864912346", 4, CARDBOARD, 50.8))
    assert [str(code.format) for code in read] == ["UPC-E"]
    system_and_six = read[0].text[1:2]
    assert system_and_six == "1"
    seen = read_codes(half("4094864912346", 4, CARDBOARD, 50.8))
    assert [(code.symbology, code.believed, code.whole) for code in seen] == [("UPC-E", False, False)]


@pytest.mark.parametrize("looks", range(1 + LABELS))
def test_a_label_torn_in_the_simulator_is_read_as_no_other(looks: int) -> None:
    """The simulator's own paper and tear, on fronts from dark film to a white carton."""
    px_per_m = 2000.0
    rng = np.random.default_rng(looks)
    for text, front in zip(HALVES, (90, CARDBOARD, 170, 205, 232), strict=True):
        module_m = float(rng.uniform(2.75, 4.0)) / px_per_m
        turn_rad = float(rng.uniform(-0.2, 0.2))
        label = Label(Symbol(Symbology.EAN_13, text), Condition.TORN, module_m, 0.0, 0.0, turn_rad)
        picture = np.full((400, 640, 3), front, np.uint8)
        stick(picture, label, 320.0, 200.0, px_per_m, looks)
        seen = cv2.GaussianBlur(picture, (0, 0), float(rng.uniform(0.5, 1.6)))
        noisy = np.clip(seen + rng.normal(0, 3, seen.shape), 0, 255).astype(np.uint8)
        assert weak(noisy) == []


@pytest.mark.parametrize("damage", [Damage.TORN, Damage.COVERED, Damage.BLOT, Damage.GLARE, Damage.CUT])
@pytest.mark.parametrize("kind", [Kind.EAN_13, Kind.UPC_A])
def test_no_damage_to_a_long_code_makes_a_short_one(kind: Kind, damage: Damage) -> None:
    for seed in range(LABELS):
        rng = np.random.default_rng([seed, len(damage)])
        label = DamagedLabel.drawn(Printed.drawn(kind, rng), damage, rng)
        assert weak(label.picture(Seen.drawn(rng), rng)) == []


@pytest.mark.parametrize(("damage", "seed"), [(Damage.CUT, 1), (Damage.TORN, 2), (Damage.WORN, 0)])
def test_a_line_that_leaves_tilted_bars_by_their_tips_reads_no_short_itf(damage: Damage, seed: int) -> None:
    """Beyond the tips it meets paper as blank as a quiet zone, in three views alike."""
    order = list(Kind).index(Kind.ITF), list(Damage).index(damage)
    rng = np.random.default_rng([1, *order, seed])
    told = told_of(DamagedLabel.drawn(Printed.drawn(Kind.ITF, rng), damage, rng), rng)
    assert told.wrong == ()


@pytest.mark.parametrize("px", [2.75, 3.3, 4.0])
@pytest.mark.parametrize("kind", [Kind.UPC_E, Kind.EAN_8, Kind.ITF, Kind.CODE_39, Kind.CODABAR])
def test_a_short_code_with_its_quiet_zones_is_read(kind: Kind, px: float) -> None:
    for seed in range(3):
        rng = np.random.default_rng([seed, round(100 * px)])
        label = DamagedLabel.drawn(Printed.drawn(kind, rng), Damage.NONE, rng)
        seen = replace(
            Seen.drawn(rng), px=px, blur=0.4, turn_rad=0.04 * (seed - 1), aside_rad=0.3 * (seed - 1)
        )
        picture = label.picture(seen, rng)
        turned = np.asarray(np.rot90(picture, seed), np.uint8)
        assert [r.text for r in read_codes(turned) if r.believed] == [label.printed.text]


def upc_e(
    beside: int, modules: float, blank: int = PAPER
) -> tuple[Image, np.ndarray[tuple[int, ...], np.dtype[np.float64]]]:
    """A UPC-E of 4 px a module with `blank` on its right, and a bar of `beside` so many modules behind it."""
    row = np.repeat(np.where(row_of("01234565", "UPCE") == 0, INK, PAPER).astype(np.uint8), 4, axis=1)
    picture = np.full((160, 204 + 160), PAPER, np.uint8)
    picture[30:130, 80:284] = row
    picture[:, 284:] = blank
    at = 284 + round(4 * modules)
    picture[30:130, at : at + 4] = beside
    corners = np.array([(80.0, 40.0), (284.0, 40.0), (284.0, 120.0), (80.0, 120.0)])
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), 1.5), np.uint8), corners


def test_a_quiet_zone_is_blank_paper_as_wide_as_the_symbology_wants() -> None:
    def whole(beside: int, modules: float, blank: int = PAPER) -> bool:
        return ends_in_quiet_zones(*upc_e(beside, modules, blank), "UPC-E")

    assert whole(PAPER, 2)
    assert whole(INK, 7)
    assert not whole(INK, 1)
    assert not whole(INK, 4), "no space of an EAN-13 is wider"
    assert not whole(CARDBOARD, 2, CARDBOARD), "nothing beside it, and no paper either"
    assert whole(245, 2, 245), "a lamp's image makes paper brighter"


def test_what_the_picture_does_not_show_is_not_blank() -> None:
    picture, corners = upc_e(PAPER, 2)
    assert not ends_in_quiet_zones(np.ascontiguousarray(picture[:, :300]), corners, "UPC-E")
    nowhere = np.zeros((4, 2))
    assert not ends_in_quiet_zones(picture, nowhere, "UPC-E")
    assert not ends_in_quiet_zones(np.full_like(picture, PAPER), corners, "ITF")


def test_the_larger_zone_is_on_the_codes_own_left() -> None:
    picture, corners = upc_e(INK, 7)
    assert ends_in_quiet_zones(picture, corners, "UPC-E")
    turned = np.ascontiguousarray(np.rot90(picture, 2))
    height, width = picture.shape
    back = np.array([width - 1.0, height - 1.0]) - corners
    assert ends_in_quiet_zones(turned, back, "UPC-E")
    mirrored = np.ascontiguousarray(picture[:, ::-1])
    others = np.array([(width - 1 - x, y) for x, y in corners])[[1, 0, 3, 2]]
    assert not ends_in_quiet_zones(mirrored, others, "UPC-E"), "9 modules are wanted on the left"


def test_the_check_digit_of_a_upc_e_is_that_of_what_it_abbreviates() -> None:
    assert upc_a_of("0123456") == "012345000065"
