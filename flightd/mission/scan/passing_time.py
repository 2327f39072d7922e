"""How long it takes to count the nodes of an aisle in passing: each has its share.  Pure."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from flightd.mission.plan.leg_times import Pace
from flightd.mission.scan.sweep_planner import SweepPlanner


class PassingTime:
    """By the legs of `sweeps`; `node_of` has the node from which each location is counted, `aisle_of` where
    each node is."""

    def __init__(self, sweeps: SweepPlanner, node_of: Mapping[str, str], aisle_of: Mapping[str, str]) -> None:
        self._sweeps, self._node_of, self._aisle_of = sweeps, node_of, aisle_of
        self._of: tuple[tuple[str, ...], frozenset[str], Pace] | None = None
        self._share_s: dict[str, float] = {}

    def share_s(self, node: str, left_at: Callable[[str], frozenset[str]], pace: Pace) -> float:
        """Of a node, where the locations `left_at` each node of its aisle are counted; 0 where it is not
        flown past for one of them."""
        nodes = tuple(other for other, of in self._aisle_of.items() if of == self._aisle_of[node])
        left = frozenset(code for other in nodes for code in left_at(other))
        of = nodes, left, pace
        if of != self._of:  # asked of one node of an aisle after the other
            passes = list(self._sweeps.stop_by_stop(nodes, left, 0.0, pace.height_m))
            counted = {self._node_of[code] for legs in passes for leg in legs for code in leg.locations}
            share_s = sum(self._sweeps.seconds(legs, pace, 0.0) for legs in passes) / max(len(counted), 1)
            self._of, self._share_s = of, dict.fromkeys(counted, share_s)
        return self._share_s.get(node, 0.0)
