"""All figures of an inventory over time, as one document."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from flightd.core.errors import InputError
from flightd.core.inventory import LocationRecord
from flightd.core.utc_time import utc_text
from flightd.inventory.kpis.place_ages import PlaceAge, median_age_s, place_ages
from flightd.inventory.kpis.read_rates import ReadRate, ReadRates, read_rates
from flightd.inventory.kpis.run_changes import ChangeKind, PlaceChange, run_changes
from flightd.inventory.kpis.run_figures import RunFigures, counted_of_run, run_figures
from flightd.inventory.place_view import Look

_HOUR_S = 3600.0


@dataclass(frozen=True, slots=True)
class Kpis:
    """What `flightd inventory kpis` tells.  `compared` are the two runs between which `changes` are, None
    where there are no two."""

    runs: tuple[RunFigures, ...]
    rates: ReadRates
    ages: tuple[PlaceAge, ...]
    compared: tuple[str, str] | None
    changes: tuple[PlaceChange, ...]


def kpis_of(
    records: Sequence[LocationRecord],
    looks: Sequence[Look],
    now_ns: int,
    earlier: str | None = None,
    later: str | None = None,
) -> Kpis:
    """The figures at `now_ns` UTC; changes between the runs `earlier` and `later`, left out the newest two.

    InputError for a run that there is not."""
    runs = run_figures(looks)
    compared = _compared([run.run for run in runs], earlier, later)
    changes: tuple[PlaceChange, ...] = ()
    if compared is not None:
        changes = run_changes(*(counted_of_run(looks, run) for run in compared))
    return Kpis(runs, read_rates(looks), place_ages(records, looks, now_ns), compared, changes)


def _compared(runs: Sequence[str], earlier: str | None, later: str | None) -> tuple[str, str] | None:
    for option, run in (("--from", earlier), ("--to", later)):
        if run is not None and run not in runs:
            known = ", ".join(runs) or "none"
            raise InputError("is no run of this inventory", key=f"{option} {run}", remedy=f"known: {known}")
    last = later if later is not None else (runs[-1] if runs else None)
    before = [run for run in runs if run != last]
    if last is not None and later is not None and earlier is None:
        before = list(runs[: runs.index(last)])
    first = earlier if earlier is not None else (before[-1] if before else None)
    return None if first is None or last is None else (first, last)


def change_counts(changes: Sequence[PlaceChange]) -> dict[ChangeKind, int]:
    """How many places there are of each kind, all kinds named."""
    counts = Counter(change.kind for change in changes)
    return {kind: counts[kind] for kind in ChangeKind}


def kpi_document(kpis: Kpis) -> dict[str, object]:
    """As JSON: times in UTC, ages in hours, shares from 0 to 1; null for what cannot be known."""
    return {
        "runs": [_run(run) for run in kpis.runs],
        "read_rate": {
            "symbology": {name: _rate(rate) for name, rate in kpis.rates.by_symbology.items()},
            "module": {name: _rate(rate) for name, rate in kpis.rates.by_module.items()},
        },
        "age": {
            "never_counted": sum(age.counted_ns is None for age in kpis.ages),
            "median_h": _hours(median_age_s(kpis.ages)),
            "oldest_h": _hours(max((age.age_s for age in kpis.ages if age.age_s is not None), default=None)),
        },
        "places": [_place(age) for age in kpis.ages],
        "changes": _changes(kpis),
    }


def _run(run: RunFigures) -> dict[str, object]:
    pace = run.locations_per_hour
    return {
        "run": run.run,
        "first": utc_text(run.first_ns),
        "last": utc_text(run.last_ns),
        "looks": run.looks,
        "withdrawn": run.withdrawn,
        "locations": run.locations,
        "states": {state.value: count for state, count in run.states.items()},
        "hours": round(run.hours, 4),
        "locations_per_hour": None if pace is None else round(pace, 1),
        "retake_share": round(run.retake_share, 4),
    }


def _rate(rate: ReadRate) -> dict[str, object]:
    share = rate.share
    return {
        "codes": rate.codes,
        "looks": rate.looks,
        "read": rate.read,
        "share": None if share is None else round(share, 4),
    }


def _place(age: PlaceAge) -> dict[str, object]:
    return {
        "location": age.location,
        "state": age.state.value,
        "last_seen": None if age.seen_ns is None else utc_text(age.seen_ns),
        "last_counted": None if age.counted_ns is None else utc_text(age.counted_ns),
        "age_h": _hours(age.age_s),
    }


def _changes(kpis: Kpis) -> dict[str, object] | None:
    if kpis.compared is None:
        return None
    told = [change for change in kpis.changes if change.kind is not ChangeKind.SAME]
    return {
        "from": kpis.compared[0],
        "to": kpis.compared[1],
        "counts": {kind.value: count for kind, count in change_counts(kpis.changes).items()},
        "places": [
            {
                "location": change.location,
                "change": change.kind.value,
                "before": list(change.before),
                "after": list(change.after),
                "moved_from": dict(change.moved_from),
                "moved_to": dict(change.moved_to),
            }
            for change in told
        ],
    }


def _hours(seconds: float | None) -> float | None:
    return None if seconds is None else round(seconds / _HOUR_S, 2)
