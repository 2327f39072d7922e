"""A store read by somebody who must not change it: no table, no page of it, and no file beside it."""

from __future__ import annotations

import sqlite3
from pathlib import Path

from flightd.adapters.store.unavailable import InventoryUnavailableError


def connect_read_only(file: Path) -> sqlite3.Connection:
    """The database, as it is now.

    Another user's daemon may write it: a file that were made here beside its own (`-wal`, `-shm`) could be
    one that it may not write.  So they are used as they stand while somebody writes, and where there is no
    log to be read with the file, the file is read alone.  Keep it open for one question only.
    InventoryUnavailableError where a writer that died left a log that only a writer can take up.
    """
    log, index = (file.with_name(f"{file.name}-{part}") for part in ("wal", "shm"))
    if not log.exists() or log.stat().st_size == 0:
        how = "mode=ro&immutable=1"
    elif index.exists():
        how = "mode=ro&readonly_shm=1"
    else:
        raise InventoryUnavailableError(
            f"{file}: its last writer was cut off",
            remedy=f"flightd inventory show {file.parent} takes that up",
        )
    uri = f"{file.resolve().as_uri()}?{how}"
    return sqlite3.connect(uri, uri=True, timeout=2.0, isolation_level=None, check_same_thread=False)
