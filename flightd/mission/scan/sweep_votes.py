"""What the pictures of one place taken in passing say together, and whether that decides it.

Nothing is decided that views contradict each other on, or that too few of them really saw: such a place is
left for a stop.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import combinations

from flightd.config.scan import ScanConfig
from flightd.core.inventory import LocationState
from flightd.core.scanning import BodyPose, Finding, Light, Occupancy, PictureWorth, PlaceLook
from flightd.mission.scan.code_assignment import PlacedRead
from flightd.mission.scan.code_votes import SeenRead
from flightd.mission.scan.location_votes import LEAST_FRAMES, SEEN_EMPTY, LocationVotes

_SEEN_SHARE = 0.6
"""Part of what can be seen of a place that a picture must show to say anything of it."""
_WHOLE_SHARE = 0.9
_LEAST_WHOLE = 2
"""Pictures that must show a place whole, and goods in it, before it is said to be unreadable."""
_CODES = (LocationState.READ, LocationState.SEVERAL)
_OCCUPIED = (Occupancy.GOODS, Occupancy.COVERED)
_UNREAD = (LocationState.UNREADABLE, LocationState.OCCLUDED)


class Undecided(enum.StrEnum):
    """Why a place that was flown past is visited again."""

    UNSEEN = "too few views"
    LIGHT = "badly lit"
    UNSURE = "perhaps empty"
    ONCE = "a code that only one view gives"
    PART = "bars that may go on"
    APART = "codes that no view shows together"
    TORN = "one label read differently"
    NOBODYS = "a code that may be a neighbour's"
    ELSEWHERE = "a code that was found at another place, too"
    DOUBTED = "the position was doubted"


class SweepVotes:
    """The looks at one location in passing.  `full_share` is the most of it that this leg can show."""

    def __init__(self, location: str, node: str, params: ScanConfig, full_share: float) -> None:
        self._params = params
        self._full_share = max(full_share, 0.01)
        self._votes = LocationVotes(location, node, params.pictures)
        self._together: set[tuple[str, str]] = set()
        self._texts: set[str] = set()
        self._fair_rad: list[float] = []
        self._whole_rad: list[float] = []
        self._telling_rad: list[float] = []
        self._unfair = self._occupied = self._empty = 0
        self._whole_occupied = self._whole_empty = 0
        self._doubtful: set[str] = set()
        self.newest_ns = 0
        """When it was in a picture last; 0 before the first."""

    def add(
        self,
        frame_seq: int,
        pose: BodyPose,
        place: PlaceLook | None,
        reads: Sequence[PlacedRead],
        *,
        bearing_rad: float,
        doubtful: Collection[str] = (),
    ) -> None:
        """Take in one picture taken at `pose`, from where the location is seen under `bearing_rad` along the
        shelf; `doubtful` are codes in it that may belong here or to a neighbour."""
        if place is not None:
            share = min(place.share / self._full_share, 1.0)
            place = replace(place, share=share)
            if share >= _SEEN_SHARE:
                self.newest_ns = max(self.newest_ns, pose.stamp_ns)
                fair = place.light is Light.FAIR or place.occupancy is Occupancy.EMPTY
                self._unfair += not fair
                self._occupied += fair and place.occupancy in _OCCUPIED
                self._empty += place.occupancy is Occupancy.EMPTY
                if share >= _WHOLE_SHARE:
                    self._whole_occupied += place.occupancy in _OCCUPIED
                    self._whole_empty += place.occupancy is Occupancy.EMPTY
                if fair:
                    self._fair_rad.append(bearing_rad)
                    if share >= _WHOLE_SHARE:
                        self._whole_rad.append(bearing_rad)
                        if place.deck:
                            self._telling_rad.append(bearing_rad)
        if reads:
            self.newest_ns = max(self.newest_ns, pose.stamp_ns)
        self._doubtful.update(doubtful)
        believed = sorted({placed.read.text for placed in reads if placed.read.believed})
        self._texts.update(believed)
        self._together.update(combinations(believed, 2))
        self._votes.add(frame_seq, pose, place, reads)

    @property
    def evidence(self) -> str:
        """The name of the best picture of it so far; empty where there is none."""
        return self._votes.evidence

    @property
    def kept(self) -> PictureWorth:
        """What the picture is worth that is kept as evidence, its share that of the whole place unless no
        picture of this leg can show more."""
        kept = self._votes.kept
        return kept if kept.share >= 1.0 else replace(kept, share=kept.share * self._full_share)

    @property
    def reads(self) -> tuple[SeenRead, ...]:
        """What was read there, believed or not."""
        return self._votes.reads

    def verdict(self, others: Collection[str] = ()) -> Finding | Undecided:
        """What the views say together, asked when the place is out of the picture; `others` are the codes
        that surely belong elsewhere."""
        found = self._votes.finding(False, others) or self._votes.finding(True, others)
        if found is None or self._votes.looks < self._params.pictures:
            return Undecided.UNSEEN
        if found.state in _CODES:
            return self._with_codes(found)
        if not self._doubtful <= set(others):
            return Undecided.NOBODYS
        if found.state not in _UNREAD:
            return found
        return self._empty_after_all(found) or self._unread(found)

    def _with_codes(self, found: Finding) -> Finding | Undecided:
        """Codes count that several views give; several of them, where a view shows each two together."""
        beside = self._texts & {code.text for code in found.undecided}
        if beside or any(read.agreeing < LEAST_FRAMES for read in found.reads):
            return Undecided.ONCE
        texts = sorted({read.text for read in found.reads})
        if any(pair not in self._together for pair in combinations(texts, 2)):
            return Undecided.APART
        return found

    def _empty_after_all(self, found: Finding) -> Finding | None:
        """An empty place beside goods: where the picture's edge cuts it off, they look like its own."""
        enough = self._whole_empty >= self._params.sweep.unread_views and not self._whole_occupied
        if not enough or self._votes.any_goods:
            return None
        fill = self._votes.fill(LocationState.EMPTY)
        return replace(found, state=LocationState.EMPTY, confidence=SEEN_EMPTY, fill=fill)

    def _unread(self, found: Finding) -> Finding | Undecided:
        """Nothing is unreadable by few views, by bad light, or from one angle."""
        sweep = self._params.sweep
        if self._votes.torn:
            return Undecided.TORN
        if self._votes.any_read:
            return Undecided.PART if self._votes.only_parts else Undecided.ONCE
        if len(self._fair_rad) < sweep.unread_views:
            return Undecided.LIGHT if self._unfair else Undecided.UNSEEN
        if self._occupied and self._empty:
            return Undecided.UNSURE
        spread_rad = math.radians(sweep.unread_spread_deg)
        if self._occupied < _LEAST_WHOLE:  # an empty place would have shown its deck to one of so many views
            enough = len(self._telling_rad) >= sweep.unread_views and not self._empty
            return found if enough and _spread(self._telling_rad) >= 2.0 * spread_rad else Undecided.UNSURE
        enough = len(self._whole_rad) >= _LEAST_WHOLE and _spread(self._fair_rad) >= spread_rad
        return found if enough else Undecided.UNSEEN


def _spread(bearings_rad: Sequence[float]) -> float:
    return max(bearings_rad) - min(bearings_rad)
