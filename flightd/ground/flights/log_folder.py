"""Which flight logs lie below a folder, and the way back from an id to one of them.

Nothing is followed out of the folder: links are passed over when it is looked through, and a path that
leads elsewhere by the time it is opened is refused.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from flightd.core.errors import InputError
from flightd.ground.read_folders import ReadFolder

MOST_LOGS = 10_000
MOST_ENTRIES = 500_000
DEEPEST = 8
"""Of a larger folder the rest is not looked at."""
CUT = f"more lies there than the {MOST_LOGS} flight logs, {DEEPEST} folders deep, that are looked at"

_TRUTH = "truth.mcap"
_LOG_ENDING = ".mcap"


@dataclass(frozen=True, slots=True)
class FoundLog:
    """A log below the folder; `stamp` changes whenever it, or what is told of it, does.

    `relative` is its path below the folder `root` as the system has it, perhaps no valid text; `under` stands
    before it for people, empty for the station's own folder."""

    id: str
    relative: str
    size: int
    mtime_ns: int
    stamp: tuple[int, ...]
    root: Path
    under: str = ""

    @property
    def mark(self) -> str:
        """The stamp for those who only need to know whether it is the same."""
        return hashlib.sha256(repr(self.stamp).encode()).hexdigest()[:16]

    @property
    def shown_path(self) -> str:
        """The path for people."""
        return self.under + os.fsencode(self.relative).decode(errors="replace")


@dataclass(frozen=True, slots=True)
class FoundLogs:
    """Newest first; `cut`: there are more than were looked at."""

    logs: tuple[FoundLog, ...]
    cut: bool


def log_id(relative: str) -> str:
    """The name under which a log is asked for: the same as long as it lies where it lies."""
    return hashlib.sha256(os.fsencode(relative)).hexdigest()[:16]


def find_logs(root: Path, others: Sequence[ReadFolder] = ()) -> FoundLogs:
    """The logs below `root`, and those below the `others` that can be looked at.  InputError where `root`
    cannot."""
    try:
        os.scandir(root).close()
    except OSError as err:
        raise InputError(f"cannot be looked at: {err.strerror}", file=root) from None
    found: list[FoundLog] = []
    cut = _find(root, "", found)
    for other in others:
        cut = _find(other.path, other.prefix, found) or cut
    return FoundLogs(tuple(sorted(found, key=lambda log: -log.mtime_ns)), cut)


def _find(root: Path, under: str, found: list[FoundLog]) -> bool:
    """Add the logs below `root`; whether there are more than are looked at."""
    for relative, entry in _files(root):
        if len(found) >= MOST_LOGS or entry is None:
            return True
        try:
            status = entry.stat(follow_symlinks=False)
        except OSError:  # gone meanwhile
            continue
        beside = _stamps_beside(Path(entry.path))
        stamp = (status.st_size, status.st_mtime_ns, *beside)
        identity = log_id(under + relative)
        found.append(FoundLog(identity, relative, status.st_size, status.st_mtime_ns, stamp, root, under))
    return False


def path_of(root: Path, relative: str) -> Path:
    """The log's path.  InputError where it is gone, or leads out of the folder by a link."""
    path = root / relative
    try:
        real, inside = path.resolve(strict=True), root.resolve(strict=True)
    except (OSError, ValueError, RuntimeError):
        raise InputError("the log is gone") from None
    if real != inside / relative or not real.is_relative_to(inside) or not real.is_file():
        raise InputError("the log does not lie in the folder")
    return real


def beside(log: Path, name: str) -> Path | None:
    """A file beside the log; None where there is none, or it is a link."""
    path = log.with_name(name)
    return path if path.is_file() and not path.is_symlink() else None


def _files(root: Path) -> Iterator[tuple[str, os.DirEntry[str] | None]]:
    """Every log's path below `root`; None at last where too much lies there, or too deep."""
    folders: list[tuple[str, int]] = [("", 0)]
    seen = 0
    is_cut = False
    while folders:
        below, depth = folders.pop()
        try:
            entries = sorted(os.scandir(root / below), key=lambda entry: entry.name)
        except OSError:  # gone, or not for us
            continue
        for entry in entries:
            seen += 1
            if seen > MOST_ENTRIES:
                yield "", None
                return
            relative = os.path.join(below, entry.name)  # noqa: PTH118 - a path that may be no text
            if entry.is_dir(follow_symlinks=False):
                if depth < DEEPEST:
                    folders.append((relative, depth + 1))
                else:
                    is_cut = True
            elif entry.name.endswith(_LOG_ENDING) and entry.name != _TRUTH and _is_plain(entry):
                yield relative, entry
    if is_cut:
        yield "", None


def _is_plain(entry: os.DirEntry[str]) -> bool:
    try:
        return entry.is_file(follow_symlinks=False)
    except OSError:
        return False


def _stamps_beside(log: Path) -> tuple[int, ...]:
    stamps = []
    for name in ("summary.json", "report.html", _TRUTH):
        try:
            stamps.append(log.with_name(name).lstat().st_mtime_ns)
        except OSError:
            stamps.append(0)
    return tuple(stamps)
