"""The motions of one kind of drone as the search wants them: flat tuples of whole numbers, and the motions
themselves at their ends."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import TypeAlias

from flightd.fleet.traffic.motions import Act, Motion, MotionNet, Part
from flightd.fleet.traffic.sections import NONE, sections_of

Sweep: TypeAlias = tuple[int, int, int]
"""A resource, and when it is taken from and to after the start of the motion."""
Step: TypeAlias = tuple[int, int, int, tuple[Sweep, ...], Motion]
"""Target, its vertex, duration, what is swept, the motion."""


class StepTable:
    """Of a configuration made when that is first asked for, or before, and kept as long as the net is."""

    def __init__(self, net: MotionNet) -> None:
        self._net = net
        self._steps: dict[int, tuple[Step, ...]] = {}
        self._through: dict[int, tuple[tuple[Step, ...], int]] = {}
        self.stop_ms = net.stop_ms if net.ramps_fit else 0
        """A stop is surely left where the drone moves."""
        self.launch_ms = net.launch_ms if net.ramps_fit else 0
        """The same for a launch where it stands over another node than the goal's."""
        over: dict[str, list[int]] = {}
        for i, vertex in enumerate(net.lanes.vertices):
            over.setdefault(vertex.node, []).append(i)
        self._beside: Sequence[Sequence[int]] = [over[vertex.node] for vertex in net.lanes.vertices]

    def prepare(self) -> None:
        """Make all that is asked for: a third of the first plans' time, for which drones would wait.  Nobody
        flies through a section from inside it."""
        for configuration in range(len(self._beside) << 3):
            make = self.through if self.sections[configuration >> 3] == NONE else self.onward
            make(configuration)

    def onward(self, configuration: int) -> tuple[Step, ...]:
        """Every motion that begins there.  A turn sweeps nothing but the air in which the drone is safe
        anyhow."""
        found = self._steps.get(configuration)
        if found is None:
            found = tuple(_step(motion) for motion in self._net.onward(configuration))
            self._steps[configuration] = found
        return found

    def through(self, configuration: int) -> tuple[tuple[Step, ...], int]:
        """The same without stops in sections of aisles far from any crossing: those are flown through in one
        step.  With the section that is entered, NONE where there is none."""
        found = self._through.get(configuration)
        if found is None:
            entered = NONE
            steps: list[Step] = []
            for step in self.onward(configuration):
                section = self.sections[step[1]]
                if section == NONE:
                    steps.append(step)
                    continue
                entered = section
                if step[0] & 1:
                    steps += map(_step, self._flown_through(step[4]))
            found = self._through[configuration] = tuple(steps), entered
        return found

    def _flown_through(self, motion: Motion) -> Iterator[Motion]:
        """A motion that ends moving, and cruising on until the section is left, or to a stop beyond it."""
        parts = list(motion.parts)
        target, passed_ms = motion.target, motion.duration_ms
        while True:
            cruise: Motion | None = None
            for following in self._net.onward(target):
                if self.sections[following.target >> 3] == NONE:
                    all_parts = *parts, *_later(following.parts, passed_ms)
                    yield Motion(following.target, passed_ms + following.duration_ms, all_parts)
                elif following.target & 1:
                    cruise = following
            if cruise is None:
                return
            parts += _later(cruise.parts, passed_ms)
            target, passed_ms = cruise.target, passed_ms + cruise.duration_ms

    @cached_property
    def sections(self) -> Sequence[int]:
        """The section of each vertex, or NONE."""
        return sections_of(self._net.lanes)

    def beside(self, vertex: int) -> Sequence[int]:
        """The vertices over the same node, itself among them."""
        return self._beside[vertex]


def _later(parts: Sequence[Part], by_ms: int) -> list[Part]:
    return [Part(p.act, p.resource, p.vertex, p.in_ms + by_ms, p.out_ms + by_ms) for p in parts]


def _step(motion: Motion) -> Step:
    vertex = motion.target >> 3
    sweeps = tuple(
        (part.resource, part.in_ms, part.out_ms)
        for part in motion.parts
        if part.act is not Act.TURN or part.resource != vertex
    )
    return motion.target, vertex, motion.duration_ms, sweeps, motion
