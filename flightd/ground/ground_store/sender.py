"""What lies in a folder, delivered to a store.  Nothing is noted at the sender: the store is asked what it
has, so a delivery that was cut anywhere goes on where it was, from read-only media, too.
"""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol, TypeVar

import msgspec

from flightd.adapters.store.for_reading import copied_for_reading
from flightd.adapters.store.kept_looks import KeptLook
from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.errors import InputError
from flightd.ground.decision_book import Decision
from flightd.ground.flights.flight_row import FlightRow, read_rows
from flightd.ground.flights.log_folder import FoundLog, path_of
from flightd.ground.ground_store.batch import (
    MOST_BATCH_BYTES,
    MOST_LOOKS,
    Batch,
    Receipt,
    SentDecision,
    SentFlight,
    SentLook,
)
from flightd.ground.ground_store.reads_text import NOTHING_PRINTED, printed_text, says_more
from flightd.vision.shelf.evidence_jpeg import MOST_BYTES, picture_name

_AROUND_BYTES = 1 << 16
"""Of a batch, what is not its items."""
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

    def printed_texts(self, looks: Sequence[str]) -> dict[str, str]:
        """As `GroundStore.printed_texts`."""
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
    """Confirmed or withdrawn since, or more was found printed."""
    already: int = 0
    pictures: int = 0
    flights: int = 0
    decisions: int = 0
    ahead: int = 0
    """Left where they are: of a time that has not come yet where the store is."""
    failures: list[str] = field(default_factory=list)
    """What could not be delivered, a line for each."""

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
    """All looks of an inventory, with their pictures; each batch is in the store before the next is sent.
    InputError where no `site` is known."""
    if not site:
        raise InputError(
            "nothing says of which site the inventory is",
            file=folder,
            remedy="deliver it with --site NAME, or FLIGHTD_SITE",
        )
    target.standings(())  # nothing is copied, every ten minutes, for one that is away
    with copied_for_reading(folder) as inventory:
        planned_ns = inventory.newest_ns()
        for places in _parts(inventory.planned()):
            target.take(Batch(site, source, places=tuple(places), planned_ns=planned_ns))
        for part in inventory.parts(MOST_LOOKS):
            missing = lacking(part, target)
            done.already += len(part) - len(missing)
            unread = _keep_pictures(inventory, missing, target, done)
            ready = [look for look in missing if look.evidence not in unread]
            for looks in _parts([SentLook(*look) for look in inventory.loaded(ready)]):
                done.add(target.take(Batch(site, source, looks=tuple(looks))))


def lacking(looks: Sequence[KeptLook], target: Target) -> list[KeptLook]:
    """Those that the store has not, or not with the standing or not with the printed text that they have
    here."""
    kept = target.standings([look.id for look in looks])
    told = [look.id for look in looks if look.texts]
    printed = target.printed_texts(told) if told else {}
    return [
        look
        for look in looks
        if look.standing > kept.get(look.id, -1)
        or says_more(printed_text(look.texts), printed.get(look.id, NOTHING_PRINTED))
    ]


def _keep_pictures(
    inventory: SqliteStore, looks: Sequence[KeptLook], target: Target, done: Delivered
) -> set[str]:
    """Before the looks that name them.  Returns those that cannot be read now: for their looks it is too
    early.  A picture that the sender has no longer, or that is damaged, is not waited for."""
    names = {look.evidence for look in looks if look.evidence}
    unread: set[str] = set()
    for name in missing_pictures(names, target):
        path = inventory.evidence.path(name)
        try:
            jpeg = read_picture(path, name)
        except FileNotFoundError:
            continue
        except OSError as err:
            done.failures.append(f"{path}: {err.strerror or err}; its look waits for it")
            unread.add(name)
            continue
        if jpeg is None:
            done.failures.append(f"{path}: the picture is damaged; its look is delivered without it")
            continue
        target.keep_picture(jpeg)
        done.pictures += 1
    return unread


def read_picture(path: Path, name: str) -> bytes | None:
    """The picture at the sender; None for one that is damaged: what lies there is not what its name says.
    FileNotFoundError without one, OSError for one that cannot be read now."""
    with open(path, "rb", opener=_opened_at_once) as stream:
        if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
            return None
        jpeg = stream.read(MOST_BYTES + 1)
    return jpeg if len(jpeg) <= MOST_BYTES and picture_name(jpeg) == name else None


def _opened_at_once(path: str, flags: int) -> int:
    """A pipe is not waited for."""
    return os.open(path, flags | os.O_NONBLOCK)


def missing_pictures(names: Iterable[str], target: Target) -> Iterator[str]:
    """Those that the target has not.  It is asked of few at once: it may look for each in turn where a way
    there and back is long, within the time that an answer may take."""
    asked = sorted(names)
    for begin in range(0, len(asked), _ASKED_AT_ONCE):
        yield from sorted(target.missing_pictures(asked[begin : begin + _ASKED_AT_ONCE]))


def deliver_flights(
    logs: Sequence[FoundLog],
    site: str,
    source: str,
    target: Target,
    done: Delivered,
    *,
    all_expected: bool = False,
) -> bool:
    """Every flight that is over; each is of its own log's site, else of `site`.  Whether all are: one whose
    log was written just now may be cut off there, and that log never changes again.

    Where `all_expected`, a log without a flight to deliver is among the `failures`; among the many of a
    folder it is nothing special, of a daemon that was ended before it flew."""
    by_site: dict[str, list[SentFlight]] = {}
    all_over = True
    for log, row in zip(logs, read_rows(tuple(logs)), strict=True):
        all_over &= not row.running
        is_over = row.outcome and not row.running
        if is_over and (row.site or site):
            by_site.setdefault(row.site or site, []).append(_flight(log, row))
        elif all_expected:
            why = "nothing says of which site the flight is; deliver it with --site NAME"
            if not is_over:
                why = row.trouble or why
            done.failures.append(f"{log.root / log.relative}: {why}")
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


def _parts(items: Iterable[_T]) -> Iterator[list[_T]]:
    """As many as fit into one batch, by their number and their size."""
    part: list[_T] = []
    size = 0
    for item in items:
        item_bytes = len(msgspec.json.encode(item)) + 1
        if part and (len(part) >= MOST_LOOKS or size + item_bytes > MOST_BATCH_BYTES - _AROUND_BYTES):
            yield part
            part, size = [], 0
        part.append(item)
        size += item_bytes
    if part:
        yield part
