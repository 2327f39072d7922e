"""Colour profiles that a ground station has sent: files beside the configuration, each named by its content.

None is ever written over by another: settings that are taken back find the file that they name.  Every call
blocks for the disk."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

from flightd.core.errors import InputError, UnavailableError
from flightd.core.paint import PROFILE_NAME
from flightd.runtime.durable_files import replace_file

MOST_KEPT = 100
_SENT = re.compile(rf"{PROFILE_NAME}-[0-9a-f]{{12}}\.npz")


def sent_name(name: str, content: bytes) -> str:
    """The file's name of a profile of that name and content."""
    return sent_as(name, hashlib.sha256(content).hexdigest())


def sent_as(name: str, file_hash: str) -> str:
    """The same by the content's SHA-256, in hexadecimal digits."""
    return f"{name}-{file_hash[:12]}.npz"


class SentProfiles:
    """Those in `folder`.  UnavailableError where the disk refuses."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def keep(self, file: str, content: bytes) -> bool:
        """Write it, all or nothing; whether it was not there.  InputError where there are too many."""
        path = self._folder / file
        try:
            if path.is_file() and path.read_bytes() == content:
                return False
            if sum(_SENT.fullmatch(one.name) is not None for one in self._folder.iterdir()) >= MOST_KEPT:
                raise InputError(
                    f"{MOST_KEPT} profiles that were sent lie beside the configuration",
                    remedy="remove on the drone those that no settings name",
                )
            replace_file(path, path.with_name(f".{file}.new"), content)
        except OSError as err:
            raise UnavailableError(f"{path}: {err.strerror or err}") from err
        return True

    def withdraw(self, file: str) -> None:
        """Take it away again."""
        try:
            (self._folder / file).unlink(missing_ok=True)
        except OSError as err:
            raise UnavailableError(f"{self._folder / file}: {err.strerror or err}") from err
