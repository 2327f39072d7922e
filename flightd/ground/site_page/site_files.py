"""The site files under the station's folder: found, opened, and saved with the old version kept.

Nothing that a browser says is ever made a path: names are looked up, and a new file's is checked first.
"""

from __future__ import annotations

import hashlib
import os
import re
import secrets
import stat
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from flightd.core.errors import InputError, RunError, UnavailableError
from flightd.ground.plain_files import is_plain_file, is_plain_folder, plain_file
from flightd.ground.shown_text import shown
from flightd.runtime.durable_files import replace_file, sync_folder

MOST_BYTES: Final = 1_000_000
VERSIONS: Final = ".site-versions"
"""The folder, beside a site file, in which its old versions are kept."""
_SITE: Final = re.compile(rb"^[ \t]*\[site\]|^[ \t]*site[ \t]*[.=]", re.MULTILINE)
_AISLE: Final = re.compile(rb"^[ \t]*\[\[[ \t]*aisle[ \t]*\]\]|^[ \t]*aisle[ \t]*=", re.MULTILINE)
_NEW_NAME: Final = re.compile(r"[\w][\w .-]{0,79}\.toml")
_AT: Final = "%Y-%m-%dT%H-%M-%S.%fZ"
_DEPTH, _MOST_FOLDERS, _MOST_FILES, _MOST_VERSIONS = 4, 5_000, 500, 100


@dataclass(frozen=True, slots=True)
class OpenedFile:
    """A site file as it was read; `stamp` is another one whenever its content is."""

    text: str
    stamp: str


class SiteFiles:
    """Under `root`: every TOML file that describes a site, named by its path from there.  Safe from any
    thread."""

    def __init__(self, root: Path | None) -> None:
        self._root = root
        self._known: dict[str, Path] = {}
        self._saving = threading.Lock()

    @property
    def title(self) -> str:
        """The folder's name, for people; empty where the station was told none."""
        return "" if self._root is None else shown(self._root.resolve().name) or "/"

    def names(self) -> list[tuple[str, float]]:
        """Every site file and when it was written last (UTC, s), newest first."""
        if self._root is None:
            return []
        self._known = {shown(path.relative_to(self._root).as_posix()): path for path in _found(self._root)}
        times = [(name, _written_s(path)) for name, path in self._known.items()]
        return sorted(times, key=lambda one: (-one[1], one[0]))

    def open(self, name: str) -> OpenedFile:
        """What is in a file.  InputError where there is none of the name, or it is no text."""
        return _opened(name, self.path(name))

    def save(self, name: str, stamp: str, text: str) -> OpenedFile:
        """Put a new version in the place of the one with that stamp, which is kept.

        RunError where the file is another one meanwhile, InputError where there is none of the name or the
        new one is too large, UnavailableError where the disk refuses."""
        path, data = self.path(name), _data(text)
        with self._saving:
            now = _opened(name, path)
            if now.stamp != stamp:
                raise RunError(
                    f"{name} was changed by somebody else since it was opened here",
                    remedy="save yours under another name, or open the file anew",
                )
            try:
                _keep(path, now.text)
                beside = path.with_name(f".{path.name}.{secrets.token_hex(4)}.new")
                _touch(beside, stat.S_IMODE(path.stat().st_mode))
                try:
                    replace_file(path, beside, data)
                finally:
                    beside.unlink(missing_ok=True)
            except OSError as err:
                raise _refused(name, err) from None
        return OpenedFile(text, _stamp(data))

    def create(self, name: str, text: str) -> OpenedFile:
        """Make a new file in the folder itself.  RunError where one of the name is there already, InputError
        for what is no name, UnavailableError where the disk refuses."""
        if self._root is None:
            raise RunError("the station was told no folder to keep sites in", remedy="give it --folder DIR")
        if not _NEW_NAME.fullmatch(name):
            raise InputError(
                f"{shown(name)!r} is no name for a site file",
                remedy="take letters and digits, as in hall-3.toml",
            )
        path, data = self._root / name, _data(text)
        beside = path.with_name(f".{name}.{secrets.token_hex(4)}.new")
        try:
            _touch(beside, 0o644)
            try:
                with beside.open("wb") as file:
                    file.write(data)
                    file.flush()
                    os.fsync(file.fileno())
                os.link(beside, path)  # unlike a move it takes nobody's place
            finally:
                beside.unlink(missing_ok=True)
            sync_folder(path.parent)
        except FileExistsError:
            raise RunError(f"{name} is there already", remedy="choose another name, or open it") from None
        except OSError as err:
            raise _refused(name, err) from None
        self._known[name] = path
        return OpenedFile(text, _stamp(data))

    def versions(self, name: str) -> list[str]:
        """The old versions of a file, newest first: when each was replaced (UTC)."""
        return [path.stem for path in _versions(self.path(name))][::-1]

    def version(self, name: str, version: str) -> str:
        """The text of an old version.  InputError where there is none."""
        for path in _versions(self.path(name)):
            if path.stem == version:
                return _opened(f"{name}, {version}", path).text
        raise InputError(f"{name} has no version {shown(version)!r}")

    def path(self, name: str) -> Path:
        """Where a file lies.  InputError where there is none of the name."""
        known = self._known.get(name)
        if known is None or not is_plain_file(known):
            self.names()
            known = self._known.get(name)
        if known is None:
            raise InputError(f"there is no site file {shown(name)!r}")
        return known


def _found(root: Path) -> Iterator[Path]:
    """Site files, not those behind links."""
    found = 0
    for looked, (folder, below, files) in enumerate(os.walk(root)):
        here = Path(folder)
        for name in sorted(files):
            path = here / name
            if not name.endswith(".toml") or name.startswith("."):
                continue
            data = plain_file(path, MOST_BYTES)
            if data is not None and _SITE.search(data) and _AISLE.search(data):
                yield path
                found += 1
        deep = len(here.relative_to(root).parts) >= _DEPTH
        below[:] = [] if deep else sorted(name for name in below if not name.startswith("."))
        if looked >= _MOST_FOLDERS or found >= _MOST_FILES:
            return


def _opened(name: str, path: Path) -> OpenedFile:
    data = plain_file(path, MOST_BYTES)
    if data is None:
        raise InputError(f"{name} cannot be read, or is larger than any site file")
    try:
        return OpenedFile(data.decode(), _stamp(data))
    except UnicodeDecodeError:
        raise InputError(f"{name} is not a UTF-8 text file; a site file is TOML") from None


def _data(text: str) -> bytes:
    data = text.encode(errors="replace")
    if len(data) > MOST_BYTES:
        raise InputError(f"a site file has at most {MOST_BYTES // 10**6} MB")
    return data


def _stamp(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def _keep(path: Path, text: str) -> None:
    """Put a copy into the folder of old versions; the oldest beyond the most that are kept goes."""
    folder = path.parent / VERSIONS / path.name
    folder.mkdir(parents=True, exist_ok=True)
    if not is_plain_folder(folder) or not is_plain_folder(folder.parent):
        raise OSError(f"{VERSIONS} is no plain folder")
    kept = folder / f"{datetime.now(UTC).strftime(_AT)}.toml"
    replace_file(kept, kept.with_suffix(".new"), text.encode())
    for old in _versions(path)[:-_MOST_VERSIONS]:
        old.unlink(missing_ok=True)


def _versions(path: Path) -> list[Path]:
    """Oldest first: their names are times."""
    folder = path.parent / VERSIONS / path.name
    if not is_plain_folder(folder) or not is_plain_folder(folder.parent):
        return []
    return sorted(file for file in folder.glob("*.toml") if is_plain_file(file))


def _touch(path: Path, mode: int) -> None:
    """Make the file, which must not be there, with the rights that the new one shall have."""
    os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, mode))


def _refused(name: str, err: OSError) -> UnavailableError:
    return UnavailableError(
        f"{name} cannot be written: {err.strerror or err}", remedy="give the station the right to its folder"
    )


def _written_s(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0
