"""Texts that came from outside, on a terminal."""

from __future__ import annotations


def visible(text: str) -> str:
    """Control characters as escapes: a terminal obeys none of what a label says."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
