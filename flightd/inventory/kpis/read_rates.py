"""How often a label that is known to be there is read: by symbology, and by the size of its modules.

That a label is there is known from a read; whether it is read *again* is what counts.  So the first read of
a code at a place counts for nothing, and what follows counts until a look shows that it has gone: another
code, or an empty place.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from flightd.core.inventory import LocationState, Observation, Standing
from flightd.core.types import CodeRead
from flightd.inventory.place_view import Look
from flightd.vision.shelf.code_equality import code_key

MODULE_BOUNDS_PX: Final = (2.0, 2.75, 4.0, 6.0)
"""Between the classes of module size."""


@dataclass(slots=True)
class ReadRate:
    """`codes` are all that were read; of the `looks` at those known to be there, `read` read it."""

    codes: int = 0
    looks: int = 0
    read: int = 0

    @property
    def share(self) -> float | None:
        """None while nobody has looked a second time."""
        return self.read / self.looks if self.looks else None

    def counted(self, *, read: bool) -> None:
        """One more look at a code that is known to be there."""
        self.looks += 1
        self.read += read


@dataclass(frozen=True, slots=True)
class ReadRates:
    """By the symbology of the first read, and by its module size (`module_class`) where that is known."""

    by_symbology: dict[str, ReadRate]
    by_module: dict[str, ReadRate]


def read_rates(looks: Sequence[Look]) -> ReadRates:
    """Over all looks but withdrawn ones: these may have been at other places."""
    places: defaultdict[str, list[Observation]] = defaultdict(list)
    for seen, standing in sorted(looks, key=lambda look: (look[0].utc_ns, look[0].id)):
        if standing is not Standing.WITHDRAWN:
            places[seen.location].append(seen)
    by_symbology: defaultdict[str, ReadRate] = defaultdict(ReadRate)
    by_module: defaultdict[str, ReadRate] = defaultdict(ReadRate)
    for history in places.values():
        for first, after in _first_reads(history):
            rates = [by_symbology[first.symbology]]
            if first.module_px is not None:
                rates.append(by_module[module_class(first.module_px)])
            for rate in rates:
                rate.codes += 1
                for seen in after:
                    rate.counted(read=_reads(seen, first))
    return ReadRates(dict(sorted(by_symbology.items())), dict(sorted(by_module.items(), key=_first_number)))


def module_class(module_px: float) -> str:
    """As people read it: `2.75 to 4 px`."""
    above = [bound for bound in MODULE_BOUNDS_PX if module_px >= bound]
    below = [bound for bound in MODULE_BOUNDS_PX if module_px < bound]
    if not below:
        return f"{above[-1]:g} px and more"
    return f"{above[-1] if above else 0:g} to {below[0]:g} px"


def _first_number(entry: tuple[str, ReadRate]) -> float:
    return float(entry[0].split(maxsplit=1)[0])


def _first_reads(history: Sequence[Observation]) -> Iterable[tuple[CodeRead, list[Observation]]]:
    """Each code of a place when it was read first, and the looks after that while it surely hung there."""
    known: set[str] = set()
    for number, seen in enumerate(history):
        for read in {code_key(read.text): read for read in reversed(seen.reads)}.values():
            key = code_key(read.text)
            if key not in known:
                known.add(key)
                yield read, _while_there(read, history[number + 1 :])


def _while_there(read: CodeRead, later: Sequence[Observation]) -> list[Observation]:
    found = []
    for seen in later:
        if not _reads(seen, read) and (seen.reads or seen.state is LocationState.EMPTY):
            break
        found.append(seen)
    return found


def _reads(seen: Observation, read: CodeRead) -> bool:
    key = code_key(read.text)
    return any(code_key(other.text) == key for other in seen.reads)
