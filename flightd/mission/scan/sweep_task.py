"""The count of an aisle in passing: pictures of leg after leg, merged place by place.  Pure."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import permutations

from flightd.config.scan import ScanConfig
from flightd.core.geometry import wrap_pi
from flightd.core.scanning import NO_PICTURE, BodyPose, Finding, PictureWorth
from flightd.mission.plan.sweep_leg import SweepLeg
from flightd.mission.scan.code_assignment import PlacedRead, ShelfLook
from flightd.mission.scan.code_votes import SeenRead
from flightd.mission.scan.sweep_votes import SweepVotes, Undecided
from flightd.site.shelf_cells import Cell

_FACES_RAD = math.radians(15.0)
"""A picture counts while the nose is so near to the shelf's direction."""
_AT_HEIGHT_M = 0.15
"""And the drone so near to the leg's height: between two levels labels of both are cut off."""
_GONE_NS = 1_500_000_000
"""A place that was in no picture for so long has been flown past."""


class SweepTask:
    """Call `begin` where legs are flown, `fly` with each leg in its turn, `take` with what the pictures show,
    `step` at each tick, `end` after the last leg.  `drain` gives what was decided since.

    A picture counts for the leg from whose height, and facing whose side, it was taken; where several are so
    near to each other, for the one that was flown then."""

    def __init__(
        self,
        legs: Sequence[SweepLeg],
        cells: Mapping[str, Cell],
        node_of: Callable[[str], str],
        params: ScanConfig,
        share: Callable[[str, float, float], float],
    ) -> None:
        """`share` is the most of a location that can be seen from a height with a heading."""
        self._legs = tuple(legs)
        self._cells = cells
        self._params = params
        self._node_of = node_of
        self._share = share
        self._votes: dict[str, SweepVotes] = {}
        self._closed: set[str] = set()
        self._flown: set[str] = set()
        self._findings: list[Finding] = []
        self._owners: dict[str, set[str]] = {}
        self._apart: set[tuple[str, str, str]] = set()
        self._glimpsed: dict[str, int] = {}
        self._since_ns: int | None = None
        self._turns: list[tuple[int, SweepLeg]] = []
        """From when on each leg was flown, in the order in which they were."""
        self.undecided: dict[str, Undecided] = {}
        """Places that were flown past and not decided, and why."""
        self.passed: dict[str, tuple[SeenRead, ...]] = {}
        """What was read at these, but for what surely belongs elsewhere."""

    @property
    def looking(self) -> bool:
        """Whether pictures are wanted now."""
        return self._since_ns is not None

    def begin(self, now_ns: int) -> None:
        """Legs are flown, or flown on after an interruption: pictures exposed from now on count."""
        if self._since_ns is None:
            self._since_ns = now_ns

    def fly(self, now_ns: int, leg: SweepLeg) -> None:
        """This leg is flown to, or along, from now on."""
        if not self._turns or self._turns[-1][1] != leg:
            self._turns.append((now_ns, leg))

    def pause(self) -> None:
        """The leg is interrupted: no picture counts until it goes on."""
        self._since_ns = None

    def forget(self) -> None:
        """The place was in doubt: what is not decided yet counts for nothing."""
        for code in self._votes:
            self.undecided[code] = Undecided.DOUBTED
            self._closed.add(code)
        self._votes.clear()
        self.passed.clear()
        self.pause()

    def leg_at(self, pose: BodyPose) -> SweepLeg | None:
        """The leg that a picture taken at `pose` counts for."""
        if self._since_ns is None or pose.stamp_ns < self._since_ns:
            return None
        near = [
            leg
            for leg in self._legs
            if abs(wrap_pi(pose.yaw_rad - leg.yaw_rad)) < _FACES_RAD
            and abs(leg.height_m - pose.height_m) < _AT_HEIGHT_M
        ]
        flown = next((leg for from_ns, leg in reversed(self._turns) if from_ns <= pose.stamp_ns), None)
        if flown in near:
            return flown
        return min(near, key=lambda leg: abs(leg.height_m - pose.height_m), default=None)

    def near(self, pose: BodyPose) -> tuple[str, ...]:
        """The locations that a picture taken at `pose` is wanted of: what is not decided."""
        leg = self.leg_at(pose)
        return () if leg is None else tuple(code for code in leg.locations if code not in self._closed)

    def kept(self, code: str) -> PictureWorth:
        """What the picture of a location is worth that is kept of it."""
        votes = self._votes.get(code)
        return NO_PICTURE if votes is None else votes.kept

    def take(self, look: ShelfLook) -> None:
        """One picture."""
        pose = look.pose
        leg = self.leg_at(pose)
        if leg is None:
            return
        places = {place.location: place for place in look.codes.places}
        reads: dict[str, list[PlacedRead]] = {}
        doubtful: dict[str, set[str]] = {}
        for placed in look.reads:
            if placed.location:
                reads.setdefault(placed.location, []).append(placed)
            else:
                doubtful.setdefault(placed.likeliest, set()).add(placed.read.text)
        self._note_owners(look.reads)
        for code in leg.locations:
            place, own = places.get(code), reads.get(code, [])
            if code in self._closed or (place is None and not own):
                continue
            cell = self._cells[code]
            middle_m = (cell.x0_m + cell.x1_m) / 2
            bearing = math.atan2(middle_m - pose.x_m, max(abs(cell.y_m - pose.y_m), 0.1))
            self._votes_of(code, leg).add(
                look.codes.frame_seq, pose, place, own, bearing_rad=bearing, doubtful=doubtful.get(code, ())
            )

    def step(self, now_ns: int) -> None:
        """Decide what has been flown past.  What was seen too little, such as on a turn before its leg, may
        still be flown past."""
        gone = {c: v.newest_ns for c, v in self._votes.items() if 0 < v.newest_ns < now_ns - _GONE_NS}
        fresh = [code for code, newest_ns in gone.items() if self._glimpsed.get(code) != newest_ns]
        self._pass(fresh, leave=Undecided.UNSEEN)
        self._glimpsed = {code: newest_ns for code, newest_ns in gone.items() if code in self._votes}

    def flown(self, leg: SweepLeg) -> None:
        """The end of this leg is reached."""
        self._flown.update(leg.locations)

    def end(self) -> None:
        """No leg follows: decide what was seen, or should have been.  What hangs beside legs that were not
        flown is left to fly past."""
        self._pass([*self._votes, *(self._flown - self._votes.keys())])
        self.pause()

    def drain(self) -> tuple[Finding, ...]:
        """The locations decided since the last call."""
        found, self._findings = tuple(self._findings), []
        return found

    @property
    def evidence(self) -> tuple[str, ...]:
        """The best pictures of what is not decided yet."""
        return tuple(votes.evidence for votes in self._votes.values())

    @property
    def outcome(self) -> str:
        """How many places are not decided, and why."""
        why = Counter(self.undecided.values())
        left = ", ".join(f"{count} {reason}" for reason, count in sorted(why.items()))
        return f"{why.total()} places to stop before" + (f": {left}" if left else "")

    def _votes_of(self, code: str, leg: SweepLeg) -> SweepVotes:
        if code not in self._votes:
            share = self._share(code, leg.height_m, leg.yaw_rad)
            self._votes[code] = SweepVotes(code, self._node_of(code), self._params, share)
        return self._votes[code]

    def _pass(self, codes: Iterable[str], leave: Undecided | None = None) -> None:
        """These are out of the picture: each is decided, or left for a stop; nothing becomes of those that
        would be left for the reason `leave`."""
        gone = [code for code in codes if code not in self._closed]
        verdicts = {code: self._verdict(code) for code in gone}
        for code, verdict in verdicts.items():
            if leave is not None and verdict is leave:
                continue
            self._closed.add(code)
            votes = self._votes.pop(code, None)
            if isinstance(verdict, Finding):
                self._findings.append(verdict)
                continue
            self.undecided[code] = verdict
            if votes is not None and verdict is not Undecided.ELSEWHERE:
                self.passed[code] = tuple(
                    seen for seen in votes.reads if not self._owners.get(seen[0].read.text, set()) - {code}
                )

    def _verdict(self, code: str) -> Finding | Undecided:
        votes = self._votes.get(code)
        if votes is None:
            return Undecided.UNSEEN
        verdict = votes.verdict(self._owners)
        if isinstance(verdict, Finding) and any(
            self._is_elsewhere(code, read.text) for read in verdict.reads
        ):
            return Undecided.ELSEWHERE
        return verdict

    def _note_owners(self, reads: Iterable[PlacedRead]) -> None:
        """Where each code was seen; two places that one picture shows the same code at have a label each."""
        seen: dict[str, set[str]] = {}
        for placed in reads:
            if placed.location and placed.read.believed:
                seen.setdefault(placed.read.text, set()).add(placed.location)
        for text, places in seen.items():
            self._owners.setdefault(text, set()).update(places)
            self._apart.update((text, *pair) for pair in permutations(sorted(places), 2))

    def _is_elsewhere(self, code: str, text: str) -> bool:
        """Whether a neighbour shows the same text, and no picture shows it at both."""
        mine = self._cells[code]
        return any(
            _are_neighbours(mine, self._cells[other]) and (text, code, other) not in self._apart
            for other in self._owners.get(text, ())
            if other != code
        )


def _are_neighbours(one: Cell, other: Cell) -> bool:
    """Whether a label of one place may have been taken for the other's."""
    same = (one.aisle, one.side) == (other.aisle, other.side)
    wide_m = max(one.x1_m - one.x0_m, other.x1_m - other.x0_m)
    beside = one.x0_m < other.x1_m + wide_m / 2 and other.x0_m < one.x1_m + wide_m / 2
    above = one.low_m <= other.high_m and other.low_m <= one.high_m
    return same and beside and above
