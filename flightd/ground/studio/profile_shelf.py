"""Installed colour profiles: `profiles/NAME.npz` below the station's folder is the one to fly by.

Each version stays in `profiles/NAME/`, so that it can be taken back.  What flies is told by the content of
NAME.npz alone, and that is replaced in one step: a power cut leaves the old version or the new one."""

from __future__ import annotations

import hashlib
import threading
import time
from pathlib import Path

import msgspec

from flightd.adapters.store.sent_profiles import sent_as
from flightd.core.errors import InputError, RunError, UnavailableError
from flightd.ground.plain_files import is_plain_file, is_plain_folder, plain_file
from flightd.runtime.durable_files import replace_file

FOLDER = "profiles"
MOST_VERSIONS = 200
_BOOK = "versions.json"
_MOST_BOOK_BYTES = 1 << 20
_MOST_PROFILE_BYTES = 1 << 20


class Version(msgspec.Struct, frozen=True):
    """One installed profile: `file_hash` is the SHA-256 of its file; `verdict` what the comparison said."""

    number: int
    utc_s: float
    who: str
    paint: str
    file_hash: str
    training_hash: str
    verdict: str


class Shelved(msgspec.Struct, frozen=True):
    """A profile's versions, oldest first; `current` is the number of the one to fly by, None where its file
    is none of them.  `trouble`: why its versions cannot be read, nothing can be installed or taken back.
    `sent_as`: how a drone names the file of each version that is sent to it."""

    name: str
    file: str
    current: int | None
    versions: tuple[Version, ...]
    trouble: str = ""
    sent_as: tuple[str, ...] = ()


class ProfileShelf:
    """The installed profiles of a station's folder.  Safe from any thread.

    InputError for what there is not, UnavailableError where the disk refuses."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder / FOLDER
        self._lock = threading.Lock()

    def shelved(self) -> list[Shelved]:
        """Every profile that was ever installed."""
        if not is_plain_folder(self._folder):
            return []
        names = sorted(entry.name for entry in self._folder.iterdir() if is_plain_file(entry / _BOOK))
        return [self.of(name) for name in names]

    def of(self, name: str) -> Shelved:
        """A profile's versions; none where it was never installed, or where they cannot be read."""
        try:
            return self._shelved(name)
        except InputError as err:
            return Shelved(name, str(self._file(name).resolve()), None, (), str(err))

    def _shelved(self, name: str) -> Shelved:
        versions = self._versions(name)
        installed = plain_file(self._file(name), _MOST_PROFILE_BYTES)
        digest = None if installed is None else _hash(installed)
        current = next((one.number for one in reversed(versions) if one.file_hash == digest), None)
        sent = tuple(sent_as(name, one.file_hash) for one in versions)
        return Shelved(name, str(self._file(name).resolve()), current, versions, sent_as=sent)

    def installed(self, name: str, file_hash: str) -> bytes:
        """The file to fly by.  InputError where there is none, RunError where it is another."""
        content = plain_file(self._file(name), _MOST_PROFILE_BYTES)
        if content is None:
            raise InputError(f"no profile {name} is installed")
        if _hash(content) != file_hash:
            raise RunError("another version was installed meanwhile", remedy="look at it again")
        return content

    def install(self, name: str, profile: bytes, who: str, paint: str, learnt: tuple[str, str]) -> Shelved:
        """A profile's file as the next version; `learnt` are its training hash and the verdict on it.

        What is installed already stays as it is."""
        with self._lock:
            before = self._shelved(name)
            versions = before.versions
            if any(one.number == before.current and one.file_hash == _hash(profile) for one in versions):
                return before
            if len(versions) >= MOST_VERSIONS:
                raise InputError(f"there are {MOST_VERSIONS} versions of {name}", remedy="take another name")
            number = versions[-1].number + 1 if versions else 1
            added = Version(number, time.time(), who, paint, _hash(profile), *learnt)
            try:
                (self._folder / name).mkdir(parents=True, exist_ok=True)
                self._put(self._version_file(name, number), profile)
                self._put(self._folder / name / _BOOK, msgspec.json.encode([*versions, added]))
                self._put(self._file(name), profile)
            except OSError as err:
                raise _refused(err) from err
        return self.of(name)

    def take_back(self, name: str, number: int) -> Shelved:
        """Fly by an earlier version again."""
        with self._lock:
            known = next((one for one in self._versions(name) if one.number == number), None)
            content = plain_file(self._version_file(name, number), _MOST_PROFILE_BYTES)
            if known is None or content is None or _hash(content) != known.file_hash:
                raise InputError(f"there is no version {number} of {name}")
            try:
                self._put(self._file(name), content)
            except OSError as err:
                raise _refused(err) from err
        return self.of(name)

    def _versions(self, name: str) -> tuple[Version, ...]:
        text = plain_file(self._folder / name / _BOOK, _MOST_BOOK_BYTES)
        if text is None:
            return ()
        try:
            return tuple(msgspec.json.decode(text, type=list[Version]))
        except (msgspec.DecodeError, UnicodeDecodeError) as err:
            raise InputError(f"{FOLDER}/{name}/{_BOOK}: {err}", remedy="put it aside") from None

    def _file(self, name: str) -> Path:
        return self._folder / f"{name}.npz"

    def _version_file(self, name: str, number: int) -> Path:
        return self._folder / name / f"{number}.npz"

    @staticmethod
    def _put(path: Path, content: bytes) -> None:
        replace_file(path, path.with_name(f".{path.name}.part"), content)


def _hash(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _refused(err: OSError) -> UnavailableError:
    return UnavailableError(
        f"the profile cannot be installed: {err.strerror or err}", remedy="may this station write there?"
    )
