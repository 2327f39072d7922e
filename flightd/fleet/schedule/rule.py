"""When a schedule starts: days, a time of day, a zone, quiet hours, and how late a run may still start."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, date, datetime, time, timedelta
from functools import cached_property
from zoneinfo import ZoneInfo

from flightd.core.errors import InputError
from flightd.fleet.schedule.local_time import instant_of, zone_of

LEAST_WINDOW, MOST_WINDOW = timedelta(minutes=5), timedelta(days=6)
MOST_DAYS = 366
EARLIEST, LATEST = date(2024, 1, 1), date(2100, 12, 31)
_DAY = timedelta(days=1)
_MINUTE = timedelta(minutes=1)
_CYCLE_DAYS = 7 * MOST_DAYS


@dataclass(frozen=True, slots=True)
class Quiet:
    """Hours of every day, by the local clock, in which nothing starts; `end` may be of the next day."""

    begin: time
    end: time

    def covers(self, at: time) -> bool:
        """Whether it is quiet then."""
        if self.begin <= self.end:
            return self.begin <= at < self.end
        return at >= self.begin or at < self.end


@dataclass(frozen=True, slots=True)
class Occurrence:
    """A run of a schedule, by its local date: it may start from `at` (UTC) until `until`."""

    day: date
    at: datetime
    until: datetime


@dataclass(frozen=True)
class Rule:
    """Days on which a run starts at the local time `at`: those of `weekdays` (1 Monday to 7 Sunday; none:
    any), and of these every `every_days`-th counted from `first`.

    A run may start late by less than `window`, never at or after the next one's time, and not in the `quiet`
    hours.  InputError for a rule by which nothing ever starts."""

    at: time
    zone: str
    weekdays: frozenset[int] = frozenset()
    every_days: int = 1
    first: date = EARLIEST
    window: timedelta = timedelta(hours=2)
    quiet: tuple[Quiet, ...] = ()

    def __post_init__(self) -> None:
        zone_of(self.zone)
        if not self.weekdays <= frozenset(range(1, 8)):
            raise InputError("weekdays are 1 (Monday) to 7 (Sunday)")
        if not 1 <= self.every_days <= MOST_DAYS:
            raise InputError(f"every 1 to {MOST_DAYS} days, not every {self.every_days}")
        if not LEAST_WINDOW <= self.window <= MOST_WINDOW:
            raise InputError("a run may start 5 minutes to 6 days late")
        if any(hours.begin == hours.end for hours in self.quiet):
            raise InputError("quiet hours begin and end at different times")
        if not EARLIEST <= self.first <= LATEST:
            raise InputError(f"the first day is one of {EARLIEST.year} to {LATEST.year}")
        if all(self._is_quiet_at(minute) for minute in self._minutes()):
            raise InputError("it is quiet all the time in which a run may start", remedy="give it longer")
        if self.next_day(self.first) is None:
            raise InputError("there is no such day", remedy="give other weekdays, or every day")

    @cached_property
    def _zone(self) -> ZoneInfo:
        return zone_of(self.zone)

    def is_quiet(self, now: datetime) -> bool:
        """Whether nothing starts now."""
        return self._is_quiet_at(now.astimezone(self._zone).time())

    def is_on(self, day: date) -> bool:
        """Whether a run is of this local day."""
        return (
            day >= self.first
            and (day - self.first).days % self.every_days == 0
            and (not self.weekdays or day.isoweekday() in self.weekdays)
        )

    def next_day(self, day: date) -> date | None:
        """The first day of a run at or after `day`; None: there is none."""
        for ahead in range(_CYCLE_DAYS):
            later = day + timedelta(days=ahead)
            if self.is_on(later):
                return later
        return None

    def occurrences(self, begin: datetime, end: datetime) -> Iterator[Occurrence]:
        """Those whose time is in [begin, end), in order of their days."""
        day = max(self.first, begin.astimezone(self._zone).date() - 2 * _DAY)
        last = end.astimezone(self._zone).date() + _DAY
        while day <= last:
            if self.is_on(day):
                at = instant_of(day, self.at, self._zone)
                if begin <= at < end:
                    yield Occurrence(day, at, self._until(day, at))
            day += _DAY

    def next_occurrences(self, now: datetime, most: int) -> list[Occurrence]:
        """The first ones from `now` on."""
        found: list[Occurrence] = []
        day = self.next_day(max(self.first, now.astimezone(self._zone).date() - 2 * _DAY))
        while day is not None and len(found) < most:
            at = instant_of(day, self.at, self._zone)
            if at >= now:
                found.append(Occurrence(day, at, self._until(day, at)))
            day = self.next_day(day + _DAY)
        return found

    def of_days(self, first: date, days: int) -> Iterator[Occurrence]:
        """Those of so many local days from `first` on."""
        for day in (first + ahead * _DAY for ahead in range(days)):
            if self.is_on(day):
                at = instant_of(day, self.at, self._zone)
                yield Occurrence(day, at, self._until(day, at))

    def clock(self, at: datetime) -> datetime:
        """What the clocks of its zone show then: later than its own time where they skip that."""
        return at.astimezone(self._zone).replace(tzinfo=None)

    def _until(self, day: date, at: datetime) -> datetime:
        """The end of a run's window: the next run takes its place."""
        for ahead in range(1, self.window.days + 3):
            later = day + timedelta(days=ahead)
            if self.is_on(later):
                return min(at + self.window, instant_of(later, self.at, self._zone))
        return at + self.window

    def _is_quiet_at(self, at: time) -> bool:
        return any(hours.covers(at) for hours in self.quiet)

    def _minutes(self) -> Iterator[time]:
        """The times of day at which a run may start, by the minute."""
        begin = datetime.combine(EARLIEST, self.at, tzinfo=UTC)
        for minute in range(min(self.window, _DAY) // _MINUTE):
            yield (begin + minute * _MINUTE).time()
