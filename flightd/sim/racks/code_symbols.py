"""Codes as zxing-cpp prints them: their text as a reader tells it, and their pattern of modules."""

from __future__ import annotations

import enum
import re
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import zxingcpp

from flightd.core.types import Image
from flightd.vision.shelf.gs1 import FNC1


class Symbology(enum.StrEnum):
    """What is printed; the values are the reader's names."""

    QR = "QR Code"
    DATA_MATRIX = "Data Matrix"
    CODE_128 = "Code 128"
    EAN_13 = "EAN-13"

    @property
    def is_linear(self) -> bool:
        return self in {Symbology.CODE_128, Symbology.EAN_13}

    @property
    def quiet_modules(self) -> int:
        """Blank modules that each side needs (linear: left and right)."""
        return {Symbology.QR: 4, Symbology.DATA_MATRIX: 2, Symbology.CODE_128: 10, Symbology.EAN_13: 11}[self]


_FORMATS = {
    Symbology.QR: zxingcpp.BarcodeFormat.QRCode,
    Symbology.DATA_MATRIX: zxingcpp.BarcodeFormat.DataMatrix,
    Symbology.CODE_128: zxingcpp.BarcodeFormat.Code128,
    Symbology.EAN_13: zxingcpp.BarcodeFormat.EAN13,
}
_ELEMENT = re.compile(r"\((\d+)\)")
_FIXED_LENGTH = ("00", "01", "02", "11", "13", "15", "17")


@dataclass(frozen=True, slots=True)
class Symbol:
    """One code: `content` as it is printed below it, GS1 identifiers in brackets."""

    symbology: Symbology
    content: str

    @property
    def is_gs1(self) -> bool:
        return self.content.startswith("(")

    @property
    def text(self) -> str:
        """What a reader tells: GS1 elements joined, FNC1 (ASCII 29) behind those of variable length."""
        if not self.is_gs1:
            return self.content
        parts = _ELEMENT.split(self.content)[1:]
        elements = list(zip(parts[::2], parts[1::2], strict=True))
        ends = [FNC1 if ai not in _FIXED_LENGTH else "" for ai, _ in elements[:-1]] + [""]
        return "".join(ai + value + end for (ai, value), end in zip(elements, ends, strict=True))


@lru_cache(maxsize=512)
def modules(symbol: Symbol) -> Image:
    """(rows, columns) of 0 (printed) and 255, one pixel a module, without quiet zone; a linear code has
    one row."""
    barcode = zxingcpp.create_barcode(symbol.content, _FORMATS[symbol.symbology], gs1=symbol.is_gs1)
    pattern = np.array(barcode.to_image(scale=1, add_quiet_zones=False), np.uint8)
    return pattern[:1] if symbol.symbology.is_linear else pattern
