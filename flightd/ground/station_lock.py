"""One station at a time has a folder for its state: two would write over what the other one keeps."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from flightd.core.errors import InputError, UnavailableError
from flightd.ground.own_database import make_private_file

FILE: Final = "station.lock"


@contextmanager
def only_station(folder: Path) -> Iterator[None]:
    """The folder is this process's alone; however it ends, another one may have it then.  InputError where
    another one has it, UnavailableError where the disk refuses."""
    file = folder / FILE
    try:
        make_private_file(file)
        stream = file.open("r+")
    except OSError as err:
        raise UnavailableError(f"{file}: {err.strerror}", remedy="may this station write there?") from err
    with stream:
        try:
            # of this process, not of those that it starts and that may outlive it
            fcntl.lockf(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise InputError(
                f"another station uses it (process {stream.read(20).strip() or 'unknown'})",
                key=f"--state {folder}",
                remedy="end that one, or give this one another folder",
            ) from None
        stream.truncate(0)
        stream.write(f"{os.getpid()}\n")
        stream.flush()
        yield
