"""What several pictures say of one location, and when that is enough for a finding."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import combinations

from flightd.core.inventory import LocationState, PlaceFill, UndecidedCode
from flightd.core.scanning import NO_PICTURE, BodyPose, Finding, Light, Occupancy, PlaceLook
from flightd.mission.scan.code_assignment import PlacedRead
from flightd.mission.scan.code_votes import CodeVotes, SeenRead
from flightd.mission.scan.fill_votes import FillVotes

_LEAST_SHARE = 0.6
"""Part of a cell that must be in the picture for the picture to count as a look at it."""
_WHOLE_SHARE = 0.9
"""Part that one picture at least must show before no further ones are needed: what is cut off may hold a
second label."""
LEAST_FRAMES = 2
"""Frames that must agree on what a code says."""
_SAME_LABEL = 0.5
"""Two codes nearer to each other than this part of their size are one label."""
_LEAST_EMPTY = 2
"""Looks in a row that must agree before a place is said to be empty, however little time there was."""
_OCCUPIED = (Occupancy.GOODS, Occupancy.COVERED)
_SURE_TEXT = 0.999
_AGREED_TEXT = 0.99
SEEN_EMPTY = 0.995
_NO_CODE = 0.9


class LocationVotes:
    """The looks at one location from a node.  `finding` gives its state as soon as `pictures` looks agree on
    it; `light` is how it came out in the last.  `passed` is what was read here in passing, which decides
    nothing."""

    def __init__(self, location: str, node: str, pictures: int, passed: Sequence[SeenRead] = ()) -> None:
        self._location = location
        self._node = node
        self._least = pictures
        self._passed = passed
        self._votes = CodeVotes()
        self._fills = FillVotes()
        self._seen: Counter[Occupancy] = Counter()
        self._empty_in_a_row = self._most_empty = 0
        self._blind = 0
        """Looks that say nothing, nor could they say that it is empty."""
        self._quiet = 0
        self._largest = 0.0
        self.kept = NO_PICTURE
        """What the picture is worth that is kept as evidence."""
        self._evidence = ""
        self._pose: BodyPose | None = None
        self.light = Light.FAIR

    @property
    def looks(self) -> int:
        """Pictures that showed enough of the location."""
        return self._seen.total()

    @property
    def evidence(self) -> str:
        """The name of the best picture of it so far; empty where there is none."""
        return self._evidence

    @property
    def any_read(self) -> bool:
        """Whether any code was read here, believed or not."""
        return self._votes.any_read

    @property
    def reads(self) -> tuple[SeenRead, ...]:
        """What was read here, believed or not."""
        return self._votes.seen()

    @property
    def only_parts(self) -> bool:
        """Whether codes were read here, and each may be a part of a longer one."""
        return self._votes.only_parts

    @property
    def torn(self) -> bool:
        """Whether one label was read as different texts."""
        return self._believed()[1]

    @property
    def any_goods(self) -> bool:
        """Whether the place is not empty whatever its middle shows: a code was read here, or most pictures
        show goods in its opening."""
        return self.any_read or self._fills.sees_goods

    @property
    def exhausted(self) -> bool:
        """More pictures from the same place would show no more: codes are read, the rest is cut off."""
        read = any(map(_counts, self._votes.believed()))
        return self.looks >= self._least and self._quiet >= 2 and read

    def add(
        self, frame_seq: int, pose: BodyPose, place: PlaceLook | None, reads: Sequence[PlacedRead]
    ) -> None:
        """Take in one picture: what it shows of the location, and the codes that are surely its own."""
        new = self._votes.add(frame_seq, reads)
        if place is not None and (place.share >= _LEAST_SHARE or reads):
            # what is burnt out looks like goods
            visible = place.light is Light.FAIR or place.occupancy is Occupancy.EMPTY
            occupancy = place.occupancy if visible else Occupancy.UNSURE
            self._seen[occupancy] += 1
            if occupancy is Occupancy.EMPTY:
                self._empty_in_a_row += 1
            elif place.occupancy is not Occupancy.UNSURE or place.deck:
                self._empty_in_a_row = 0
            else:
                self._blind += 1
            self._most_empty = max(self._most_empty, self._empty_in_a_row)
        self._fills.add(place.fill if place is not None else None)
        if place is not None or reads:
            self._quiet = 0 if new else self._quiet + 1
            self._pose = pose
        self.light = place.light if place is not None else self.light
        self._largest = max(self._largest, place.share if place is not None else 0.0)
        if place is not None and place.evidence and place.worth > self.kept:
            self.kept, self._evidence = place.worth, place.evidence

    def finding(self, final: bool, others: Collection[str] = ()) -> Finding | None:
        """The state, None while more looks may still tell; `final` forces one, and is None only where no
        picture showed the location.  `others` are the texts that surely belong elsewhere."""
        if self._pose is None:
            return None
        believed, torn = self._believed()
        if believed and not torn:
            settled = self._enough and self._quiet >= 2 and self._agreed(believed)
            if not (settled or final):
                return None
            believed = tuple(filter(_counts, believed))
        if believed:
            return self._with_codes(believed, self._undecided(believed, others), self._pose)
        if self._is_empty(final):
            return self._found(LocationState.EMPTY, SEEN_EMPTY, self._pose)
        if not final or not self.looks:
            return None
        covered = self._seen[Occupancy.COVERED]
        hidden = covered > self.looks / 2 and not self._votes.any_read
        state = LocationState.OCCLUDED if hidden else LocationState.UNREADABLE
        return replace(self._found(state, _NO_CODE, self._pose), undecided=self._undecided((), others))

    def _is_empty(self, final: bool) -> bool:
        """Whether looks in a row, of those that can, show an empty place, and none ever showed that there is
        something."""
        enough = self._enough and self._empty_in_a_row >= self._least
        if final:
            all_empty = self._empty_in_a_row == self.looks - self._blind >= _LEAST_EMPTY
            enough = enough or all_empty or self._most_empty >= self._least
        shown = self.any_goods or any(self._seen[kind] for kind in _OCCUPIED)
        return enough and not shown and not any(passed.read.believed for passed, _ in self._passed)

    @property
    def _enough(self) -> bool:
        return self.looks >= self._least and self._largest >= _WHOLE_SHARE

    @staticmethod
    def _agreed(believed: Sequence[PlacedRead]) -> bool:
        return all(placed.read.agreeing >= LEAST_FRAMES for placed in believed)

    def _with_codes(
        self, believed: Sequence[PlacedRead], undecided: tuple[UndecidedCode, ...], pose: BodyPose
    ) -> Finding:
        several = len({placed.read.text for placed in believed}) > 1
        confidence = min(
            placed.probability
            * (_SURE_TEXT if placed.read.sure and placed.read.agreeing >= LEAST_FRAMES else _AGREED_TEXT)
            for placed in believed
        )
        state = LocationState.SEVERAL if several else LocationState.READ
        return replace(self._found(state, confidence, pose, believed), undecided=undecided)

    def _undecided(
        self, believed: Sequence[PlacedRead], others: Collection[str]
    ) -> tuple[UndecidedCode, ...]:
        """What was read beside the codes that count, the most often seen first: no misread or part of one of
        these, nor of the location's own label.  Where none counts, what one label was surely read as, here or
        in passing: of one that cannot be read much is misread."""
        own = self._location, *(placed.read.text for placed in believed)
        looks: Counter[tuple[str, str]] = Counter()
        for doubtful, times in (*self._votes.seen(), *self._passed):
            text = doubtful.read.text
            known = text in others or any(text in whole for whole in own)
            known = known or not (believed or doubtful.read.believed)
            if not known and not any(_lies_on(doubtful, label) for label in believed):
                looks[doubtful.read.symbology, text] += times
        return tuple(UndecidedCode(*code, times) for code, times in looks.most_common())

    def fill(self, state: LocationState) -> PlaceFill | None:
        """How full the place is by all looks, if it is in this state."""
        return self._fills.together(state)

    def _found(
        self, state: LocationState, confidence: float, pose: BodyPose, believed: Sequence[PlacedRead] = ()
    ) -> Finding:
        """The finding, with the time and place of the last look."""
        return Finding(
            stamp_ns=pose.stamp_ns,
            location=self._location,
            state=state,
            confidence=round(confidence, 4),
            reads=tuple(placed.read for placed in believed),
            evidence=self._evidence,
            node=self._node,
            x_m=pose.x_m,
            y_m=pose.y_m,
            height_m=pose.height_m,
            yaw_rad=pose.yaw_rad,
            fill=self.fill(state),
        )

    def _believed(self) -> tuple[tuple[PlacedRead, ...], bool]:
        """The reads that may count, and whether one label was read as different texts: then none does."""
        believed = self._votes.believed()
        often = [one for one in believed if one.read.sure and self._votes.frames(one) >= self._least]
        believed = tuple(one for one in believed if not any(self._is_slip(one, other) for other in often))
        torn = any(
            one.read.text != other.read.text and _is_one_label(one, other)
            for one, other in combinations(believed, 2)
        )
        return (() if torn else believed), torn

    def _is_slip(self, one: PlacedRead, other: PlacedRead) -> bool:
        """Whether the label that is `other`, vouched for by its checksum in several frames, was misread in a
        single one: half of an EAN-13 that the picture's edge cuts off is a UPC-E by its bars."""
        once = not one.read.sure and self._votes.frames(one) == 1
        return once and one.read.text != other.read.text and _is_one_label(one, other)


def _counts(placed: PlacedRead) -> bool:
    """Whether a believed read is a finding: one frame alone is no proof of what no checksum vouches for."""
    return placed.read.sure or placed.read.agreeing >= LEAST_FRAMES


def _lies_on(doubtful: PlacedRead, label: PlacedRead) -> bool:
    """Whether what was not believed is on a label: its middle or, of what may be a part of a longer code, any
    of it."""
    reach = (label.size_m + (0.0 if doubtful.read.whole else doubtful.size_m)) / 2
    return abs(doubtful.x_m - label.x_m) < reach and abs(doubtful.height_m - label.height_m) < reach


def _is_one_label(one: PlacedRead, other: PlacedRead) -> bool:
    reach = _SAME_LABEL * min(one.size_m, other.size_m)
    return abs(one.x_m - other.x_m) < reach and abs(one.height_m - other.height_m) < reach
