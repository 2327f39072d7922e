"""A folder that is shared with other programs or machines, here or wherever fsspec reaches.

Files get their names by renaming: nobody sees half of one.  That holds where renaming is one step, as on a
disk and over SFTP.  A bucket of S3 renames by copying, but shows an object once all of it is there.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import TypeAlias
from urllib.parse import urlsplit

from flightd.core.errors import InputError, UnavailableError
from flightd.runtime.durable_files import sync_folder
from flightd.runtime.remote_errors import remote_errors
from flightd.runtime.remote_files import BUCKETS, close_files, file_system

Stamp: TypeAlias = tuple[int, str]
"""Size and time of a file: another whenever it is written."""
_WRITTEN_STILL = (".tmp", ".part", ".partial", ".filepart", ".crdownload", "~")


class SharedFolder:
    """The folder at `address`, which `key` of `file` names, for the command or option `what`.

    Whatever it refuses is an UnavailableError that names all three."""

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
            if self._is_bucket:
                # Its folders are but names.  A bucket has an owner, rights and a price: none is made here.
                self._files.call_s3("head_bucket", Bucket=self._path.partition("/")[0])
            elif make:
                self._files.makedirs(self._path, exist_ok=True)
            elif not self._files.isdir(self._path):
                self.close()
                remedy = "make it, or correct the key"
                raise InputError(f"{address}: there is no such folder", file=file, key=key, remedy=remedy)

    def close(self) -> None:
        """Of a connection."""
        close_files(self._files)

    def listed(self, below: str = "") -> dict[str, Stamp]:
        """Whole files by name; none where there is no folder `below`, which is one of ours."""
        with self._refusals("cannot be listed"):
            path = self._at(below)
            if below and not self._files.isdir(path):
                return {}
            self._files.invalidate_cache()
            found = {PurePosixPath(one["name"]).name: one for one in self._files.ls(path, detail=True)}
        return {
            name: (int(one["size"] or 0), str(one.get("mtime") or one.get("created") or one.get("ETag")))
            for name, one in found.items()
            if one["type"] == "file" and not name.startswith(".") and not name.endswith(_WRITTEN_STILL)
        }

    def has(self, name: str) -> bool:
        """Whether there is a file of this name."""
        with self._refusals(f"{name} cannot be looked for"):
            self._files.invalidate_cache()
            return bool(self._files.isfile(self._at(name)))

    def read(self, name: str, most: int) -> bytes:
        """At most so many bytes of it."""
        with self._refusals(f"{name} cannot be read"), self._files.open(self._at(name), "rb") as stream:
            return bytes(stream.read(most))

    def write(self, name: str, data: bytes) -> None:
        """All of it under its name, or none; on the disk, where that is here."""
        path = PurePosixPath(name)
        beside = self._at(str(path.with_name(f".{path.name}.tmp")))
        with self._refusals(f"{name} cannot be written"):
            if self._is_bucket:
                self._files.pipe_file(self._at(name), data)
                return
            self._make(name)
            with self._files.open(beside, "wb") as stream:
                stream.write(data)
                stream.flush()
                if self._is_here:
                    os.fsync(stream.fileno())
            self._rename(beside, self._at(name))

    def move(self, name: str, to: str) -> None:
        """In the place of what has that name already."""
        with self._refusals(f"{name} cannot be moved to {to}"):
            self._make(to)
            self._rename(self._at(name), self._at(to))

    @property
    def _is_here(self) -> bool:
        return bool(getattr(self._files, "local_file", False))

    def _at(self, name: str) -> str:
        return f"{self._path.rstrip('/')}/{name}" if name else self._path

    def _make(self, name: str) -> None:
        """The folder of ours in which a file shall be."""
        if self._is_bucket:
            return
        parent = str(PurePosixPath(name).parent)
        if parent != "." and not self._files.isdir(self._at(parent)):
            self._files.makedirs(self._at(parent), exist_ok=True)

    def _rename(self, path: str, to: str) -> None:
        self._files.mv(path, to)
        if self._is_here:
            for folder in {Path(path).parent, Path(to).parent}:
                sync_folder(folder)

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
