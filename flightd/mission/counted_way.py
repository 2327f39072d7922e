"""How the count leads the route: past shelves, back to what was left open, and on."""

from __future__ import annotations

from flightd.mission.guidance import MissionInputs
from flightd.mission.plan.flight_plan import Stop
from flightd.mission.plan.itinerary import Itinerary
from flightd.mission.scan.shelf_scan import ShelfScan


class CountedWay:
    """Brings to the route what the scan of the shelves asks of it."""

    def __init__(self, route: Itinerary, scan: ShelfScan) -> None:
        self._route = route
        self._scan = scan

    def step(self, s: MissionInputs, goal: Stop, *, returning: bool) -> None:
        """What is flown past is decided."""
        self._scan.step(s, goal)
        if returning:
            self._count_again(s.now_ns, returning=True)

    def lead_on(self, now_ns: int, goal: Stop) -> None:
        """Before the next stop is chosen: fly past the shelves that lie ahead, or stop before what the legs
        past them left open, and at what is to be counted again."""
        if self._scan.legs:
            self._route.sweep(now_ns, self._scan.begin_sweep())
        elif goal.sweep is not None and goal.sweep.last:
            self._scan.end_sweep(now_ns)
            self._route.visit_undecided(now_ns)
        self._count_again(now_ns, returning=False)

    def advance(self, s: MissionInputs, goal: Stop) -> None:
        """To the next stop."""
        self._route.advance(s.pose, either_side=self._scan.is_scanned(goal))

    def rejoin(self, s: MissionInputs, *, returning: bool) -> None:
        """Go on from where the drone turned out to be."""
        if s.pose is not None:
            self._route.recount(s.now_ns, self._scan.take_due(), returning=returning)
            self._route.rejoin(s.now_ns, s.pose)

    def _count_again(self, now_ns: int, *, returning: bool) -> None:
        """Nodes whose count was taken back are visited again, or left for the next battery."""
        if self._scan.sweeping:
            return
        due = self._scan.take_due()
        if returning:
            self._route.recount(now_ns, due, returning=True)
        else:
            self._route.recount_next(now_ns, due)
