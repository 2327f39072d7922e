"""What a store has, taken away at its sender.

The newest run stays whole, and of each place the look by which it stands: the inventory says the same as
before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from flightd.adapters.store.kept_looks import KeptLook
from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.inventory import Standing
from flightd.ground.ground_store.batch import MOST_LOOKS
from flightd.ground.ground_store.sender import Target, lacking, missing_pictures, read_picture


@dataclass(frozen=True, slots=True)
class Pruned:
    """How much was taken away, and how many older looks `stay`: the store has them not, or not so."""

    looks: int
    pictures: int
    stay: int


def prune(folder: Path, target: Target) -> Pruned:
    """Ask the store for every look of older runs, and take away what it has as it stands here."""
    with SqliteStore(folder, create=False) as inventory:
        newest_run, standing = inventory.newest_run(), inventory.standing_looks()
        gone: list[str] = []
        pictures: set[str] = set()
        needed: set[str] = set()
        stay = 0
        for part in inventory.parts(MOST_LOOKS):
            older = [look for look in part if look.run != newest_run]
            had = _had(inventory, older, target)
            had_ids = {look.id for look in had}
            stay += len(older) - len(had)
            gone += [look.id for look in had if look.id not in standing]
            pictures |= {look.evidence for look in had if look.evidence}
            needed |= {look.evidence for look in part if look.id not in had_ids}
        taken_away = sum(_unlinked(inventory.evidence.path(name)) for name in sorted(pictures - needed))
        for begin in range(0, len(gone), MOST_LOOKS):
            inventory.forget(gone[begin : begin + MOST_LOOKS])
    return Pruned(len(gone), taken_away, stay)


def _had(inventory: SqliteStore, older: Sequence[KeptLook], target: Target) -> list[KeptLook]:
    """Those that the store has, for good, with what was found printed and what is whole here of pictures."""
    if not older:
        return []
    lacked = {look.id for look in lacking(older, target)}
    names = {look.evidence for look in older if look.evidence}
    missing = {
        name
        for name in missing_pictures(names, target)
        if _is_to_deliver(inventory.evidence.path(name), name)
    }
    return [
        look
        for look in older
        if look.standing is not Standing.PENDING and look.id not in lacked and look.evidence not in missing
    ]


def _is_to_deliver(path: Path, name: str) -> bool:
    """Whether the picture is here, or may be: one that is damaged is waited for by nobody."""
    try:
        return read_picture(path, name) is not None
    except FileNotFoundError:
        return False
    except OSError:
        return True


def _unlinked(path: Path) -> bool:
    try:
        path.unlink()
    except FileNotFoundError:
        return False
    return True
