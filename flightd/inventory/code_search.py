"""Finding places by what a person types or scans: a code in whatever notation, or a place's own name."""

from __future__ import annotations

from collections.abc import Iterable

from flightd.inventory.place_view import PlaceView
from flightd.vision.shelf.code_equality import code_key


def found_places(words: str, places: Iterable[PlaceView]) -> list[str]:
    """The places meant, in their order: those with this code, else those with the words in code or name."""
    if not words.strip():
        return []
    known = list(places)
    key, part = code_key(words), words.strip().casefold()
    exact = [
        place.code for place in known
        if place.code.casefold() == part or any(code_key(text) == key for text in place.texts)
    ]  # fmt: skip
    return exact or [
        place.code for place in known
        if part in place.code.casefold() or any(part in text.casefold() for text in place.texts)
    ]  # fmt: skip
