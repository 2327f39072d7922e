"""What lies in a folder, delivered to a store.  Nothing is noted at the sender: the store is asked what it
has, so a delivery that was cut anywhere goes on where it was, from read-only media, too.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeVar

from flightd.adapters.store.for_reading import opened_for_reading
from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.errors import InputError
from flightd.core.inventory import Observation, PlannedLocation
from flightd.ground.decision_book import Decision
from flightd.ground.flights.flight_row import FlightRow, read_rows
from flightd.ground.flights.log_folder import FoundLog, path_of
from flightd.ground.ground_store.batch import (
    MOST_LOOKS,
    Batch,
    Receipt,
    SentDecision,
    SentFlight,
    SentLook,
)

_BEGINNING = 1 << 16
"""Bytes of a log by which its flight is known: time, drone, map and configuration stand there."""
_ASKED_AT_ONCE = 50
"""Pictures."""
_NS = 1_000_000_000
_T = TypeVar("_T")


class Target(Protocol):
    """Where it goes.  UnavailableError where that cannot be had: the same again goes on."""

    def standings(self, looks: Sequence[str]) -> dict[str, int]:
        """As `GroundStore.standings`."""
        ...

    def missing_pictures(self, names: Sequence[str]) -> set[str]:
        """As `GroundStore.missing_pictures`."""
        ...

    def keep_picture(self, jpeg: bytes) -> str:
        """As `GroundStore.keep_picture`."""
        ...

    def take(self, batch: Batch) -> Receipt:
        """As `GroundStore.take`."""
        ...


@dataclass(slots=True)
class Delivered:
    """What a delivery came to."""

    looks: int = 0
    """New in the store."""
    changed: int = 0
    """Confirmed or withdrawn since."""
    already: int = 0
    pictures: int = 0
    flights: int = 0
    decisions: int = 0
    ahead: int = 0
    """Left where they are: of a time that has not come yet where the store is."""

    def add(self, receipt: Receipt) -> None:
        self.looks += receipt.new
        self.changed += receipt.changed
        self.already += receipt.already
        self.ahead += receipt.ahead

    def check_clocks(self) -> None:
        """InputError where looks were left."""
        if self.ahead:
            raise InputError(
                "looks of a time that has not come yet stay here: the clock of drone or store is wrong",
                remedy="set it; what was counted by a wrong one is counted again, in another folder",
            )


def deliver_inventory(folder: Path, site: str, source: str, target: Target, done: Delivered) -> None:
    """All looks of an inventory, with their pictures; each batch is in the store before the next is sent."""
    with opened_for_reading(folder, untouched=True) as inventory:
        records = inventory.locations()
        planned_ns = max((record.observation.utc_ns for record in records if record.observation), default=0)
        planned = [PlannedLocation(record.code, record.node, record.pallets_deep) for record in records]
        looks = inventory.looks()
        for places in _parts(planned):
            target.take(Batch(site, source, places=tuple(places), planned_ns=planned_ns))
        for part in _parts(looks):
            kept = target.standings([seen.id for seen, _ in part])
            missing = [
                SentLook(seen, standing) for seen, standing in part if standing > kept.get(seen.id, -1)
            ]
            done.already += len(part) - len(missing)
            if missing:
                done.pictures += _keep_pictures(inventory, [look.observation for look in missing], target)
                done.add(target.take(Batch(site, source, looks=tuple(missing))))


def _keep_pictures(inventory: SqliteStore, looks: Sequence[Observation], target: Target) -> int:
    """Before the looks that name them; a picture that the sender has no longer is not waited for."""
    names = {seen.evidence for seen in looks if seen.evidence}
    sent = 0
    for name in missing_pictures(names, target):
        path = inventory.evidence.path(name)
        if path.is_file():
            target.keep_picture(path.read_bytes())
            sent += 1
    return sent


def missing_pictures(names: Iterable[str], target: Target) -> Iterator[str]:
    """Those that the target has not.  It is asked of few at once: it may look for each in turn where a way
    there and back is long, within the time that an answer may take."""
    asked = sorted(names)
    for begin in range(0, len(asked), _ASKED_AT_ONCE):
        yield from sorted(target.missing_pictures(asked[begin : begin + _ASKED_AT_ONCE]))


def deliver_flights(
    logs: Sequence[FoundLog], site: str, source: str, target: Target, done: Delivered
) -> bool:
    """Every flight that is over; each is of its own log's site, else of `site`.  Whether all are: one whose
    log was written just now may be cut off there, and that log never changes again."""
    by_site: dict[str, list[SentFlight]] = {}
    all_over = True
    for log, row in zip(logs, read_rows(tuple(logs)), strict=True):
        all_over &= not row.running
        if row.outcome and not row.running and (row.site or site):
            by_site.setdefault(row.site or site, []).append(_flight(log, row))
    for name, flights in by_site.items():
        for part in _parts(flights):
            target.take(Batch(name, source, flights=tuple(part)))
            done.flights += len(part)
    return all_over


def _flight(log: FoundLog, row: FlightRow) -> SentFlight:
    with path_of(log.root, log.relative).open("rb") as stream:
        beginning = stream.read(_BEGINNING)
    return SentFlight(
        hashlib.sha256(beginning).hexdigest(), row.drone, stored_ns(row.started_s), row.duration_s,
        row.mission, row.outcome, row.reason, row.verdict, row.nodes_planned, row.nodes_visited,
    )  # fmt: skip


def stored_ns(utc_s: float) -> int:
    """A point in time that a store keeps, whatever a clock said."""
    return min(max(round(utc_s * _NS), 0), (1 << 63) - 1)


def deliver_decisions(
    decisions: Sequence[Decision], site: str, source: str, target: Target, done: Delivered
) -> None:
    """What people decided about places of a site."""
    sent = [SentDecision(d.id, d.place, d.utc_ns, d.seen_ns, d.what.value, d.who, d.note) for d in decisions]
    for part in _parts(sent):
        target.take(Batch(site, source, decisions=tuple(part)))
        done.decisions += len(part)


def _parts(items: Sequence[_T]) -> Iterator[Sequence[_T]]:
    for begin in range(0, len(items), MOST_LOOKS):
        yield items[begin : begin + MOST_LOOKS]
