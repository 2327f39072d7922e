"""Evidence pictures: small JPEG files named by their SHA-256, on the disk before anything refers to them."""

from __future__ import annotations

import contextlib
import os
import threading
from pathlib import Path

from flightd.core.errors import UnavailableError
from flightd.runtime.durable_files import replace_file, sync_folder
from flightd.vision.shelf.evidence_jpeg import MOST_BYTES, picture_name


def evidence_name(jpeg: bytes) -> str:
    """The name under which a picture is kept.  ValueError above 50 KB."""
    if len(jpeg) > MOST_BYTES:
        raise ValueError(f"evidence of {len(jpeg)} bytes; at most {MOST_BYTES} are kept")
    return picture_name(jpeg)


def evidence_file(name: str) -> str:
    """Where the picture `name` is in its folder: ab/abcd….jpg."""
    return f"{name[:2]}/{name}.jpg"


class EvidenceFolder:
    """Pictures by content: FOLDER/ab/abcd….jpg.  The same picture twice is one file, at one time, too."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def path(self, name: str) -> Path:
        """Where the picture `name` is, or would be."""
        return self._folder / evidence_file(name)

    def keep(self, jpeg: bytes) -> str:
        """Write a picture through to the disk and return its name.

        Raises ValueError above 50 KB and UnavailableError when the disk refuses."""
        name = evidence_name(jpeg)
        target = self.path(name)
        if target.exists():
            return name
        part = target.with_name(f"{name}.{os.getpid()}.{threading.get_ident()}.part")
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            replace_file(target, part, jpeg)
            sync_folder(self._folder)
        except OSError as err:
            with contextlib.suppress(OSError):
                part.unlink()  # each try on a full disk would leave one
            raise UnavailableError(f"{target}: cannot keep the picture: {err.strerror or err}") from err
        return name

    def clean(self) -> None:
        """Take away what a power cut left half written."""
        for part in self._folder.glob("*/*.part"):
            part.unlink(missing_ok=True)
