"""When a schedule's runs are due: over both changes of daylight saving, reboots, and a clock that jumps."""

from __future__ import annotations

from datetime import UTC, date, datetime, time, timedelta
from zoneinfo import ZoneInfo

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.core.errors import InputError
from flightd.fleet.schedule.due import decide
from flightd.fleet.schedule.local_time import instant_of
from flightd.fleet.schedule.rule import Quiet, Rule

MINUTE, HOUR, DAY = timedelta(minutes=1), timedelta(hours=1), timedelta(days=1)
CHANGES = {
    "Europe/Berlin": (date(2026, 3, 29), date(2026, 10, 25)),
    "America/New_York": (date(2026, 3, 8), date(2026, 11, 1)),
    "Australia/Lord_Howe": (date(2026, 10, 4), date(2026, 4, 5)),
}
"""The days on which the clocks go forward and back."""
TIMES = st.builds(time, st.integers(0, 23), st.sampled_from((0, 1, 15, 30, 45, 59)))
ZONES = st.sampled_from(sorted(CHANGES))


def utc(text: str) -> datetime:
    return datetime.fromisoformat(text).replace(tzinfo=UTC)


def walked(day: date, at: time, zone: ZoneInfo) -> datetime:
    """The first minute of the world at which the zone's clocks show the time, or have skipped it."""
    wall, now = datetime.combine(day, at), datetime.combine(day, at, tzinfo=UTC) - 15 * HOUR
    skipped: datetime | None = None
    for _ in range(30 * 60):
        shown = now.astimezone(zone).replace(tzinfo=None)
        if shown == wall:
            return now
        skipped = now if skipped is None and shown > wall else skipped
        now += MINUTE
    assert skipped is not None
    return skipped


@pytest.mark.parametrize(
    ("zone", "day", "at", "instant"),
    [
        ("Europe/Berlin", "2026-03-29", "01:59", "2026-03-29T00:59"),
        ("Europe/Berlin", "2026-03-29", "02:30", "2026-03-29T01:00"),  # skipped: 02:00 is 03:00
        ("Europe/Berlin", "2026-10-25", "02:30", "2026-10-25T00:30"),  # the first of two
        ("Europe/Berlin", "2026-10-25", "03:00", "2026-10-25T02:00"),
        ("America/New_York", "2026-03-08", "02:00", "2026-03-08T07:00"),
        ("America/New_York", "2026-11-01", "01:30", "2026-11-01T05:30"),
        ("Australia/Lord_Howe", "2026-10-04", "02:15", "2026-10-03T15:30"),  # by half an hour
        ("Australia/Lord_Howe", "2026-04-05", "01:45", "2026-04-04T14:45"),
        ("Pacific/Apia", "2011-12-30", "22:00", "2011-12-30T10:00"),  # a day that was left out
        ("UTC", "2026-03-29", "02:30", "2026-03-29T02:30"),
    ],
)
def test_a_skipped_time_is_the_next_there_is_and_of_two_the_first(
    zone: str, day: str, at: str, instant: str
) -> None:
    found = instant_of(date.fromisoformat(day), time.fromisoformat(at), ZoneInfo(zone))
    assert found == utc(instant)


@settings(max_examples=60)
@given(ZONES, st.booleans(), st.integers(-1, 1), TIMES)
def test_an_instant_is_the_first_at_which_the_clocks_have_come_to_it(
    name: str, forward: bool, off: int, at: time
) -> None:
    zone, day = ZoneInfo(name), CHANGES[name][not forward] + off * DAY
    assert instant_of(day, at, zone) == walked(day, at, zone)


def test_tuesdays_at_ten_stay_at_ten_by_the_clock_on_the_wall() -> None:
    rule = Rule(at=time(22), zone="Europe/Berlin", weekdays=frozenset({2}))
    found = rule.next_occurrences(utc("2026-03-20T00:00"), 3)
    assert [one.at for one in found] == [
        utc("2026-03-24T21:00"), utc("2026-03-31T20:00"), utc("2026-04-07T20:00"),
    ]  # fmt: skip


def test_every_third_day_is_counted_from_the_first() -> None:
    rule = Rule(at=time(22), zone="UTC", every_days=3, first=date(2026, 1, 1))
    found = rule.next_occurrences(utc("2025-12-01T00:00"), 3)
    assert [one.day for one in found] == [date(2026, 1, 1), date(2026, 1, 4), date(2026, 1, 7)]


def test_a_run_that_was_missed_gives_way_to_the_next_one() -> None:
    rule = Rule(at=time(22), zone="UTC", window=3 * DAY)
    since, now = utc("2026-01-01T00:00"), utc("2026-01-04T21:00")
    decision = decide(rule, since, (), (), now)
    assert decision.due is not None
    assert decision.due.day == date(2026, 1, 3)
    assert [one.day for one in decision.missed] == [date(2026, 1, 1), date(2026, 1, 2)]
    assert decide(rule, since, (), {date(2026, 1, 1), date(2026, 1, 2)}, now).missed == ()


def test_nothing_is_due_of_the_time_before_a_schedule_was_made() -> None:
    rule = Rule(at=time(22), zone="UTC", weekdays=frozenset({2}))
    decision = decide(rule, utc("2026-01-06T22:30"), (), (), utc("2026-01-06T22:31"))
    assert (decision.due, decision.missed) == (None, ())


def test_in_quiet_hours_nothing_starts_and_after_them_what_was_due_does() -> None:
    rule = Rule(at=time(22), zone="UTC", window=4 * HOUR, quiet=(Quiet(time(21), time(1)),))
    since = utc("2026-01-01T00:00")
    assert decide(rule, since, (), (), utc("2026-01-06T23:59")).is_quiet
    later = decide(rule, since, (), (), utc("2026-01-07T01:00"))
    assert not later.is_quiet
    assert later.due is not None
    assert later.due.day == date(2026, 1, 6)


@pytest.mark.parametrize(
    ("wrong", "complaint"),
    [
        ({"zone": "Europe/Nowhere"}, "no time zone that this machine knows"),
        ({"zone": "Europe"}, "no time zone that this machine knows"),
        ({"zone": "../etc/passwd"}, "no time zone that this machine knows"),
        ({"weekdays": frozenset({8})}, "weekdays are 1"),
        ({"every_days": 0}, "every 1 to 366 days"),
        ({"every_days": 7, "first": date(2026, 1, 5), "weekdays": frozenset({2})}, "no such day"),
        ({"window": MINUTE}, "5 minutes to 6 days"),
        ({"quiet": (Quiet(time(21), time(3)),)}, "quiet all the time"),
        ({"quiet": (Quiet(time(21), time(21)),)}, "different times"),
        ({"first": date(1999, 1, 1)}, "first day"),
    ],
)
def test_a_rule_by_which_nothing_would_start_is_refused(wrong: dict[str, object], complaint: str) -> None:
    with pytest.raises(InputError, match=complaint):
        Rule(**{"at": time(22), "zone": "UTC", **wrong})  # type: ignore[arg-type]


class Station:
    """It decides each minute or so by a clock that may say anything; what it orders outlasts it."""

    def __init__(self, rule: Rule, since: datetime) -> None:
        self.rule, self.since = rule, since
        self.ordered: set[date] = set()
        self.told: set[date] = set()
        self.starts: list[date] = []
        self.was_up: set[date] = set()

    def tick(self, now: datetime) -> None:
        decision = decide(self.rule, self.since, self.ordered, self.told, now)
        self.told |= {one.day for one in decision.missed}
        if decision.due is not None and not decision.is_quiet:
            self.ordered.add(decision.due.day)
            self.starts.append(decision.due.day)
        for one in self.rule.occurrences(now - 8 * DAY, now + MINUTE):
            if one.at <= now < one.until and one.at >= self.since and not self.rule.is_quiet(now):
                self.was_up.add(one.day)


MOVES = st.lists(
    st.one_of(
        st.tuples(st.just("on"), st.integers(1, 90)),
        st.tuples(st.just("off"), st.integers(1, 3 * 24 * 60)),
        st.tuples(st.just("jump"), st.integers(-2 * 24 * 60, 2 * 24 * 60)),
        st.tuples(st.just("jump"), st.sampled_from((-60, -30, 30, 60, -1))),
    ),
    max_size=40,
)


@settings(max_examples=150)
@given(
    ZONES, st.booleans(), TIMES, st.integers(5, 30 * 60), MOVES,
    st.sampled_from(((), (Quiet(time(6), time(20)),), (Quiet(time(1), time(2, 30)),))),
)  # fmt: skip
def test_each_run_is_started_once_if_the_station_was_up_in_its_window_and_else_never(
    zone: str, forward: bool, at: time, window: int, moves: list[tuple[str, int]], quiet: tuple[Quiet, ...]
) -> None:
    try:
        rule = Rule(at=at, zone=zone, window=window * MINUTE, quiet=quiet)
    except InputError:
        return  # quiet all the time
    now = datetime.combine(CHANGES[zone][not forward] - 2 * DAY, time(12), tzinfo=UTC)
    station = Station(rule, now)
    for kind, minutes in moves:
        if kind == "on":
            for _ in range(0, minutes, 15):
                station.tick(now)
                now += 15 * MINUTE
        else:  # switched off meanwhile, or the clock is set
            now += minutes * MINUTE
        station.tick(now)
    assert len(station.starts) == len(set(station.starts)), "twice"
    assert set(station.starts) == station.was_up
    assert not station.was_up - station.ordered
