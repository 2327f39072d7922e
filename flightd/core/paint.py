"""The paint of guide lines: seven named colours, or any tone."""

from __future__ import annotations

import re
from typing import Final, TypeAlias

Srgb: TypeAlias = tuple[int, int, int]
"""Red, green, blue, 0..255."""

NAMED_PAINTS: Final[dict[str, Srgb]] = {
    "yellow": (236, 190, 38),
    "white": (232, 232, 226),
    "red": (176, 40, 38),
    "blue": (34, 84, 168),
    "green": (44, 138, 72),
    "black": (30, 29, 28),
    "orange": (222, 98, 26),
}
"""Floor paint as a camera sees it clean and in good light."""

PROFILE_NAME: Final = r"[a-z0-9][a-z0-9-]{0,39}"
"""What a colour profile may be called, as a regular expression."""

_TONE = re.compile(r"#[0-9a-f]{6}", re.IGNORECASE)


def is_tone(paint: str) -> bool:
    """Whether it is a tone, #rrggbb, and no named colour."""
    return _TONE.fullmatch(paint) is not None


def checked_paint(paint: str) -> str:
    """The paint as maps have it, a tone in small letters.  ValueError, with what to write, for none."""
    if paint in NAMED_PAINTS:
        return paint
    if not is_tone(paint):
        raise ValueError(f"no paint; give one of {', '.join(NAMED_PAINTS)}, or its tone as #rrggbb")
    return paint.lower()


def paint_srgb(paint: str) -> Srgb:
    """What a camera sees of it, clean and in good light.  ValueError as `checked_paint`."""
    named = NAMED_PAINTS.get(checked_paint(paint))
    return named or (int(paint[1:3], 16), int(paint[3:5], 16), int(paint[5:7], 16))
