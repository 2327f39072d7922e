"""How many modules wide a code is, where the reader tells it or the symbology has one width."""

from __future__ import annotations

import re
from typing import Final

import numpy as np
import zxingcpp

from flightd.core.geometry import Matrix

_LINEAR: Final = {"EAN-13": 95, "UPC-A": 95, "EAN-8": 67, "UPC-E": 51}
"""Without quiet zones.  The width of Code 128, Code 39, ITF and the like depends on the text."""
_SIZE: Final = re.compile(r"(\d+)x(\d+)")


def module_px(code: zxingcpp.Barcode, corners: Matrix) -> float | None:
    """Pixels for each module of a code with its `corners` (left top, clockwise) in the picture; None where
    the number of modules is not known."""
    modules = modules_across(code)
    if modules is None:
        return None
    across_px = float(np.linalg.norm(corners[1] - corners[0]) + np.linalg.norm(corners[2] - corners[3])) / 2
    return round(across_px / modules, 2)


def qr_version(code: zxingcpp.Barcode) -> int:
    """The QR code's version, 0 where the reader does not tell."""
    version = _version(code)
    return int(version) if version.isdecimal() else 0


def modules_across(code: zxingcpp.Barcode) -> int | None:
    """The modules of the code's upper side."""
    name = str(code.format)
    if name == "QR Code" and qr_version(code):
        return 17 + 4 * qr_version(code)
    size = _SIZE.fullmatch(_version(code)) if name == "Data Matrix" else None
    # told as rows x columns
    return int(size[2]) if size else _LINEAR.get(name)


def _version(code: zxingcpp.Barcode) -> str:
    return str(code.extra.get("Version")) if isinstance(code.extra, dict) else ""
