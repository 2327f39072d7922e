"""Text in the cells of a CSV file: a spreadsheet program must not take what a label says for a formula.

As OWASP advises, a cell that begins with one of = + - @, a tab or a line end is given a leading apostrophe.
A text that has apostrophes before such a character gets one more, so that every text comes back exactly.
"""

from __future__ import annotations

import re

_FORMULA = re.compile(r"'*[=+\-@\t\r\n]")


def inert(text: str) -> str:
    """The cell for a text: never the beginning of a formula."""
    return f"'{text}" if _FORMULA.match(text) else text


def exact(cell: str) -> str:
    """The text of a cell that `inert` made; another program's cell as it is, unless it looks the same."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell, 1) else cell
