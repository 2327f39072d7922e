"""How old the count of each place is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

from flightd.core.inventory import LocationRecord, LocationState, Observation, Standing
from flightd.inventory.place_view import Look


@dataclass(frozen=True, slots=True)
class PlaceAge:
    """`seen_ns` is the newest look at the place that counts, `counted_ns` the newest that said what is there;
    None where there is none.  `age_s` is since the latter."""

    location: str
    state: LocationState
    seen_ns: int | None
    counted_ns: int | None
    age_s: float | None


def place_ages(records: Sequence[LocationRecord], looks: Sequence[Look], now_ns: int) -> tuple[PlaceAge, ...]:
    """Every place, in the order of `records`, at `now_ns` UTC."""
    counted: dict[str, Observation] = {}
    for seen, standing in sorted(looks, key=lambda look: look[0].utc_ns):
        if standing is Standing.CONFIRMED and seen.state.is_counted:
            counted[seen.location] = seen
    return tuple(_age(record, counted.get(record.code), now_ns) for record in records)


def median_age_s(ages: Sequence[PlaceAge]) -> float | None:
    """Of the places that were ever counted; None where none was."""
    known = [age.age_s for age in ages if age.age_s is not None]
    return median(known) if known else None


def _age(record: LocationRecord, counted: Observation | None, now_ns: int) -> PlaceAge:
    seen_ns = record.observation.utc_ns if record.observation else None
    if counted is None:
        return PlaceAge(record.code, record.state, seen_ns, None, None)
    age_s = max(now_ns - counted.utc_ns, 0) / 1e9
    return PlaceAge(record.code, record.state, seen_ns, counted.utc_ns, age_s)
