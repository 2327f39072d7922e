"""A schedule as it is sent and kept, and the rule that it is."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date, time, timedelta
from functools import lru_cache
from typing import Annotated, TypeAlias

import msgspec
from msgspec import Meta

from flightd.core.errors import InputError
from flightd.core.planned_flight import MOST_NODES
from flightd.fleet.schedule.rule import EARLIEST, MOST_DAYS, Quiet, Rule
from flightd.ground.valued_nodes import ByValue

_Name = Annotated[str, Meta(min_length=1, max_length=80)]
_Clock = Annotated[str, Meta(pattern=r"^([01]\d|2[0-3]):[0-5]\d$")]
_Aisle = Annotated[str, Meta(pattern="^[A-Z]{1,3}$")]
_Levels = Annotated[tuple[Annotated[int, Meta(ge=1, le=99)], ...], Meta(max_length=99)]


class CountMission(msgspec.Struct, frozen=True, tag="mission", tag_field="kind", forbid_unknown_fields=True):
    """A mission that is kept, by its id, as it is when the run starts."""

    mission: Annotated[str, Meta(min_length=8, max_length=64)]


class CountAisles(msgspec.Struct, frozen=True, tag="aisles", tag_field="kind", forbid_unknown_fields=True):
    """All nodes of some aisles that face a place, and of their shelves these levels (none: all)."""

    aisles: Annotated[tuple[_Aisle, ...], Meta(min_length=1, max_length=MOST_NODES)]
    levels: _Levels = ()


class CountAll(msgspec.Struct, frozen=True, tag="all", tag_field="kind", forbid_unknown_fields=True):
    """All of the site within some days, exceptions first: each run a share, by the ground store."""

    within_days: Annotated[int, Meta(ge=1, le=MOST_DAYS)]


class CountByValue(ByValue, frozen=True, tag="value", tag_field="kind", forbid_unknown_fields=True):
    """What is worth most when the run starts, exceptions first: by the ground store and the books."""


CountOfList: TypeAlias = CountMission | CountAisles | CountAll
Count: TypeAlias = CountOfList | CountByValue


class QuietHours(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Hours of the day in which nothing starts; `end` may be of the next day."""

    begin: _Clock
    end: _Clock


class Kept(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A schedule: `drone` counts `count` on `site`, on `weekdays` (1 Monday to 7 Sunday; none: all), of these
    every `every_days`-th day from `first`, at the local time `at`, at most `late_minutes` later."""

    site: Annotated[str, Meta(min_length=1, max_length=80)]
    name: _Name
    drone: Annotated[str, Meta(min_length=1, max_length=64)]
    count: Count
    at: _Clock
    zone: Annotated[str, Meta(min_length=1, max_length=64)]
    weekdays: Annotated[tuple[Annotated[int, Meta(ge=1, le=7)], ...], Meta(max_length=7)] = ()
    every_days: Annotated[int, Meta(ge=1, le=MOST_DAYS)] = 1
    first: date = EARLIEST
    late_minutes: Annotated[int, Meta(ge=5, le=6 * 24 * 60)] = 120
    quiet: Annotated[tuple[QuietHours, ...], Meta(max_length=8)] = ()
    enabled: bool = True

    def checked(self) -> Kept:
        """With its words trimmed.  InputError for a schedule by which nothing would ever start, or that says
        twice how much is counted."""
        rule_of(self)
        if isinstance(self.count, CountByValue):
            self.count.check()
        name = " ".join(self.name.split())
        if not name:
            raise InputError("a schedule needs a name")
        return msgspec.structs.replace(self, name=name)


@dataclass(frozen=True, slots=True)
class Schedule:
    """A schedule under its id; `since_ns` (UTC) is when it was kept: what was due before is none of its
    runs."""

    id: str
    kept: Kept
    since_ns: int

    @property
    def rule(self) -> Rule:
        """InputError where this machine does not know its zone any more."""
        return rule_of(self.kept)


@lru_cache(maxsize=256)
def rule_of(kept: Kept) -> Rule:
    """InputError for one by which nothing starts."""
    return Rule(
        at=time.fromisoformat(kept.at),
        zone=kept.zone,
        weekdays=frozenset(kept.weekdays),
        every_days=kept.every_days,
        first=kept.first,
        window=timedelta(minutes=kept.late_minutes),
        quiet=tuple(Quiet(time.fromisoformat(q.begin), time.fromisoformat(q.end)) for q in kept.quiet),
    )
