"""Lines of printed text in a picture, each read in several ways."""

from __future__ import annotations

from dataclasses import dataclass

from flightd.core.scanning import Quad


@dataclass(frozen=True, slots=True)
class TextLook:
    """One way of reading a line: its text, and the probability of each character."""

    text: str
    sure: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.text) != len(self.sure):
            raise ValueError(f"{len(self.text)} characters with {len(self.sure)} probabilities")


@dataclass(frozen=True, slots=True)
class TextLine:
    """A line with its corners in centred coordinates (left top, clockwise).  `open_left` and `open_right` say
    that it may go on there: it touches something, the light burns it out, or the picture ends; `gap`, that
    the light may have taken characters out of it.  `glare` is the part of it that is burnt out."""

    corners_px: Quad
    looks: tuple[TextLook, ...]
    open_left: bool = False
    open_right: bool = False
    gap: bool = False
    glare: float = 0.0
