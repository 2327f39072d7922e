"""Text in the cells of a CSV file: a spreadsheet program must not take what a label says for a formula.

As OWASP advises, a cell that begins with one of = + - @, a tab or a line end is given a leading apostrophe.
So is what follows a semicolon, a tab or a line end within a cell, quotes before it or not: a program that
takes one of them for the separator makes a cell of its own of it.  A text that has apostrophes before such a
character gets one more, so that every text comes back exactly.
"""

from __future__ import annotations

import re

_BEGINS = r"(?:^|(?<=[;\t\r\n]))"
_FORMULA = r"""(?=['"]*[=+\-@\t\r\n])"""
_LIVE = re.compile(_BEGINS + _FORMULA)
_INERT = re.compile(f"{_BEGINS}'{_FORMULA}")


def inert(text: str) -> str:
    """The cell for a text: nowhere the beginning of a formula."""
    return _LIVE.sub("'", text)


def exact(cell: str) -> str:
    """The text of a cell that `inert` made; another program's cell as it is, unless it looks the same."""
    return _INERT.sub("", cell)
