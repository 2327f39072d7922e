"""The figures of each run: how much it counted, how fast, how much of it twice."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from flightd.core.inventory import LocationState, Observation, Standing
from flightd.inventory.place_view import Look

_LONGEST_WAY_NS: Final = 180 * 10**9
"""Between two looks of a flight at most; what is longer is a change of the battery, or another flight."""


@dataclass(frozen=True, slots=True)
class RunFigures:
    """One run.  `locations` are those with a look that counts, in the `states` that the run's newest one
    gives; `looked_again` those that it looked at more than once: also those that it had flown past and left
    open, of which only the second look is there; `withdrawn` looks count for nothing.

    `hours` are those between its looks without the breaks, on the way in and home not counted."""

    run: str
    first_ns: int
    last_ns: int
    looks: int
    withdrawn: int
    locations: int
    looked_again: int
    states: dict[LocationState, int]
    hours: float

    @property
    def locations_per_hour(self) -> float | None:
        """None for looks of one moment."""
        return self.locations / self.hours if self.hours else None

    @property
    def retake_share(self) -> float:
        """Of the locations that were looked at."""
        return self.looked_again / self.locations if self.locations else 0.0


def run_figures(looks: Sequence[Look]) -> tuple[RunFigures, ...]:
    """Every run that is known, in the order of their last looks."""
    by_run: defaultdict[str, list[Look]] = defaultdict(list)
    for look in looks:
        by_run[look[0].run].append(look)
    return tuple(sorted(map(_figures, by_run.values()), key=lambda run: (run.last_ns, run.run)))


def counted_of_run(looks: Sequence[Look], run: str) -> dict[str, Observation]:
    """The newest look of a run at each location that counts, in the order in which they were taken."""
    return {seen.location: seen for seen, standing in _in_order(looks) if _counts(seen, standing, run)}


def _counts(seen: Observation, standing: Standing, run: str) -> bool:
    return standing is Standing.CONFIRMED and seen.run == run


def _in_order(looks: Sequence[Look]) -> list[Look]:
    return sorted(looks, key=lambda look: (look[0].utc_ns, look[0].id))


def _figures(looks: Sequence[Look]) -> RunFigures:
    run = looks[0][0].run
    times = sorted(seen.utc_ns for seen, _ in looks)
    counted = counted_of_run(looks, run)
    per_place = Counter(seen.location for seen, _ in looks)
    again = {seen.location for seen, _ in looks if seen.again}
    flown_ns = sum(gap for a, b in pairwise(times) if (gap := b - a) <= _LONGEST_WAY_NS)
    return RunFigures(
        run=run,
        first_ns=times[0],
        last_ns=times[-1],
        looks=len(looks),
        withdrawn=sum(standing is Standing.WITHDRAWN for _, standing in looks),
        locations=len(counted),
        looked_again=sum(per_place[place] > 1 or place in again for place in counted),
        states=dict(Counter(seen.state for seen in counted.values())),
        hours=flown_ns / 3.6e12,
    )
