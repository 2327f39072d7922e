"""A configuration's file that is changed from the ground, and its older versions beside it.

What stood there before a change is kept first, on the disk, then the new text takes the file's place at once:
a power cut leaves the one or the other.  Every call blocks for the disk.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
from collections.abc import Sequence
from pathlib import Path

import msgspec

from flightd.core.errors import InputError, RunError, UnavailableError
from flightd.runtime.durable_files import replace_file

KEPT = 50
"""Older versions that are kept; then the oldest goes."""
MOST_BYTES = 1_000_000


class Change(msgspec.Struct, frozen=True):
    """A key before and after; None: left out."""

    key: str
    before: object
    after: object


class Version(msgspec.Struct, frozen=True):
    """What stood before a change is version `number`; when it was changed (UTC), by whom, and how."""

    number: int
    utc: str
    client: str
    person: str
    changes: tuple[Change, ...]


class Trial(msgspec.Struct, frozen=True):
    """Settings that no daemon has come up by yet: `version` is what stood before, `starts` how often one was
    started by them."""

    version: int
    starts: int = 0


class SettingsFile:
    """The file `path`; its versions lie in a folder `NAME.versions` beside it."""

    def __init__(self, path: Path) -> None:
        self.path = path.resolve()
        self._folder = self.path.with_name(f"{self.path.name}.versions")

    @property
    def _trial(self) -> Path:
        return self._folder / "trial"

    @property
    def candidate(self) -> Path:
        """Where a proposal lies while it is checked: in the same folder, so that what it names is found."""
        return self.path.with_name(f".{self.path.name}.proposed")

    def read(self) -> str:
        """Its text.  UnavailableError where it cannot be read."""
        return self._read(self.path)

    def locked(self) -> str:
        """Why nothing can be changed; empty where it can."""
        try:
            owner = self.path.parent.owner()
        except (KeyError, OSError):
            owner = "somebody else"
        if not os.access(self.path.parent, os.W_OK | os.X_OK):
            return (
                f"flightd may not write in {self.path.parent}, which is {owner}'s: give the folder to the "
                "service's user on the drone, if the ground shall change its settings"
            )
        return ""

    def versions(self) -> list[Version]:
        """Those kept, newest first; what is no version of ours is left out."""
        found = [
            version for path in self._folder.glob("*.json") if (version := self._noted(path)) is not None
        ]
        return sorted(found, key=lambda version: version.number, reverse=True)

    def text_of(self, number: int) -> str:
        """The text of a kept version.  InputError for one that is not there."""
        path = self._text_path(number)
        if not path.is_file():
            raise InputError(f"there is no version {number}")
        return self._read(path)

    def propose(self, text: str) -> Path:
        """Lay a proposal down for its check."""
        try:
            self.candidate.write_text(text, encoding="utf-8")
        except OSError as err:
            raise UnavailableError(f"{self.candidate}: {err.strerror}", remedy=self.locked()) from err
        return self.candidate

    def withdraw(self) -> None:
        """Take a proposal away again."""
        self.candidate.unlink(missing_ok=True)

    def replace(self, before: str, text: str, said: Version) -> None:
        """Put `text` in the place of `before`, which is kept with what is `said` of the change; its number is
        made here.  RunError where the file is not `before` any more."""
        if self.read() != before:
            raise RunError("the file was changed meanwhile", remedy="look at it again")
        numbers = [version.number for version in self.versions()]
        said = msgspec.structs.replace(said, number=max(numbers, default=0) + 1)
        try:
            mode = self.path.stat().st_mode & 0o777
            self._folder.mkdir(exist_ok=True)
            self._keep(self._text_path(said.number), before.encode())
            self._keep(self._folder / f"{said.number:06d}.json", msgspec.json.encode(said))
            beside = self.path.with_name(f".{self.path.name}.new")
            beside.touch(mode=mode)
            beside.chmod(mode)
            self._keep(self._trial, msgspec.json.encode(Trial(said.number)))
            replace_file(self.path, beside, text.encode())
            self._forget(sorted([*numbers, said.number])[:-KEPT])
        except OSError as err:
            raise UnavailableError(f"{self.path}: {err.strerror or err}", remedy=self.locked()) from err

    def begin(self) -> str:
        """To be called before each start of a daemon: settings by which an earlier one was started and did
        not come up are taken back.  Says so, or is empty.  UnavailableError where the disk refuses."""
        trial = self._on_trial()
        if trial is None:
            return ""
        try:
            if not trial.starts:
                self._keep(self._trial, msgspec.json.encode(Trial(trial.version, 1)))
                return ""
            before = self.text_of(trial.version)
            replace_file(self.path, self.path.with_name(f".{self.path.name}.new"), before.encode())
            self._trial.unlink()
        except OSError as err:
            raise UnavailableError(f"{self.path}: {err.strerror or err}") from err
        return f"flightd did not come up by its newest settings: those before change {trial.version} are back"

    def confirm(self) -> None:
        """A daemon that was started by the settings has come up; those that were changed since stay on trial.
        Blocks for the disk, which may refuse."""
        trial = self._on_trial()
        if trial is not None and trial.starts:
            with contextlib.suppress(OSError):
                self._trial.unlink(missing_ok=True)

    def _on_trial(self) -> Trial | None:
        try:
            return msgspec.json.decode(self._trial.read_bytes(), type=Trial)
        except (OSError, msgspec.DecodeError):
            return None

    def _keep(self, path: Path, data: bytes) -> None:
        replace_file(path, path.with_suffix(".new"), data)

    def _forget(self, numbers: Sequence[int]) -> None:
        for number in numbers:
            (self._folder / f"{number:06d}.json").unlink(missing_ok=True)
            self._text_path(number).unlink(missing_ok=True)

    def _text_path(self, number: int) -> Path:
        return self._folder / f"{number:06d}.toml"

    def _noted(self, path: Path) -> Version | None:
        try:
            version = msgspec.json.decode(path.read_bytes(), type=Version)
        except (OSError, msgspec.DecodeError):
            return None
        return version if self._text_path(version.number).is_file() else None

    def _read(self, path: Path) -> str:
        try:
            if path.stat().st_size > MOST_BYTES:
                raise InputError("too large to be a configuration", file=path)
            return path.read_text(encoding="utf-8")
        except OSError as err:
            raise UnavailableError(f"{path}: {err.strerror}") from err
        except UnicodeDecodeError as err:
            raise InputError("not UTF-8 text", file=path) from err


def tag_of(text: str) -> str:
    """A short name of these contents."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]
