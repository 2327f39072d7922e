"""Votes of many frames on what a code says: believed when a checksum vouches or two reads agree."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from flightd.core.types import CodeRead


@dataclass(slots=True)
class _Tally:
    best: CodeRead
    frames: set[int] = field(default_factory=set)


class CodeVotes:
    """Collects the reads of one place over frames; it never chooses between contradicting texts by luck.

    Reads are one code when symbology and text are equal.  Where a code was read lies outside: give one
    `CodeVotes` the reads of one shelf position.
    """

    def __init__(self) -> None:
        self._tallies: dict[tuple[str, str], _Tally] = {}

    def add(self, frame_seq: int, reads: Iterable[CodeRead]) -> None:
        """Take in what one frame showed; the same frame twice counts once."""
        for read in reads:
            tally = self._tallies.setdefault((read.symbology, read.text), _Tally(read))
            tally.frames.add(frame_seq)
            if (read.sure, read.quality) > (tally.best.sure, tally.best.quality):
                tally.best = read

    def believed(self) -> tuple[CodeRead, ...]:
        """One read for each code that is believed, the most often seen first; `agreeing` counts frames
        (or the looks at one frame, where those were more)."""
        counted = [
            replace(tally.best, agreeing=max(len(tally.frames), tally.best.agreeing))
            for tally in self._tallies.values()
        ]
        return tuple(sorted((r for r in counted if r.believed), key=lambda r: (-r.agreeing, r.text)))

    def doubtful(self) -> tuple[CodeRead, ...]:
        """What was read once and nothing vouches for."""
        return tuple(t.best for t in self._tallies.values() if not t.best.believed and len(t.frames) < 2)
