"""Where logs lie: files, folders with all that is below them, and whatever fsspec opens by a URL."""

from __future__ import annotations

import contextlib
import errno
import os
import stat
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import Any, Final

from flightd.app.log_study.finding import Study
from flightd.core.errors import InputError, UnavailableError
from flightd.runtime.remote_errors import remote_errors
from flightd.runtime.remote_files import close_files, file_system, url_of

_ENDING: Final = ".mcap"
_TRUTH: Final = "truth"
"""The simulator's own log beside that of a flight is not one."""
_DATABASE: Final = "inventory.db"
_INVENTORY: Final = (_DATABASE, f"{_DATABASE}-wal", f"{_DATABASE}-shm")
_BESIDE: Final[Mapping[Study, Sequence[str]]] = MappingProxyType(
    {Study.CODES: _INVENTORY, Study.JUDGE: ("truth.mcap", "summary.json", *_INVENTORY)}
)
"""What lies beside a log and is read; the others read the log alone."""
_NOT_THERE: Final = {errno.ENOENT, errno.ENOTDIR, errno.ELOOP}
_PICTURES: Final = "evidence"
"""The inventory's, in folders of their own, for `Study.CODES`."""


@dataclass(frozen=True, slots=True)
class LogSource:
    """One log: what it is called in the results, and where it is (a path, or a URL)."""

    name: str
    place: str
    inventory: str = ""
    """The folder of the inventory that the flight counted into, where that is not the log's."""

    @property
    def is_local(self) -> bool:
        """A path of this machine's."""
        return "://" not in self.place

    @property
    def inventory_file(self) -> str:
        """The database in `inventory`."""
        return str(Path(self.inventory) / _DATABASE)

    @contextlib.contextmanager
    def fetched(self, studies: Collection[Study]) -> Iterator[Path]:
        """The log as a file with what of its flight lies beside it; gone afterwards if it had to be fetched,
        which is done with what these `studies` read alone: nothing for codes, where the inventory lies
        elsewhere."""
        if self.is_local:
            yield Path(self.place)
            return
        read = [study for study in studies if not (self.inventory and study is Study.CODES)]
        with TemporaryDirectory(prefix="flightd-study-") as made:
            with _opened(self.place, "cannot be fetched") as (files, path):
                _fetch(files, path, Path(made), read)
            yield Path(made) / PurePosixPath(path).name


def log_sources(places: Sequence[str]) -> list[LogSource]:
    """All logs that `places` mean, by name; each once.  InputError where one has none."""
    found: dict[str, LogSource] = {}
    for place in places:
        here = list(_remote(place) if "://" in place else _local(Path(place)))
        if not here:
            raise InputError(
                "holds no flight log", file=place, remedy=f"give *{_ENDING} files, or folders of them"
            )
        found |= {source.place: source for source in here}
    return sorted(found.values(), key=lambda source: source.name)


def _local(path: Path) -> list[LogSource]:
    """InputError for a folder that cannot be looked through: flights would be missing without a word."""
    try:
        kind = _kind(path)
        if not stat.S_ISREG(kind) and not stat.S_ISDIR(kind):
            raise InputError("is neither a log nor a folder", file=path)
        logs = [path] if stat.S_ISREG(kind) else sorted(_logs_below(path))
        return [LogSource(str(log), str(log.resolve())) for log in logs]
    except OSError as err:
        what = f"cannot be looked through: {err.strerror or err}"
        remedy = "take a user who may, or name the folders beside it"
        raise InputError(what, file=err.filename or path, remedy=remedy) from None


def _logs_below(folder: Path) -> Iterator[Path]:
    def ended(err: OSError) -> None:
        raise err

    for place, _, names in os.walk(folder, onerror=ended):
        logs = (Path(place, name) for name in names if _is_flight(name))
        yield from (log for log in logs if stat.S_ISREG(_kind(log)))


def _kind(path: Path) -> int:
    """The mode of what is there, 0 for nothing.  OSError where that cannot be seen, for which `Path.is_file`
    says False from Python 3.14 on."""
    try:
        return path.stat().st_mode
    except OSError as err:
        if err.errno in _NOT_THERE:
            return 0
        raise


def _remote(url: str) -> Iterator[LogSource]:
    with _opened(url, "cannot be listed") as (files, root):
        names = [root] if root.endswith(_ENDING) else sorted(files.find(root))
    for name in names:
        if _is_flight(PurePosixPath(name).name):
            place = url_of(url, root, name)
            yield LogSource(place, place)


def _fetch(files: Any, log: str, into: Path, studies: Collection[Study]) -> None:
    folder, _, name = log.rpartition("/")
    files.get_file(log, str(into / name))
    wanted = dict.fromkeys(name for study in studies for name in _BESIDE.get(study, ()))
    if not wanted:
        return
    there = {PurePosixPath(name).name for name in files.ls(folder, detail=False)}
    for name in (name for name in wanted if name in there):
        files.get_file(f"{folder}/{name}", str(into / name))
    if Study.CODES in studies and _PICTURES in there:
        for name in files.find(f"{folder}/{_PICTURES}"):  # one by one: a folder's name may have brackets
            picture = into / name.removeprefix(f"{folder}/")
            picture.parent.mkdir(parents=True, exist_ok=True)
            files.get_file(name, str(picture))


def _is_flight(name: str) -> bool:
    return name.endswith(_ENDING) and not name.startswith(_TRUTH)


@contextlib.contextmanager
def _opened(url: str, what: str) -> Iterator[tuple[Any, str]]:
    """The file system of a URL, and the path on it; UnavailableError that says so and `what` did not work."""
    try:
        files, path = file_system(url, url, "", "flightd study of a URL", extra="study")
    except remote_errors() as err:
        raise UnavailableError(f"cannot be opened: {err}", file=url) from None
    try:
        yield files, path
    except remote_errors() as err:
        raise UnavailableError(f"{what}: {err}", file=url) from None
    finally:
        close_files(files)
