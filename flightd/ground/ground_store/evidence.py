"""The pictures of a store: files named by the SHA-256 of what is in them."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from flightd.adapters.store.evidence_pictures import EvidenceFolder, evidence_file, evidence_name
from flightd.core.errors import InputError, UnavailableError
from flightd.ground.ground_store.batch import is_sha256
from flightd.ground.plain_files import plain_file
from flightd.ground.shared_folder import SharedFolder
from flightd.vision.shelf.evidence_jpeg import MOST_BYTES, picture_name


class Evidence(Protocol):
    """Where pictures are.  UnavailableError where they cannot be kept."""

    def has(self, name: str) -> bool:
        """Whether it is there."""
        ...

    def keep(self, jpeg: bytes) -> str:
        """Keep a picture, through to the disk; its name."""
        ...

    def picture(self, name: str) -> bytes:
        """InputError where it is not there."""
        ...


class FolderEvidence:
    """In a folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = EvidenceFolder(folder)

    def has(self, name: str) -> bool:
        return self._folder.path(checked(name)).is_file()

    def keep(self, jpeg: bytes) -> str:
        return self._folder.keep(jpeg)

    def picture(self, name: str) -> bytes:
        jpeg = plain_file(self._folder.path(checked(name)), MOST_BYTES)
        if jpeg is None:
            raise InputError("this picture was not kept")
        return jpeg


class SharedEvidence:
    """In a bucket or on another machine, wherever fsspec reaches."""

    def __init__(self, url: str) -> None:
        """InputError, UnavailableError as `SharedFolder`."""
        self._folder = SharedFolder(url, "", "--evidence", what="--evidence URL", make=True)

    def has(self, name: str) -> bool:
        return self._folder.has(_at(name))

    def keep(self, jpeg: bytes) -> str:
        name = evidence_name(jpeg)
        if not self.has(name):
            self._folder.write(_at(name), jpeg, alone=False)
        return name

    def picture(self, name: str) -> bytes:
        """UnavailableError, too, for one that is not what its name says."""
        if not self.has(name):
            raise InputError("this picture was not kept")
        jpeg = self._folder.read(_at(name), MOST_BYTES)
        if picture_name(jpeg) != name:
            raise UnavailableError("the picture is damaged", file=f"{self._folder.address}/{_at(name)}")
        return jpeg


def _at(name: str) -> str:
    return evidence_file(checked(name))


class NoEvidence:
    """Where nobody said where pictures are to lie: fine as long as there are none."""

    def has(self, name: str) -> bool:
        raise _untold(f"picture {name}")

    def keep(self, jpeg: bytes) -> str:
        raise _untold(f"a picture of {len(jpeg)} bytes")

    def picture(self, name: str) -> bytes:
        raise _untold(f"picture {name}")


def _untold(what: str) -> InputError:
    return InputError(f"{what}: the store has no place for it", remedy="say where: --evidence DIR|URL")


def checked(name: str) -> str:
    """The name of a picture.  InputError for another."""
    if not is_sha256(name):
        raise InputError("not the name of a picture")
    return name
