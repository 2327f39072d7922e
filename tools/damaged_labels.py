"""Labels with linear codes of which a part is damaged, drawn as a camera sees them from several places."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
import zxingcpp

from flightd.core.geometry import Matrix
from flightd.core.types import Image
from flightd.vision.shelf.gs1 import check_digit

_PAPER, _INK = 232, 28
_MODULE_PX: Final = 5
"""Of the label as it is drawn; it is seen smaller."""
_BARS: Final = 30
_QUIET: Final = 11
_TEXT: Final = 11
"""Modules: height of the bars, blank paper on all sides, the line of text below."""
_FRONTS: Final = (60, 120, 145, 170, 205, 232)
"""Grey levels of what a label is stuck on: dark film, cardboard, a white carton."""
_SIZE_PX: Final = (860, 360)


class Damage(enum.StrEnum):
    """What has happened to a label."""

    NONE = "none"
    TORN = "an end torn off"
    COVERED = "an end covered"
    WORN = "bars worn off at an end"
    BLOT = "a blot in the bars"
    GLARE = "a lamp in the bars"
    CUT = "cut off by the picture's edge"


class Kind(enum.StrEnum):
    """What is printed; the values are the reader's names."""

    EAN_13 = "EAN-13"
    UPC_A = "UPC-A"
    EAN_8 = "EAN-8"
    UPC_E = "UPC-E"
    ITF = "ITF"
    CODE_39 = "Code 39"
    CODABAR = "Codabar"
    CODE_93 = "Code 93"
    CODE_128 = "Code 128"
    DATABAR = "DataBar"


_FORMATS: Final = {
    Kind.EAN_13: zxingcpp.BarcodeFormat.EAN13,
    Kind.UPC_A: zxingcpp.BarcodeFormat.UPCA,
    Kind.EAN_8: zxingcpp.BarcodeFormat.EAN8,
    Kind.UPC_E: zxingcpp.BarcodeFormat.UPCE,
    Kind.ITF: zxingcpp.BarcodeFormat.ITF,
    Kind.CODE_39: zxingcpp.BarcodeFormat.Code39,
    Kind.CODABAR: zxingcpp.BarcodeFormat.Codabar,
    Kind.CODE_93: zxingcpp.BarcodeFormat.Code93,
    Kind.CODE_128: zxingcpp.BarcodeFormat.Code128,
    Kind.DATABAR: zxingcpp.BarcodeFormat.DataBarOmni,
}


@dataclass(frozen=True, slots=True)
class Printed:
    """A label: what is printed, and `text` as a reader tells it."""

    kind: Kind
    content: str
    text: str

    @classmethod
    def drawn(cls, kind: Kind, rng: np.random.Generator) -> Printed:
        """Any text of a kind."""

        def digits(count: int) -> str:
            return "".join(str(digit) for digit in rng.integers(0, 10, count))

        def checked(count: int) -> str:
            first = digits(count - 1)
            return f"{first}{check_digit(first)}"

        if kind is Kind.EAN_13:
            first = str(rng.integers(1, 10)) + digits(11)
            content = f"{first}{check_digit(first)}"
        elif kind in {Kind.UPC_A, Kind.EAN_8}:
            content = checked(12 if kind is Kind.UPC_A else 8)
        elif kind is Kind.UPC_E:
            # what the last digit abbreviates must not be written shorter by another
            six = "".join(str(digit) for digit in rng.integers(3, 10, 5)) + digits(1)
            whole = upc_a_of("0" + six)
            return cls(kind, f"0{six}{whole[-1]}", whole)
        elif kind is Kind.ITF:
            content = checked(14) if rng.random() < 0.5 else digits(2 * int(rng.integers(3, 7)))
        elif kind is Kind.DATABAR:
            content = checked(14)
            return cls(kind, content, f"01{content}")
        elif kind is Kind.CODABAR:
            content = f"A{digits(int(rng.integers(5, 10)))}B"
        else:
            content = "P" + digits(int(rng.integers(5, 10)))
        return cls(kind, content, content)


def upc_a_of(seven: str) -> str:
    """The 12 digits that a UPC-E abbreviates, for its number system and six digits.  Source: GS1 General
    Specifications, 5.2 (zero suppression)."""
    system, a, b, c, d, e, last = list(seven)
    body = {
        "0": f"{a}{b}{last}0000{c}{d}{e}",
        "1": f"{a}{b}{last}0000{c}{d}{e}",
        "2": f"{a}{b}{last}0000{c}{d}{e}",
        "3": f"{a}{b}{c}00000{d}{e}",
        "4": f"{a}{b}{c}{d}00000{e}",
    }.get(last, f"{a}{b}{c}{d}{e}0000{last}")
    return f"{system}{body}{check_digit(system + body)}"


@dataclass(frozen=True, slots=True)
class Seen:
    """How a label is seen: pixels for each module, turned in the picture by `turn_rad` and about its upright
    by `aside_rad`, the blur's sigma in modules, the light on it, the noise's in grey levels."""

    px: float
    turn_rad: float
    aside_rad: float
    blur: float
    light: float
    noise: float

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Seen:
        """What a pass may see."""
        return cls(
            px=float(rng.uniform(2.75, 4.0)),
            turn_rad=math.radians(float(rng.normal(0.0, 4.0))),
            aside_rad=math.radians(float(rng.uniform(-25.0, 25.0))),
            blur=float(rng.uniform(0.15, 0.5)),
            light=float(rng.uniform(0.5, 1.1)),
            noise=float(rng.uniform(1.0, 5.0)),
        )

    def again(self, rng: np.random.Generator) -> Seen:
        """The same label under the same light from another place."""
        return Seen(
            px=self.px * float(rng.uniform(0.97, 1.03)),
            turn_rad=self.turn_rad + float(rng.normal(0.0, 0.015)),
            aside_rad=self.aside_rad + float(rng.normal(0.0, 0.12)),
            blur=self.blur * float(rng.uniform(0.8, 1.25)),
            light=self.light,
            noise=self.noise,
        )


@dataclass(frozen=True, slots=True)
class DamagedLabel:
    """One label before its goods, drawn once; `share` is the part of its bars that is damaged."""

    printed: Printed
    damage: Damage
    share: float
    drawing: Image

    @classmethod
    def drawn(cls, printed: Printed, damage: Damage, rng: np.random.Generator) -> DamagedLabel:
        """Damage of any size that is more than any quiet zone."""
        share = float(rng.uniform(0.08, 0.7))
        front = int(rng.choice(_FRONTS))
        paper = _paper(printed)
        flipped = bool(rng.random() < 0.5)
        hurt = _hurt(paper[:, ::-1] if flipped else paper, damage, share, front, rng)
        drawing = hurt[:, ::-1] if flipped else hurt
        margin = 24 * _MODULE_PX
        around = np.pad(drawing, margin, constant_values=front)
        return cls(printed, damage, share if not flipped else -share, np.ascontiguousarray(around))

    def picture(self, seen: Seen, rng: np.random.Generator) -> Image:
        """(H, W) grey: one view."""
        height, width = self.drawing.shape
        scale = seen.px / _MODULE_PX
        blurred = cv2.GaussianBlur(self.drawing, (0, 0), max(seen.blur * _MODULE_PX, 0.5 / scale))
        c, s = math.cos(seen.turn_rad), math.sin(seen.turn_rad)
        turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        aside = np.diag([math.cos(seen.aside_rad), 1.0, 1.0])
        aside[2, 0] = math.sin(seen.aside_rad) * _MODULE_PX / 2000.0 / seen.px
        middle = np.array([[1.0, 0.0, -(width - 1) / 2], [0.0, 1.0, -(height - 1) / 2], [0.0, 0.0, 1.0]])
        place = np.array([[scale, 0.0, self._at_px(seen)], [0.0, scale, _SIZE_PX[1] / 2], [0.0, 0.0, 1.0]])
        front = int(self.drawing[0, 0])
        view = cv2.warpPerspective(blurred, place @ turned @ aside @ middle, _SIZE_PX, borderValue=front)
        lit = view.astype(np.float64) * seen.light + rng.normal(0.0, seen.noise, view.shape)
        if self.damage is Damage.GLARE:
            lit += self._lamp(seen)
        return np.asarray(np.clip(lit, 0, 255), np.uint8)

    @property
    def _bars_px(self) -> float:
        return float(self.drawing.shape[1]) - 2.0 * (24 + _QUIET) * _MODULE_PX

    def _at_px(self, seen: Seen) -> float:
        """Where in the picture the label's middle is."""
        if self.damage is not Damage.CUT:
            return _SIZE_PX[0] / 2
        inside = (0.5 - abs(self.share)) * self._bars_px * seen.px / _MODULE_PX * math.cos(seen.aside_rad)
        return inside if self.share > 0 else _SIZE_PX[0] - inside

    def _lamp(self, seen: Seen) -> Matrix:
        """(H, W) grey levels of a lamp's image over a part of the bars, brighter than the camera can show."""
        bars_px, part = self._bars_px * seen.px / _MODULE_PX, abs(self.share)
        at = _SIZE_PX[0] / 2 - math.copysign((0.5 - part / 2) * bars_px, self.share)
        y, x = np.mgrid[: _SIZE_PX[1], : _SIZE_PX[0]].astype(np.float64)
        away = np.abs((x - at) / (part * bars_px / 2)) ** 6 + np.abs((y - _SIZE_PX[1] / 2) / 90.0) ** 4
        return np.asarray(600.0 * np.exp(-away))


def _paper(printed: Printed) -> Image:
    barcode = zxingcpp.create_barcode(printed.content, _FORMATS[printed.kind])
    row = np.array(barcode.to_image(scale=1, add_quiet_zones=False), np.uint8)[0]
    bars = np.repeat(np.where(row == 0, _INK, _PAPER).astype(np.uint8), _MODULE_PX)[None]
    code = np.repeat(bars, _BARS * _MODULE_PX, axis=0)
    quiet = _QUIET * _MODULE_PX
    paper = np.pad(code, ((5 * _MODULE_PX, _TEXT * _MODULE_PX), (quiet, quiet)), constant_values=_PAPER)
    at = quiet, paper.shape[0] - 3 * _MODULE_PX
    cv2.putText(paper, printed.content, at, cv2.FONT_HERSHEY_SIMPLEX, 1.2, _INK, 2, cv2.LINE_AA)
    return paper


def _hurt(paper: Image, damage: Damage, share: float, front: int, rng: np.random.Generator) -> Image:
    """The left end of `paper` damaged, over `share` of the bars."""
    height, width = paper.shape
    quiet = _QUIET * _MODULE_PX
    bars_px = width - 2 * quiet
    columns, rows = np.arange(width)[None, :], np.arange(height)[:, None]
    lean = float(rng.uniform(-0.15, 0.15)) * (rows - height / 2)
    edge = quiet + share * bars_px
    out = paper.copy()
    if damage is Damage.TORN:
        ragged = np.cumsum(rng.normal(0.0, 1.5, height))[:, None]
        gone = columns < edge + lean + np.clip(ragged - ragged.mean(), -8, 8)
        out[np.broadcast_to(gone, out.shape)] = front
    elif damage is Damage.COVERED:
        out[np.broadcast_to(columns < edge + lean, out.shape)] = int(rng.choice(_FRONTS))
    elif damage is Damage.WORN:
        kept = 1.0 / (1.0 + np.exp(-(columns - edge - lean) / float(rng.uniform(1.0, 12.0))))
        out = np.asarray(_PAPER - (_PAPER - paper.astype(np.float64)) * kept, np.uint8)
    elif damage is Damage.BLOT:
        begin = quiet + float(rng.uniform(0.0, 1.0 - share)) * bars_px
        wide = np.abs(columns - begin - share * bars_px / 2 - lean) < share * bars_px / 2
        out[np.broadcast_to(wide, out.shape)] = int(rng.choice((_INK, 90, 150, 215, _PAPER, 250)))
    return out
