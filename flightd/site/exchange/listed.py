"""Names in a note: the first of many."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

_LISTED: Final = 6


def listed(names: Sequence[str]) -> str:
    """Six at most, and how many more there are."""
    more = len(names) - _LISTED
    return ", ".join(names[:_LISTED]) + (f" and {more} more" if more > 0 else "")
