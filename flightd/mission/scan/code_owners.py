"""At which places a count has found each single thing.  Pure.

One thing cannot be at two places: what is found at both counts at neither until both were looked at again.
What that shows counts, for then there is a label at each.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from flightd.core.scanning import CountedPlace, Finding
from flightd.core.types import CodeRead
from flightd.mission.scan.code_identity import names_one_thing
from flightd.vision.shelf.code_equality import code_key


@dataclass(frozen=True, slots=True)
class Contradiction:
    """One thing was found at `place` and at the `others`; what was found at those that are `again` to be
    looked at counts no more.  None are where all of them were already."""

    place: str
    others: tuple[str, ...]
    again: frozenset[str]

    def __str__(self) -> str:
        others = ", ".join(self.others)
        text = f"one code at {others} and {self.place}: counted at each"
        if self.again:
            text = f"one code at {others} and {self.place}: to be looked at again"
        return text


class CodeOwners:
    """Call `take` for each finding, whichever way it came, and `forget` for those that count no more; `book`
    first, where earlier flights have counted a part."""

    def __init__(self) -> None:
        self._places: dict[str, set[str]] = {}
        self._again: set[str] = set()
        self._at_many: set[str] = set()

    def book(self, counted: Iterable[CountedPlace]) -> None:
        """Earlier flights have counted these.  What they booked at two places surely hangs at both."""
        for place in counted:
            for thing in _things(place.reads):
                self._places.setdefault(thing, set()).add(place.location)
        self._at_many |= {thing for thing, at in self._places.items() if len(at) > 1}

    def begin(self) -> None:
        """Another flight of the count looks at all places anew, at each once more where it has to."""
        self._again.clear()

    def take(self, found: Finding) -> Contradiction | None:
        """What contradicts the finding, which is the place's own unless it is to be looked at again; what was
        found there before is over."""
        # what hangs at two places surely is no single thing
        things = _things(found.reads) - self._at_many
        self._drop({found.location})
        twice = {thing for thing in things if self._places.get(thing, set()) - {found.location}}
        others = {place for thing in twice for place in self._places[thing]} - {found.location}
        again = ({found.location} | others) - self._again if others else set()
        self._again |= again
        self._drop(again)
        if found.location not in again:
            for thing in things:
                self._places.setdefault(thing, set()).add(found.location)
        if not others:
            return None
        if not again:
            self._at_many |= twice
        return Contradiction(found.location, tuple(sorted(others)), frozenset(again))

    def forget(self, places: Iterable[str]) -> None:
        """The drone may have been elsewhere when it looked at these."""
        gone = set(places)
        self._again -= gone
        self._drop(gone)

    def _drop(self, places: set[str]) -> None:
        self._places = {thing: left for thing, at in self._places.items() if (left := at - places)}


def _things(reads: Iterable[CodeRead]) -> set[str]:
    """What the codes name, whatever else their labels say of it and however it is written."""
    return {code_key(read.text) for read in reads if names_one_thing(read)}
