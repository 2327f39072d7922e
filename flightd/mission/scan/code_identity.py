"""Whether a code names one thing, so that it can be at one place only.  Pure."""

from __future__ import annotations

from flightd.core.types import CodeRead

_ARTICLES = frozenset(("EAN-13", "EAN-8", "UPC-A", "UPC-E", "ITF-14"))
_ARTICLE, _BATCH = frozenset(("01", "02")), "10"
_ONE = frozenset(("00", "21", "8003", "8004", "8006", "8017", "8018"))
"""GS1 application identifiers of an article, its batch, and what only one thing has."""


def names_one_thing(read: CodeRead) -> bool:
    """An article's number, with or without batch, may hang at many places; everything else is taken to
    name one pallet, case or piece."""
    keys = {key for key, _ in read.gs1}
    if keys & _ONE:
        return True
    return read.symbology not in _ARTICLES and not keys & _ARTICLE and keys != {_BATCH}
