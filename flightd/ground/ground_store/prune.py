"""What a store has, taken away at its sender.

The newest run stays whole, and of each place the look by which it stands: the inventory says the same as
before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.inventory import Observation, Standing
from flightd.ground.ground_store.batch import MOST_LOOKS
from flightd.ground.ground_store.sender import Target, missing_pictures


@dataclass(frozen=True, slots=True)
class Pruned:
    """How much was taken away, and how many older looks `stay`: the store has them not, or not so."""

    looks: int
    pictures: int
    stay: int


def prune(folder: Path, target: Target) -> Pruned:
    """Ask the store for every look of older runs, and take away what it has as it stands here."""
    with SqliteStore(folder, create=False) as inventory:
        looks = inventory.looks()
        newest_run = looks[-1][0].run if looks else ""
        standing = {record.observation.id for record in inventory.locations() if record.observation}
        older = [(seen, how) for seen, how in looks if seen.run != newest_run]
        had = [seen for part in _parts(older) for seen in _had(inventory, part, target)]
        gone = [seen.id for seen in had if seen.id not in standing]
        had_ids = {seen.id for seen in had}
        needed = {seen.evidence for seen, _ in looks if seen.id not in had_ids}
        pictures = {seen.evidence for seen in had if seen.evidence} - needed
        inventory.forget(gone)
        taken_away = sum(_unlinked(inventory.evidence.path(name)) for name in sorted(pictures))
    return Pruned(len(gone), taken_away, len(older) - len(had))


def _had(
    inventory: SqliteStore, part: Sequence[tuple[Observation, Standing]], target: Target
) -> list[Observation]:
    """Those that the store has, for good, with the pictures that are here."""
    kept = target.standings([seen.id for seen, _ in part])
    names = {seen.evidence for seen, _ in part if seen.evidence}
    missing = {name for name in missing_pictures(names, target) if inventory.evidence.path(name).exists()}
    return [
        seen
        for seen, how in part
        if how is not Standing.PENDING and kept.get(seen.id, -1) >= how and seen.evidence not in missing
    ]


def _parts(
    looks: Sequence[tuple[Observation, Standing]],
) -> list[Sequence[tuple[Observation, Standing]]]:
    return [looks[begin : begin + MOST_LOOKS] for begin in range(0, len(looks), MOST_LOOKS)]


def _unlinked(path: Path) -> bool:
    try:
        path.unlink()
    except FileNotFoundError:
        return False
    return True
