"""A folder that is shared with other programs or machines, here or wherever fsspec reaches.

Files get their names by renaming: nobody sees half of one.  That holds where renaming is one step, as on a
disk and over SFTP.  A bucket of S3 renames by copying, but shows an object once all of it is there.
"""

from __future__ import annotations

import os
import secrets
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from pathlib import Path, PurePosixPath
from typing import Any, TypeAlias, TypeVar
from urllib.parse import urlsplit

from flightd.core.errors import InputError, UnavailableError
from flightd.runtime.durable_files import sync_folder
from flightd.runtime.remote_errors import remote_errors
from flightd.runtime.remote_files import BUCKETS, close_files, file_system

Stamp: TypeAlias = tuple[int, str]
"""Size and time of a file: another whenever it is written."""
_T = TypeVar("_T")
_WRITTEN_STILL = (".tmp", ".part", ".partial", ".filepart", ".crdownload", "~")


class SharedFolder:
    """The folder at `address`, which `key` of `file` names, for the command or option `what`.

    Safe from any thread.  Whatever it refuses is an UnavailableError that names all three."""

    def __init__(
        self,
        address: str,
        file: Path | str,
        key: str,
        *,
        what: str = "flightd store exchange",
        make: bool = False,
    ) -> None:
        """InputError where there is no such folder, unless it is to be made."""
        self._file, self._key = file, key
        self.address = address
        with self._refusals("cannot be opened"):
            self._files, self._path = file_system(address, file, key, what)
            self._is_bucket = urlsplit(address).scheme in BUCKETS
            is_connection = hasattr(self._files, "reopen")
            self._turn: AbstractContextManager[Any] = threading.Lock() if is_connection else nullcontext()
            if self._is_bucket:
                # Its folders are but names.  A bucket has an owner, rights and a price: none is made here.
                self._files.call_s3("head_bucket", Bucket=self._path.partition("/")[0])
            elif make:
                self._files.makedirs(self._path, exist_ok=True)
            elif self._kind(self._path) != "directory":
                self.close()
                remedy = "make it, or correct the key"
                raise InputError(f"{address}: there is no such folder", file=file, key=key, remedy=remedy)

    def close(self) -> None:
        """Of a connection."""
        close_files(self._files)

    def listed(self, below: str = "") -> dict[str, Stamp]:
        """Whole files by name; none where there is no folder `below`, which is one of ours."""
        path = self._at(below)

        def entries() -> list[dict[str, Any]]:
            if below and self._kind(path) != "directory":
                return []
            self._files.invalidate_cache()
            return list(self._files.ls(path, detail=True))

        found = {PurePosixPath(one["name"]).name: one for one in self._done("cannot be listed", entries)}
        return {
            name: (int(one["size"] or 0), str(one.get("mtime") or one.get("created") or one.get("ETag")))
            for name, one in found.items()
            if one["type"] == "file" and not name.startswith(".") and not name.endswith(_WRITTEN_STILL)
        }

    def has(self, name: str) -> bool:
        """Whether there is a file of this name."""

        def is_there() -> bool:
            self._files.invalidate_cache()
            return self._kind(self._at(name)) == "file"

        return self._done(f"{name} cannot be looked for", is_there)

    def read(self, name: str, most: int) -> bytes:
        """At most so many bytes of it."""

        def content() -> bytes:
            with self._files.open(self._at(name), "rb") as stream:
                return bytes(stream.read(most))

        return self._done(f"{name} cannot be read", content)

    def write(self, name: str, data: bytes, *, alone: bool = True) -> None:
        """All of it under its name, or none; on the disk, where that is here.  What a kill leaves beside it
        the next try writes anew; where others may write the same file now, not `alone`, it stays."""
        path, own = PurePosixPath(name), "" if alone else f".{secrets.token_hex(4)}"
        beside = self._at(str(path.with_name(f".{path.name}{own}.tmp")))

        def written() -> None:
            if self._is_bucket:
                self._files.pipe_file(self._at(name), data)
                return
            self._make(name)
            try:
                with self._files.open(beside, "wb") as stream:
                    stream.write(data)
                    stream.flush()
                    if self._is_here:
                        os.fsync(stream.fileno())
                self._rename(beside, self._at(name))
            except remote_errors():
                with suppress(*remote_errors()):
                    self._files.rm_file(beside)
                raise

        self._done(f"{name} cannot be written", written)

    def move(self, name: str, to: str) -> None:
        """In the place of what has that name already."""

        def moved() -> None:
            self._make(to)
            self._rename(self._at(name), self._at(to))

        self._done(f"{name} cannot be moved to {to}", moved)

    def end_move(self, name: str, to: str) -> None:
        """Take `name` away where it was moved in a bucket and that was cut half-way: `to` is a copy of it, no
        older and of the same content."""

        def ended() -> None:
            self._files.invalidate_cache()
            if self._kind(self._at(name)) != "file":
                return
            old, copy = self._files.info(self._at(name)), self._files.info(self._at(to))
            if old["LastModified"] > copy["LastModified"] or old["size"] != copy["size"]:
                return
            if self._files.cat_file(self._at(name)) == self._files.cat_file(self._at(to)):
                self._files.rm_file(self._at(name))

        if self._is_bucket:
            self._done(f"{name} cannot be taken away", ended)

    @property
    def _is_here(self) -> bool:
        return bool(getattr(self._files, "local_file", False))

    def _at(self, name: str) -> str:
        return f"{self._path.rstrip('/')}/{name}" if name else self._path

    def _kind(self, path: str) -> str:
        """`file`, `directory`, or "" where nothing is; fsspec says "no file", too, where it cannot know."""
        try:
            return str(self._files.info(path)["type"])
        except (FileNotFoundError, NotADirectoryError):
            return ""

    def _make(self, name: str) -> None:
        """The folder of ours in which a file shall be."""
        if self._is_bucket:
            return
        parent = str(PurePosixPath(name).parent)
        if parent != "." and self._kind(self._at(parent)) != "directory":
            self._files.makedirs(self._at(parent), exist_ok=True)

    def _rename(self, path: str, to: str) -> None:
        self._files.mv(path, to)
        if self._is_here:
            for folder in {Path(path).parent, Path(to).parent}:
                sync_folder(folder)

    def _done(self, what: str, work: Callable[[], _T]) -> _T:
        """What `work` returns, or a refusal.  A connection is for one at a time; where it was lost it is
        opened again, and the work begun anew."""
        with self._refusals(what), self._turn:
            try:
                return work()
            except remote_errors() as err:
                is_lost = getattr(self._files, "is_lost", None)
                if is_lost is None or not is_lost(err):
                    raise
                self._files.reopen()
                return work()

    @contextmanager
    def _refusals(self, what: str) -> Iterator[None]:
        try:
            yield
        except remote_errors() as err:
            text = getattr(err, "strerror", None) or str(err) or type(err).__name__
            raise UnavailableError(
                f"{self.address}: {what}: {text}",
                file=self._file,
                key=self._key,
                remedy="may flightd read and write there?",
            ) from None
