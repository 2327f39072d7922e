"""The motions of one kind of drone as the search wants them: flat tuples of whole numbers, and the motions
themselves at their ends."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

from flightd.fleet.traffic.motions import Act, Motion, MotionNet

Sweep: TypeAlias = tuple[int, int, int]
"""A resource, and when it is taken from and to after the start of the motion."""
Step: TypeAlias = tuple[int, int, int, tuple[Sweep, ...], Motion]
"""Target, its vertex, duration, what is swept, the motion."""


class StepTable:
    """Made when a configuration is first asked for, kept as long as the net is."""

    def __init__(self, net: MotionNet) -> None:
        self._net = net
        self._steps: dict[int, tuple[Step, ...]] = {}
        self.stop_ms = net.stop_ms if net.ramps_fit else 0
        """A stop is surely left where the drone moves."""
        self.launch_ms = net.launch_ms if net.ramps_fit else 0
        """The same for a launch where it stands over another node than the goal's."""
        over: dict[str, list[int]] = {}
        for i, vertex in enumerate(net.lanes.vertices):
            over.setdefault(vertex.node, []).append(i)
        self._beside: Sequence[Sequence[int]] = [over[vertex.node] for vertex in net.lanes.vertices]

    def onward(self, configuration: int) -> tuple[Step, ...]:
        """Every motion that begins there.  A turn sweeps nothing but the air in which the drone is safe
        anyhow."""
        found = self._steps.get(configuration)
        if found is None:
            found = tuple(_step(motion) for motion in self._net.onward(configuration))
            self._steps[configuration] = found
        return found

    def left_ms(
        self, rest_ms: Sequence[int], goal: int, weight: float
    ) -> tuple[Sequence[float], Sequence[float]]:
        """What is left from each vertex, at rest and moving, times `weight`, when cruising there takes
        `rest_ms`; a stop and a launch are sure where the goal is over another node."""
        stop_ms, ramps_ms = self.stop_ms, self.launch_ms + self.stop_ms
        resting = [weight * (left + ramps_ms) for left in rest_ms]
        for vertex in self._beside[goal]:
            resting[vertex] = weight * rest_ms[vertex]
        return resting, [weight * (left + stop_ms) for left in rest_ms]


def _step(motion: Motion) -> Step:
    vertex = motion.target >> 3
    sweeps = tuple(
        (part.resource, part.in_ms, part.out_ms)
        for part in motion.parts
        if part.act is not Act.TURN or part.resource != vertex
    )
    return motion.target, vertex, motion.duration_ms, sweeps, motion
