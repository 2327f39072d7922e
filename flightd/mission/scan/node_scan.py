"""The scan of one node: view after view until each location there has its one state."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from flightd.config.scan import ScanConfig
from flightd.core.scanning import Finding, Light, Occupancy, PictureWorth
from flightd.mission.scan.code_assignment import PlacedRead, ShelfLook
from flightd.mission.scan.code_votes import SeenRead
from flightd.mission.scan.location_votes import LocationVotes
from flightd.mission.scan.views import View, ViewPlanner

_SAME_EXPOSURE = 0.01
_GIVES_UP = 2
"""So many views of a node that are not reached: what keeps the drone from those keeps it from the others."""


class NoAnswer(enum.StrEnum):
    """Why nothing is known of a location that was to be looked at."""

    NO_PICTURE = "no picture came"
    NOT_SHOWN = "no picture showed them"
    NOT_REACHED = "not reached in time"


class ScanTask:
    """Pure state machine.  Fly to `view`, `begin` there, `take` what the pictures show, `step` until the
    view is over; then `view` is the next one, None when nothing is left.  `drain` gives new findings.

    With `relights` other exposures are tried; it turns false where the camera does not follow."""

    def __init__(
        self,
        node: str,
        views: Sequence[View],
        planner: ViewPlanner,
        params: ScanConfig,
        relights: bool = True,
        passed: Mapping[str, Sequence[SeenRead]] = MappingProxyType({}),
    ) -> None:
        """`passed` is what was read at locations in passing."""
        self.node = node
        self.relights = relights
        self._views = list(views)
        self._planner = planner
        self._params = params
        self._open: dict[str, LocationVotes] = {
            code: LocationVotes(code, node, params.pictures, passed.get(code, ()))
            for view in views
            for code in view.locations
        }
        self._owners: dict[str, set[str]] = {}
        """Where each text was read that is believed."""
        self._usual = [view.exposure for view in views]
        self._begun_ns: int | None = None
        self._relit = False
        self._followed = self._unfollowed = 0
        self._misses = 0
        self._looked = False
        """A picture of the view that is looked from came, or of an earlier look at the same places."""
        self._findings: list[Finding] = []
        self._unanswered: dict[str, NoAnswer] = {}

    @property
    def view(self) -> View | None:
        """Where to look from now."""
        return self._views[0] if self._views else None

    @property
    def since_ns(self) -> int | None:
        """Pictures exposed from then on count, None while the view is not reached."""
        return self._begun_ns

    @property
    def looking(self) -> tuple[str, ...]:
        """The locations that pictures are wanted of now."""
        view = self.view
        if view is None or self._begun_ns is None:
            return ()
        return self._left(view)

    def kept(self, code: str) -> PictureWorth:
        """What the picture of an undecided location is worth that is kept of it."""
        return self._open[code].kept

    def begin(self, now_ns: int) -> None:
        """The view is reached and the drone at rest."""
        self._begun_ns = now_ns
        self._followed = self._unfollowed = 0

    def take(self, look: ShelfLook) -> None:
        """One picture; those exposed on the way to the view tell nothing."""
        view = self.view
        if view is None or self._begun_ns is None or look.pose.stamp_ns < self._begun_ns:
            return
        if not math.isclose(look.codes.exposure, view.exposure, rel_tol=_SAME_EXPOSURE):
            self._unfollowed += 1
            return
        self._followed += 1
        self._looked = True
        places = {place.location: place for place in look.codes.places}
        reads: dict[str, list[PlacedRead]] = {}
        for placed in look.reads:
            reads.setdefault(placed.location, []).append(placed)
            if placed.location and placed.read.believed:
                self._owners.setdefault(placed.read.text, set()).add(placed.location)
        doubtful = {placed.likeliest for placed in look.reads if not placed.location}
        for code in self._left(view):
            place, own = places.get(code), reads.get(code, [])
            if place is not None and code in doubtful:  # somebody's code: not an empty place
                place = replace(place, occupancy=Occupancy.GOODS, light=Light.FAIR)
            self._open[code].add(look.codes.frame_seq, look.pose, place, own)
            self._settle(code, final=False)

    def step(self, now_ns: int) -> bool:
        """True when the view is over; the next one, or another look at what is left of it, comes first."""
        view = self.view
        if view is None:
            return True
        if self._begun_ns is None:
            return False
        left = self._left(view)
        waiting = any(not self._open[code].exhausted for code in left)
        if waiting and (now_ns - self._begun_ns) * 1e-9 < self._params.view_s:
            return False
        self._begun_ns = None
        again = self._again(view, left)
        if again is not None:
            self._views[0] = again
            return True
        self._end(left, NoAnswer.NOT_SHOWN if self._looked else NoAnswer.NO_PICTURE)
        return True

    def miss(self) -> tuple[str, ...]:
        """The view cannot be reached, and after the second one none is flown to any more.  The locations that
        were to be looked at; they are decided as far as they were seen."""
        self._misses += 1
        given_up = self._views[: None if self._misses >= _GIVES_UP else 1]
        missed: tuple[str, ...] = ()
        for view in given_up:
            left = self._left(view)
            missed += left
            self._end(left, NoAnswer.NOT_REACHED)
        return missed

    def _end(self, left: Sequence[str], why: NoAnswer) -> None:
        """Go on to the next view; nothing else is to be learnt of these locations, and `why` not if so."""
        self._relit = self._looked = False
        for code in left:
            self._settle(code, final=True)
            if self._open.pop(code, None) is not None:
                self._unanswered[code] = why
        self._views.pop(0)
        self._usual.pop(0)

    def _again(self, view: View, left: Sequence[str]) -> View | None:
        """Another look at what is left of a view: once with another exposure, then from other places."""
        lights = {code: self._open[code].light for code in left}
        if view.exposure != 1.0 and self._unfollowed and not self._followed:
            self.relights = False
            self._usual = [1.0] * len(self._views)
            self._views = [replace(one, exposure=1.0) for one in self._views]
            if not self._relit:  # nothing was looked at yet
                return self._views[0]
        if self.relights and not self._relit:
            relit = self._planner.relit(view, lights)
            self._relit = relit is not None
            if relit is not None:
                return relit
        if not (self.relights and Light.FAIR in lights.values()):
            view = replace(view, exposure=self._usual[0])
        return self._planner.retake(view, left)

    @property
    def evidence(self) -> tuple[str, ...]:
        """The best pictures of what is not decided yet."""
        return tuple(votes.evidence for votes in self._open.values())

    def drain(self) -> tuple[Finding, ...]:
        """The locations decided since the last call."""
        found, self._findings = tuple(self._findings), []
        return found

    def drain_unanswered(self) -> dict[str, NoAnswer]:
        """The locations since the last call that nothing more is to be learnt of, without a finding."""
        unanswered, self._unanswered = self._unanswered, {}
        return unanswered

    def _left(self, view: View) -> tuple[str, ...]:
        return tuple(code for code in view.locations if code in self._open)

    def _settle(self, code: str, final: bool) -> None:
        others = {text for text, places in self._owners.items() if places - {code}}
        finding = self._open[code].finding(final, others)
        if finding is not None:
            del self._open[code]
            self._findings.append(finding)
