"""What several pictures say of one location, and when that is enough for a verdict."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from flightd.core.inventory import LocationState
from flightd.core.scanning import BodyPose, Light, Occupancy, PlaceLook
from flightd.core.types import CodeRead
from flightd.mission.scan.code_assignment import PlacedRead
from flightd.vision.shelf.read_votes import CodeVotes

_LEAST_SHARE = 0.6
"""Part of a cell that must be in the picture for the picture to count as a look at it."""
_WHOLE_SHARE = 0.9
"""Part that one picture at least must show before more pictures are not asked for: what is cut off may
hold a second label."""
_SAME_LABEL = 0.5
"""Two codes nearer to each other than this part of their size are one label."""
_LEAST_EMPTY = 2
"""Looks in a row that must agree before a place is said to be empty, however little time there was."""
_OCCUPIED = (Occupancy.GOODS, Occupancy.COVERED)
_SURE_TEXT = 0.999
_AGREED_TEXT = 0.99
_SEEN_EMPTY = 0.995
_NO_CODE = 0.9


@dataclass(frozen=True, slots=True)
class LocationVerdict:
    """The one state of a location, with how sure that is (0..1) and what vouches for it."""

    state: LocationState
    confidence: float
    reads: tuple[CodeRead, ...]
    evidence: str
    pose: BodyPose


@dataclass(slots=True)
class _Spot:
    """Where one text was seen on the shelf front, newest."""

    x_m: float
    height_m: float
    size_m: float
    probability: float


class LocationVotes:
    """The looks at one location.  `verdict` gives its state as soon as `pictures` looks agree on it; `light`
    is how it came out in the last."""

    def __init__(self, pictures: int) -> None:
        self._least = pictures
        self._votes = CodeVotes()
        self._spots: dict[tuple[str, str], _Spot] = {}
        self._seen: Counter[Occupancy] = Counter()
        self._empty_in_a_row = self._most_empty = 0
        self._quiet = 0
        self._largest = 0.0
        self._best: tuple[bool, float] = (False, -1.0)
        self._evidence = ""
        self._pose: BodyPose | None = None
        self.light = Light.FAIR

    @property
    def looks(self) -> int:
        """Pictures that showed enough of the location."""
        return self._seen.total()

    @property
    def told(self) -> bool:
        """More pictures from the same place would show no more: codes are read, the rest is cut off."""
        return self.looks >= self._least and self._quiet >= 2 and bool(self._votes.believed())

    def add(
        self, frame_seq: int, pose: BodyPose, place: PlaceLook | None, reads: Sequence[PlacedRead]
    ) -> None:
        """Take in one picture: what it shows of the location, and the codes that are surely its own."""
        new = False
        for placed in reads:
            key = placed.read.symbology, placed.read.text
            new |= key not in self._spots
            known = self._spots.get(key)
            best = max(placed.probability, known.probability if known else 0.0)
            self._spots[key] = _Spot(placed.x_m, placed.height_m, placed.size_m, best)
        self._votes.add(frame_seq, (placed.read for placed in reads))
        if place is not None and (place.share >= _LEAST_SHARE or reads):
            # what is burnt out looks like goods
            told = place.light is Light.FAIR or place.occupancy is Occupancy.EMPTY
            occupancy = place.occupancy if told else Occupancy.UNSURE
            self._seen[occupancy] += 1
            self._empty_in_a_row = self._empty_in_a_row + 1 if occupancy is Occupancy.EMPTY else 0
            self._most_empty = max(self._most_empty, self._empty_in_a_row)
        if place is not None or reads:
            self._quiet = 0 if new else self._quiet + 1
            self._pose = pose
        self.light = place.light if place is not None else self.light
        self._largest = max(self._largest, place.share if place is not None else 0.0)
        if place is not None and place.evidence:
            worth = bool(reads), place.share
            if worth >= self._best:
                self._best, self._evidence = worth, place.evidence

    def verdict(self, final: bool) -> LocationVerdict | None:
        """The state, None while more looks may still tell; `final` forces one, and is None only where no
        picture showed the location."""
        if self._pose is None:
            return None
        believed, torn = self._believed()
        if believed and not torn:
            settled = self._enough and self._quiet >= 2 and self._agreed(believed)
            return self._with_codes(believed, self._pose) if settled or final else None
        if self._is_empty(final):
            return LocationVerdict(LocationState.EMPTY, _SEEN_EMPTY, (), self._evidence, self._pose)
        if not final or not self.looks:
            return None
        covered = self._seen[Occupancy.COVERED]
        hidden = covered > self.looks / 2 and not self._spots
        state = LocationState.OCCLUDED if hidden else LocationState.UNREADABLE
        return LocationVerdict(state, _NO_CODE, (), self._evidence, self._pose)

    def _is_empty(self, final: bool) -> bool:
        """Whether looks in a row show an empty place, and none ever showed that there is something."""
        enough = self._enough and self._empty_in_a_row >= self._least
        if final:
            all_empty = self._empty_in_a_row == self.looks >= _LEAST_EMPTY
            enough = enough or all_empty or self._most_empty >= self._least
        return enough and not self._spots and not any(self._seen[kind] for kind in _OCCUPIED)

    @property
    def _enough(self) -> bool:
        return self.looks >= self._least and self._largest >= _WHOLE_SHARE

    @staticmethod
    def _agreed(believed: Sequence[CodeRead]) -> bool:
        return all(read.agreeing >= 2 for read in believed)

    def _with_codes(self, believed: Sequence[CodeRead], pose: BodyPose) -> LocationVerdict:
        several = len({read.text for read in believed}) > 1
        sure = min(
            self._spots[read.symbology, read.text].probability
            * (_SURE_TEXT if read.sure and read.agreeing >= 2 else _AGREED_TEXT)
            for read in believed
        )
        state = LocationState.SEVERAL if several else LocationState.READ
        return LocationVerdict(state, sure, tuple(believed), self._evidence, pose)

    def _believed(self) -> tuple[list[CodeRead], bool]:
        """The reads that count, and whether one label was read as different texts: then none counts."""
        believed = list(self._votes.believed())
        for i, one in enumerate(believed):
            for other in believed[i + 1 :]:
                if one.text != other.text and self._is_one_label(one, other):
                    return [], True
        return believed, False

    def _is_one_label(self, one: CodeRead, other: CodeRead) -> bool:
        a, b = self._spots[one.symbology, one.text], self._spots[other.symbology, other.text]
        reach = _SAME_LABEL * min(a.size_m, b.size_m)
        return abs(a.x_m - b.x_m) < reach and abs(a.height_m - b.height_m) < reach
