"""What a drone is to do, piece by piece with its time: the plan of one drone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flightd.fleet.traffic.motions import Act, Motion


@dataclass(frozen=True, slots=True)
class Stop:
    """A vertex to stop at, and for how long something is done there: that takes the `column` of air."""

    vertex: int
    column: int
    dwell_ms: int


@dataclass(frozen=True, slots=True)
class Action:
    """One resource taken from `start_ms` to `end_ms`; then the drone is at `vertex` with the heading
    `quarter`.  `moving`: it may leave that at cruising speed, if the next action is released in time."""

    act: Act
    resource: int
    vertex: int
    quarter: int
    start_ms: int
    end_ms: int
    moving: bool = False

    def __post_init__(self) -> None:
        if self.end_ms <= self.start_ms:
            raise ValueError(f"an action from {self.start_ms} to {self.end_ms} ms takes no time")

    @property
    def duration_ms(self) -> int:
        return self.end_ms - self.start_ms


@dataclass(frozen=True, slots=True)
class Plan:
    """Actions one after the other, with pauses at rest between; it ends where the drone may stay for good."""

    actions: tuple[Action, ...]

    @property
    def end_ms(self) -> int:
        """When the last action is done; 0 for a plan to stay."""
        return self.actions[-1].end_ms if self.actions else 0


def actions_of(motion: Motion, start_ms: int) -> list[Action]:
    """The parts of a motion begun at a time."""
    quarter = motion.target >> 1 & 3
    last = len(motion.parts) - 1
    return [
        Action(
            part.act,
            part.resource,
            part.vertex,
            quarter,
            start_ms + part.in_ms,
            start_ms + part.out_ms,
            moving=i < last or bool(motion.target & 1),
        )
        for i, part in enumerate(motion.parts)
    ]


def occupancy(
    actions: Sequence[Action], place: int, from_ms: int, until_ms: int
) -> list[tuple[int, int, int]]:
    """(resource, from, to) of everything that a drone takes which stands on the vertex `place` from `from_ms`
    on, flies its actions, and stands at their end until `until_ms`."""
    taken: list[tuple[int, int, int]] = []
    at, since_ms = place, from_ms
    for action in actions:
        if action.start_ms > since_ms:
            taken.append((at, since_ms, action.start_ms))
        taken.append((action.resource, action.start_ms, action.end_ms))
        at, since_ms = action.vertex, action.end_ms
    if until_ms > since_ms:
        taken.append((at, since_ms, until_ms))
    return taken
