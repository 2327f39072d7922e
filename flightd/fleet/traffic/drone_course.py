"""One drone as traffic knows it: what it has done, was released to, and has ahead."""

from __future__ import annotations

from dataclasses import dataclass, field

from flightd.fleet.traffic.plan import Action, Stop


@dataclass(slots=True)
class DroneCourse:
    """One drone: `done` of its actions are done, `released` are released, both counted over its whole life;
    `ahead` are those that are not done.  `stops` are left to be visited."""

    place: int
    quarter: int = 0
    done: int = 0
    released: int = 0
    since_ms: int = 0
    ahead: list[Action] = field(default_factory=list)
    stops: tuple[Stop, ...] = ()
    ends: tuple[int, ...] = ()
    wreck: frozenset[int] = frozenset()
    roams: bool = False
    doubt_m: float = 0.0
    doubt_since_ms: int = 0
    late_ms: int = 0
    priority: float = 0.0

    @property
    def failed(self) -> bool:
        """It does not fly by this traffic any more, or somebody else's will has it (`roams`); `wreck` is
        where it may be."""
        return bool(self.wreck)

    @property
    def base(self) -> list[Action]:
        """Released and not done."""
        return self.ahead[: self.released - self.done]

    @property
    def tail(self) -> list[Action]:
        """Not released."""
        return self.ahead[self.released - self.done :]

    @property
    def base_end(self) -> int:
        """The vertex at which its base ends."""
        return self.base[-1].vertex if self.base else self.place

    @property
    def is_pushed_aside(self) -> bool:
        """What is not released ends where it may not stay for good."""
        return bool(self.tail) and self.ahead[-1].vertex not in self.ends

    @property
    def air(self) -> list[int]:
        """Every resource on which the drone may be now, for all that is known."""
        return [self.place, *(action.resource for action in self.base)]
