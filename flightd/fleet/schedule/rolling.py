"""Which nodes a run takes where all of a site is to be counted within some days: exceptions first."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta


@dataclass(frozen=True, slots=True)
class NodeCount:
    """What is known of a node's places: whether one of them is an exception (what was counted last says that
    nobody knows what is there), and when the oldest count was (None: one was never counted)."""

    node: str
    exception: bool
    counted: datetime | None


def run_nodes(
    counts: Sequence[NodeCount], now: datetime, within: timedelta, following: Sequence[datetime]
) -> tuple[str, ...]:
    """The nodes of a run now, given all of a site in the order of its aisles and the times of the `following`
    runs: exceptions, then what else is counted, each in that order.

    Besides the exceptions it is an even share of all over the runs that lie `within` the days, those never
    counted first, then the oldest; and whatever would be older than that at the next run."""
    first = [one for one in counts if one.exception]
    others = [one for one in counts if not one.exception]
    runs = 1 + sum(at < now + within for at in following)
    share = math.ceil(len(counts) / runs)
    next_at = following[0] if following else now + within
    oldest = sorted(others, key=lambda one: (one.counted is not None, one.counted or now))
    overdue = {one.node for one in others if one.counted is not None and one.counted + within < next_at}
    chosen = overdue | {one.node for one in oldest[:share]}
    return tuple(one.node for one in (*first, *(one for one in others if one.node in chosen)))
