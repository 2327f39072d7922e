"""The codes of a place as a drone tells them over its link, where each value is a text."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping

LISTED = "codes"
"""The value that has them as a list in JSON; `texts` has them joined by spaces, which codes may hold, too."""


def told_codes(codes: Iterable[str]) -> dict[str, str]:
    """Both values."""
    each = list(dict.fromkeys(codes))
    return {"texts": " ".join(each), LISTED: json.dumps(each, ensure_ascii=False)}


def codes_of(told: Mapping[str, str]) -> tuple[str, ...]:
    """The codes of a place; a daemon of before tells no list, and with one code at most where it is read."""
    try:
        each = json.loads(told[LISTED])
    except (KeyError, ValueError):
        text = told.get("texts", "")
        return ((text,) if text else ()) if told.get("state") == "read" else tuple(text.split())
    return tuple(map(str, each)) if isinstance(each, list) else ()
