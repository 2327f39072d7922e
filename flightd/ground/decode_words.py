"""What is wrong with a message, by msgspec, in words for the person who typed it."""

from __future__ import annotations

import re

_PLACED = re.compile(
    r"Expected `\w+(?: \| null)?`(?P<length> of length)?"
    r"(?: (?P<bound>[<>]=?) (?P<limit>\S+)|, got `(?P<got>\w+)`) - at `\$\.(?P<key>\S+)`"
)


def decode_words(err: Exception) -> str:
    """The field with what it may be; as msgspec says it where it is no matter of a value."""
    found = _PLACED.fullmatch(str(err))
    if found is None:
        return str(err)
    if found["bound"] is not None:
        limit = f"{float(found['limit']):g}"
        return _beyond(found["key"], found["bound"], limit, is_length=found["length"] is not None)
    if found["got"] == "null":
        return f"{found['key']} is not given"
    return f"{found['key']} is no whole number" if found["got"] == "float" else str(err)


def _beyond(key: str, bound: str, limit: str, *, is_length: bool) -> str:
    if is_length:
        return f"{key} is longer than {limit}" if bound == "<=" else f"{key} is empty or too short"
    if bound == ">":
        return f"{key} is not above {limit}"
    return f"{key} is more than {limit}" if bound == "<=" else f"{key} is less than {limit}"
