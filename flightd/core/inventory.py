"""What the count of a warehouse is made of: locations, each in exactly one state, and observations.

Times are UTC in nanoseconds since 1970: an inventory is compared across flights and machines.
"""

from __future__ import annotations

import enum
import hashlib
import json
import math
from collections.abc import Iterable
from dataclasses import dataclass

from flightd.core.label_values import LabelValue
from flightd.core.types import CodeRead


class LocationState(enum.StrEnum):
    """The one thing that is known of a planned location."""

    READ = "read"
    SEVERAL = "several"
    EMPTY = "empty"
    UNREADABLE = "unreadable"
    OCCLUDED = "occluded"
    NOT_VISITED = "not_visited"

    @property
    def is_counted(self) -> bool:
        """Whether it says what is there; the others say only that nobody knows."""
        return self in {LocationState.READ, LocationState.SEVERAL, LocationState.EMPTY}


class Standing(enum.IntEnum):
    """Whether a look counts; where two stores differ, the greater one holds."""

    PENDING = 0
    """The place that it was seen at is not proven yet."""
    CONFIRMED = 1
    WITHDRAWN = 2
    """Where the drone was, was contradicted: it may have been another place; or what it saw, elsewhere."""


@dataclass(frozen=True, slots=True)
class PlannedLocation:
    """A place that must be counted, and the node of the map it is counted from; so many pallets stand behind
    one another in it."""

    code: str
    node: str
    pallets_deep: int = 1

    def __post_init__(self) -> None:
        if self.pallets_deep < 1:
            raise ValueError(f"{self.code}: {self.pallets_deep} pallets deep")


class KnownLocations:
    """The locations of a count by their codes, which are the same whatever their case."""

    def __init__(self, codes: Iterable[str]) -> None:
        self._codes = frozenset(codes)
        self._folded = {code.casefold(): code for code in sorted(self._codes)}

    def spelled(self, code: str) -> str:
        """A code as the count writes it; one that it does not know as it is."""
        return code if code in self._codes else self._folded.get(code.casefold(), code)


@dataclass(frozen=True, slots=True)
class CountPose:
    """Where the drone was when it saw the location; map frame, metres, radians."""

    node: str
    x_m: float
    y_m: float
    height_m: float
    yaw_rad: float


@dataclass(frozen=True, slots=True)
class CaseGrid:
    """The cases of one kind in the front of a regular stack: what is seen, never what stands behind."""

    columns: int
    rows: int

    def __post_init__(self) -> None:
        if min(self.columns, self.rows) < 1:
            raise ValueError(f"a stack of {self.columns} by {self.rows} cases")

    @property
    def count(self) -> int:
        """The cases in the front."""
        return self.columns * self.rows


@dataclass(frozen=True, slots=True)
class PlaceFill:
    """How full a place is: the `share` of its opening, 0..1 as seen straight from before it, in which goods
    stand; None where the pictures do not tell.  `overhang_m` is how far goods are seen to stand out over the
    rack's face, None where none are.  `lean_m` is how far the top of the goods that are seen to lean most is
    aside of their foot, `cases` what is seen of a regular stack; None where that is not known."""

    share: float | None
    overhang_m: float | None = None
    lean_m: float | None = None
    cases: CaseGrid | None = None

    def __post_init__(self) -> None:
        if self.share is not None and not 0.0 <= self.share <= 1.0:
            raise ValueError(f"a share of {self.share} outside 0..1")
        if self.overhang_m is not None and not 0.0 < self.overhang_m < math.inf:
            raise ValueError(f"an overhang of {self.overhang_m} m")
        if self.lean_m is not None and not 0.0 <= self.lean_m < math.inf:
            raise ValueError(f"goods that lean by {self.lean_m} m")


@dataclass(frozen=True, slots=True)
class UndecidedCode:
    """What was read beside a place's codes and does not count: too few `looks`, the pictures that gave it,
    agree on it, or it may be a part of a longer code.  Something hangs there; what it says is not known."""

    symbology: str
    text: str
    looks: int

    def __post_init__(self) -> None:
        if self.looks < 1:
            raise ValueError(f"a code of {self.looks} looks")

    def __str__(self) -> str:
        return f"{self.text} ({self.looks} {'look' if self.looks == 1 else 'looks'})"


@dataclass(frozen=True, slots=True)
class Observation:
    """One look at one location: its state, what was read, from where, and how sure (0..1).

    `evidence` is the SHA-256 of the picture, in hexadecimal, or empty.  Where in the picture a code was is no
    part of the record: reads that come from a store have no `corners_px` and no `gs1_problem`.  `texts` are
    values of printed text in the picture: they may be looked for later, and do not change the `id`, nor does
    `fill`, which is None where it was not asked, nor `again`: its flight had seen the location before, and
    that had decided nothing.

    Nor do the codes that stayed `undecided` change it: they are no part of what was counted, and one look is
    the same look where a program that does not know of them has kept it or passed it on.
    """

    run: str
    location: str
    utc_ns: int
    state: LocationState
    confidence: float
    reads: tuple[CodeRead, ...] = ()
    pose: CountPose | None = None
    evidence: str = ""
    texts: tuple[LabelValue, ...] = ()
    fill: PlaceFill | None = None
    again: bool = False
    undecided: tuple[UndecidedCode, ...] = ()

    def __post_init__(self) -> None:
        texts = {read.text for read in self.reads}
        fits = {
            LocationState.READ: len(texts) == 1,
            LocationState.SEVERAL: len(texts) >= 2,
            LocationState.NOT_VISITED: False,
        }.get(self.state, not texts)
        if not fits:
            raise ValueError(f"{self.location}: {self.state} with {len(texts)} different texts")
        if not 0.0 <= self.confidence <= 1.0:
            raise ValueError(f"{self.location}: confidence {self.confidence} outside 0..1")
        if (p := self.pose) and not all(map(math.isfinite, (p.x_m, p.y_m, p.height_m, p.yaw_rad))):
            raise ValueError(f"{self.location}: pose is not finite: {p}")

    @property
    def id(self) -> str:
        """The same for the same content: writing an observation twice changes nothing."""
        pose, place = self.pose, None
        if pose:
            place = [pose.node, *map(float, (pose.x_m, pose.y_m, pose.height_m, pose.yaw_rad))]
        reads = [
            [r.symbology, r.text, bool(r.sure), r.agreeing, float(r.quality), [list(pair) for pair in r.gs1]]
            for r in self.reads
        ]
        looked = [self.run, self.location, self.utc_ns, self.state.value, float(self.confidence)]
        content = json.dumps([*looked, reads, place, self.evidence], separators=(",", ":"))
        return hashlib.sha256(content.encode()).hexdigest()


@dataclass(frozen=True, slots=True)
class LocationRecord:
    """A location as it stands: by its newest observation, None while nobody looked.  Of `pallets_deep`
    pallets behind one another what stands in front is counted, never what is behind."""

    code: str
    node: str
    observation: Observation | None
    pallets_deep: int = 1

    @property
    def state(self) -> LocationState:
        return self.observation.state if self.observation else LocationState.NOT_VISITED

    @property
    def pallets_seen(self) -> int:
        """Of the pallets behind one another, how many the look shows: the first, or none."""
        nothing = LocationState.NOT_VISITED, LocationState.OCCLUDED, LocationState.EMPTY
        return int(self.state not in nothing)

    @property
    def texts(self) -> tuple[str, ...]:
        """The different texts read there, in the order of their reading."""
        return tuple(dict.fromkeys(read.text for read in self.observation.reads)) if self.observation else ()
