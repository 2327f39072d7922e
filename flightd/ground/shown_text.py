"""Text that can be sent, whatever it was made of."""

from __future__ import annotations


def shown(text: str) -> str:
    """The text; parts of a file's name that are none stand in it as escapes (`\\udcff`), so that different
    names stay different."""
    return text.encode(errors="backslashreplace").decode()
