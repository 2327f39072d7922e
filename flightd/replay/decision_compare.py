"""Fly a recorded flight again, tick by tick, through today's code and compare every decision.

The record of a tick is all that the pilot was given then, so the same code decides the same, on another
processor but for the last digits of its sums.  A larger difference is a change of behaviour: wanted or not,
it is told with its size.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any, TypeAlias

import msgspec
import numpy as np

from flightd.core.errors import InputError
from flightd.core.tick import TickInput, TickOutput
from flightd.core.topics import Topic
from flightd.replay.log import FlightLog, recorded_tick

Step: TypeAlias = Callable[[TickInput], TickOutput]

_SHOWN_CHARS = 40


@dataclass(frozen=True, slots=True)
class Drift:
    """One field of the decisions that came out otherwise.

    `largest` is the largest difference of its numbers in the field's own unit, infinite where
    something that is no number differs; `recorded` and `replayed` are the first pair.
    """

    field: str
    ticks: int
    first_s: float
    largest: float
    recorded: str
    replayed: str


@dataclass(frozen=True, slots=True)
class Comparison:
    """`missing` ticks have no decision in the log or the other way round: the record has gaps."""

    ticks: int
    differing: int
    missing: int
    drifts: tuple[Drift, ...]

    @property
    def identical(self) -> bool:
        return not self.differing and not self.missing

    def within(self, tolerance: float) -> bool:
        """Whether nothing is missing and no field drifts by more than `tolerance`."""
        return not self.missing and all(drift.largest <= tolerance for drift in self.drifts)

    def complaint(self, tolerance: float) -> str:
        """What drifts by more, or is missing; empty for nothing."""
        if self.missing:
            return f"{self.missing} ticks or decisions are missing in the log"
        return "" if self.within(tolerance) else f"{self.differing} of {self.ticks} decisions drift"


def comparison_document(comparison: Comparison) -> dict[str, Any]:
    """The comparison as JSON has it; a difference of what is no number has no `largest`."""
    return {
        "ticks": comparison.ticks,
        "identical": comparison.identical,
        "differing": comparison.differing,
        "missing": comparison.missing,
        "drift": [
            asdict(drift) | {"largest": drift.largest if math.isfinite(drift.largest) else None}
            for drift in comparison.drifts
        ],
    }


def replay_decisions(log: FlightLog, step: Step) -> Comparison:
    """Give `step` (of a fresh pilot) every recorded tick and compare its outputs with the record.  The last
    tick of a log that was cut off, where that came before its decision, is none of a record with gaps.

    InputError if the log holds no ticks or they are not what this version records.
    """
    ticks = [entry for entry in log.entries if entry.topic == Topic.TICK]
    recorded = {entry.stamp_ns: entry.message for entry in log.entries if entry.topic == Topic.DECISION}
    if not ticks:
        raise InputError("holds no ticks to replay: an older version recorded it", file=log.path)
    if log.is_cut and len(ticks) > 1 and ticks[-1].stamp_ns not in recorded:
        ticks.pop()
    start_ns = ticks[0].stamp_ns
    found: dict[str, list[_Difference]] = {}
    differing = missing = 0
    for entry in ticks:
        replayed = _plain(step(recorded_tick(log.path, entry.message)))
        decision = recorded.pop(entry.stamp_ns, None)
        if decision is None:
            missing += 1
        elif here := list(_differences(decision, replayed, (entry.stamp_ns - start_ns) / 1e9)):
            differing += 1
            worst: dict[str, _Difference] = {}
            for difference in here:
                before = worst.get(difference.field)
                if before is None or difference.size > before.size:
                    worst[difference.field] = difference
            for field, difference in worst.items():
                found.setdefault(field, []).append(difference)
    drifts = tuple(_drift(field, differences) for field, differences in found.items())
    return Comparison(len(ticks), differing, missing + len(recorded), drifts)


@dataclass(frozen=True, slots=True)
class _Difference:
    field: str
    time_s: float
    size: float
    recorded: Any
    replayed: Any


def _drift(field: str, differences: list[_Difference]) -> Drift:
    first = differences[0]
    return Drift(
        field=field,
        ticks=len(differences),
        first_s=round(first.time_s, 3),
        largest=max(difference.size for difference in differences),
        recorded=_shown(first.recorded),
        replayed=_shown(first.replayed),
    )


def _shown(value: object) -> str:
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return text if len(text) <= _SHOWN_CHARS else text[: _SHOWN_CHARS - 1] + "\u2026"


def _plain(output: TickOutput) -> object:
    """The output as it would stand in a log."""
    return msgspec.json.decode(msgspec.json.encode(output, enc_hook=_number))


def _number(value: object) -> object:
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise TypeError(f"a {type(value).__name__} cannot be compared")


def _differences(recorded: Any, replayed: Any, time_s: float, field: str = "") -> Iterator[_Difference]:
    """The leaves in which two JSON values differ; all items of a list count as one field.  What an older
    version did not tell yet is none."""
    if recorded == replayed:
        return
    if isinstance(recorded, dict) and isinstance(replayed, dict):
        for key in recorded:
            inner = f"{field}.{key}" if field else key
            yield from _differences(recorded.get(key), replayed.get(key), time_s, inner)
    elif isinstance(recorded, list) and isinstance(replayed, list) and len(recorded) == len(replayed):
        for before, after in zip(recorded, replayed, strict=True):
            yield from _differences(before, after, time_s, f"{field}[]")
    else:
        yield _Difference(field, time_s, _distance(recorded, replayed), recorded, replayed)


def _distance(recorded: object, replayed: object) -> float:
    if isinstance(recorded, bool) or isinstance(replayed, bool):
        return math.inf
    if isinstance(recorded, int | float) and isinstance(replayed, int | float):
        return abs(float(recorded) - float(replayed))
    return math.inf
