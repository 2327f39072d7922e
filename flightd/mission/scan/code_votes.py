"""Votes of many frames on what a code says: it counts when a checksum vouches or two frames agree.

Looks at one frame are the same pixels, scaled and turned: that several of them agree makes a code a rival of
what else is read there, and no second witness.  Nor are frames of one label independent where what they show
may be a part of a longer code: it is misread alike in each of them, and counts in none."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import TypeAlias

from flightd.mission.scan.code_assignment import PlacedRead

SeenRead: TypeAlias = tuple[PlacedRead, int]
"""A code, and how many frames gave it, whole or as what may be a part."""


class CodeVotes:
    """Collects the reads of one location over frames; it never chooses between contradicting texts by luck.

    Reads are one code when symbology and text are equal.  Of each code it keeps the best read, the place
    where it was seen last, and the highest probability that this is in the location.  A read that may be a
    part of a longer code is kept, and is no frame that gives it.
    """

    def __init__(self) -> None:
        self._codes: dict[tuple[str, str], PlacedRead] = {}
        self._frames: dict[tuple[str, str], set[int]] = {}
        self._looks: dict[tuple[str, str], set[int]] = {}

    @property
    def any_read(self) -> bool:
        """Whether any code was read, believed or not."""
        return bool(self._codes)

    def add(self, frame_seq: int, reads: Iterable[PlacedRead]) -> bool:
        """Take in what one frame showed, the same frame twice counting once; whether a code was new."""
        new = False
        for placed in reads:
            code = placed.read.symbology, placed.read.text
            known = self._codes.get(code)
            new |= known is None
            self._codes[code] = placed if known is None else _merged(known, placed)
            self._looks.setdefault(code, set()).add(frame_seq)
            frames = self._frames.setdefault(code, set())
            if placed.read.whole or placed.read.sure:
                frames.add(frame_seq)
        return new

    @property
    def only_parts(self) -> bool:
        """Whether codes were read, and each may be a part of a longer one."""
        return self.any_read and not any(self._frames.values())

    def frames(self, placed: PlacedRead) -> int:
        """How many frames gave a code whole."""
        return len(self._frames.get((placed.read.symbology, placed.read.text), ()))

    def believed(self) -> tuple[PlacedRead, ...]:
        """One read for each code that is believed, be it for the looks at one frame alone, the most often
        seen first; `agreeing` counts the frames that gave it whole."""
        believed = (self._by_frames(placed) for placed in self._counted() if placed.read.believed)
        return tuple(sorted(believed, key=lambda placed: (-placed.read.agreeing, placed.read.text)))

    def seen(self) -> tuple[SeenRead, ...]:
        """One read for each code, believed or not."""
        return tuple(
            (placed, len(self._looks[placed.read.symbology, placed.read.text])) for placed in self._counted()
        )

    def _counted(self) -> Iterator[PlacedRead]:
        """The best read of each code; `agreeing` counts frames, or the looks at one where those were more."""
        for code, placed in self._codes.items():
            agreeing = max(len(self._frames[code]), placed.read.agreeing)
            yield replace(placed, read=replace(placed.read, agreeing=agreeing))

    def _by_frames(self, placed: PlacedRead) -> PlacedRead:
        return replace(placed, read=replace(placed.read, agreeing=self.frames(placed)))


def _merged(known: PlacedRead, newest: PlacedRead) -> PlacedRead:
    """One code seen twice."""
    best = max(known.read, newest.read, key=lambda read: (read.sure, read.whole, read.quality))
    return replace(newest, read=best, probability=max(known.probability, newest.probability))
