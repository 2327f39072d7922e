"""A name for one thing more, where others have names already."""

from __future__ import annotations

from collections.abc import Container
from itertools import count


def free_name(name: str, taken: Container[str]) -> str:
    """The name, or where it is taken the first of NAME-2, NAME-3, ... that is not."""
    if name not in taken:
        return name
    return next(other for number in count(2) if (other := f"{name}-{number}") not in taken)
