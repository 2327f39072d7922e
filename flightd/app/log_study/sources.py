"""Where logs lie: files, folders with all that is below them, and whatever fsspec opens by a URL."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import Any, Final

from flightd.core.errors import InputError, UnavailableError
from flightd.runtime.remote_errors import remote_errors

_ENDING: Final = ".mcap"
_TRUTH: Final = "truth"
"""The simulator's own log beside that of a flight is not one."""
_BESIDE: Final = ("truth.mcap", "summary.json", "inventory.db", "inventory.db-wal", "inventory.db-shm")
_PICTURES: Final = "evidence"
"""The inventory's, in folders of their own."""


@dataclass(frozen=True, slots=True)
class LogSource:
    """One log: what it is called in the results, and where it is (a path, or a URL)."""

    name: str
    place: str

    @contextlib.contextmanager
    def fetched(self) -> Iterator[Path]:
        """The log as a file with what of its flight lies beside it; gone afterwards if it had to be fetched:
        of a folder of many logs, no other is."""
        if "://" not in self.place:
            yield Path(self.place)
            return
        files, path = _file_system(self.place)
        with TemporaryDirectory(prefix="flightd-study-") as made:
            try:
                _fetch(files, PurePosixPath(path), Path(made))
            except remote_errors() as err:
                raise UnavailableError(f"cannot be fetched: {err}", file=self.place) from None
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


def _local(path: Path) -> Iterator[LogSource]:
    if path.is_file():
        yield LogSource(str(path), str(path.resolve()))
        return
    if not path.is_dir():
        raise InputError("is neither a log nor a folder", file=path)
    for log in sorted(path.rglob(f"*{_ENDING}")):
        if _is_flight(log.name) and log.is_file():
            yield LogSource(str(log), str(log.resolve()))


def _remote(url: str) -> Iterator[LogSource]:
    files, path = _file_system(url)
    scheme = url.partition("://")[0]
    try:
        names = [path] if path.endswith(_ENDING) else sorted(files.find(path))
    except remote_errors() as err:
        raise UnavailableError(f"cannot be listed: {err}", file=url) from None
    for name in names:
        if _is_flight(PurePosixPath(name).name):
            place = f"{scheme}://{name.removeprefix(f'{scheme}://')}"
            yield LogSource(place, place)


def _fetch(files: Any, log: PurePosixPath, into: Path) -> None:
    there = {PurePosixPath(name).name for name in files.ls(str(log.parent), detail=False)}
    for name in (log.name, *(name for name in _BESIDE if name in there)):
        files.get_file(str(log.parent / name), str(into / name))
    if _PICTURES in there:
        for name in files.find(str(log.parent / _PICTURES)):  # one by one: a folder's name may have brackets
            picture = into / PurePosixPath(name).relative_to(log.parent)
            picture.parent.mkdir(parents=True, exist_ok=True)
            files.get_file(name, str(picture))


def _is_flight(name: str) -> bool:
    return name.endswith(_ENDING) and not name.startswith(_TRUTH)


def _file_system(url: str) -> tuple[Any, str]:
    """The file system of a URL, and the path on it."""
    try:
        import fsspec
    except ImportError:
        raise UnavailableError(
            "needs fsspec", file=url, remedy="pip install 'flightd[study]', for S3 'flightd[s3]'"
        ) from None
    try:
        files, path = fsspec.core.url_to_fs(url)
    except remote_errors() as err:
        raise UnavailableError(f"cannot be opened: {err}", file=url) from None
    return files, str(path)
