"""A store for who only looks: as it is where that can be, through a copy where it cannot.

SQLite's write-ahead log wants files beside the database, and a log that a power cut left must be taken up
before the database says the truth; on a read-only medium, or in a folder of another user, neither can be.
A copy can do both; it costs as much room and writing as the database is large.
"""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from flightd.adapters.store.evidence_pictures import EvidenceFolder
from flightd.adapters.store.sqlite import SqliteStore
from flightd.adapters.store.unavailable import InventoryUnavailableError
from flightd.core.errors import InputError

_DATABASE = "inventory.db"
_PARTS = (_DATABASE, f"{_DATABASE}-wal")
_TRIES = 5
_NO_ROOM = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}


@contextmanager
def opened_for_reading(folder: Path, *, untouched: bool = False) -> Iterator[SqliteStore]:
    """The store in `folder`, to look at; nothing that is written to it need stay.

    `untouched`: for one question, wherever it lies, and nothing in the folder changes, its writer's log
    neither, while a flight counts into it or after one was cut off.  Raises what `SqliteStore` raises, and
    as `copied_for_reading` where only a writer can read it."""
    with _uncopied(folder, untouched) or copied_for_reading(folder) as store:
        yield store


def _uncopied(folder: Path, untouched: bool) -> SqliteStore | None:
    """None where it takes a copy."""
    if untouched:
        try:
            return SqliteStore(folder, read_only=True)
        except InventoryUnavailableError:
            return None
    if not (folder / _DATABASE).exists() or _is_writable(folder):
        return SqliteStore(folder, create=False)
    return None


@contextmanager
def copied_for_reading(folder: Path) -> Iterator[SqliteStore]:
    """A copy of the store in `folder` as it is now, with the pictures that are there: for who reads long,
    while others write it.  Raises what `SqliteStore` raises, and InventoryUnavailableError for one that
    changes too fast to be copied, or for which there is no room."""
    with TemporaryDirectory(prefix="flightd-inventory-") as beside:
        copy = Path(beside)
        _copied(folder, copy)
        with _told_of(folder, copy), SqliteStore(copy, create=False) as store:
            store.folder, store.evidence = folder, EvidenceFolder(folder / "evidence")
            yield store


def _is_writable(folder: Path) -> bool:
    """Whether SQLite can work there: in the folder, and in every file of the database."""
    files = [path for path in folder.glob(f"{_DATABASE}*") if path.is_file()]
    effective = os.access in os.supports_effective_ids
    may = all(os.access(path, os.W_OK, effective_ids=effective) for path in files)
    return may and os.access(folder, os.W_OK | os.X_OK, effective_ids=effective)


@contextmanager
def _told_of(folder: Path, copy: Path) -> Iterator[None]:
    """What is wrong with the copied store is said of the original."""
    try:
        yield
    except (InputError, InventoryUnavailableError) as err:
        if str(copy) not in str(err):
            raise
        raise type(err)(str(err).replace(str(copy), str(folder))) from None


def _copied(folder: Path, copy: Path) -> None:
    """Copy the database with its log, as they were at one moment."""
    for _ in range(_TRIES):
        before = _state(folder)
        try:
            for name in _PARTS:
                (copy / name).unlink(missing_ok=True)
                if (folder / name).exists():
                    shutil.copyfile(folder / name, copy / name)
        except FileNotFoundError:
            continue  # a writer that ends takes its log away
        except OSError as err:
            if err.errno in _NO_ROOM:
                raise InventoryUnavailableError(
                    f"no room for a copy in {copy.parent}: {err.strerror}",
                    file=folder / _DATABASE,
                    remedy="make room, or name another folder: TMPDIR=DIR",
                ) from None
            raise InventoryUnavailableError(
                f"cannot be read: {err.strerror or err}", file=folder / _DATABASE
            ) from None
        if _state(folder) == before:
            return
    raise InventoryUnavailableError(
        "is being written all the time", file=folder / _DATABASE, remedy="try again"
    )


def _state(folder: Path) -> list[tuple[str, int, int]]:
    """Name, size and time of change of the parts that are there."""
    found = []
    for name in _PARTS:
        path = folder / name
        if path.exists():
            told = path.stat()
            found.append((name, told.st_size, told.st_mtime_ns))
    return found
