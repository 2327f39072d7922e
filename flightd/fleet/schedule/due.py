"""What is due now, and what was missed: a pure function of rule, record and clock.

Nothing of it remembers the clock.  A run that was ordered is in the record by its local date and never comes
again, whichever way the clock jumps; one that was missed comes again only if the clock does: then its time
had not come before.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from datetime import date, datetime, timedelta

from flightd.fleet.schedule.rule import MOST_WINDOW, Occurrence, Rule

LOOK_BACK = timedelta(days=31)
"""What was missed longer ago is told no more."""


@dataclass(frozen=True, slots=True)
class Decision:
    """`due`: the run that may start now; `is_quiet`: but not in these hours; `missed`: those whose
    time is over without a start, oldest first, not yet told."""

    due: Occurrence | None
    is_quiet: bool
    missed: tuple[Occurrence, ...]


def decide(
    rule: Rule, since: datetime, ordered: Collection[date], told: Collection[date], now: datetime
) -> Decision:
    """`since`: when the schedule was made or changed, before which nothing was due; `ordered`: the days whose
    run was ordered; `told`: those that were told as missed."""
    begin = max(since, now - LOOK_BACK - MOST_WINDOW)
    due: Occurrence | None = None
    missed = []
    for one in rule.occurrences(begin, now + timedelta(microseconds=1)):
        if one.day in ordered:
            continue
        if now < one.until:
            due = one
        elif one.day not in told and one.until > now - LOOK_BACK:
            missed.append(one)
    return Decision(due, rule.is_quiet(now), tuple(missed))
