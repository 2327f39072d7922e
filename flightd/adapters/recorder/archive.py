"""Where flights are kept: one numbered folder each, the oldest removed when the disk gets short."""

from __future__ import annotations

import asyncio
import re
import shutil
from contextlib import suppress
from datetime import datetime
from pathlib import Path

from flightd.adapters.recorder.mcap_repair import is_whole, repair
from flightd.core.errors import InputError, TransientError, UnavailableError
from flightd.runtime.disk_threads import on_disk

LOG_NAME = "flight.mcap"

ROOM_S = 30.0
"""In a flight the disk is looked at this often."""

_FLIGHT = re.compile(r"flight-(\d{6})-\d{8}T\d{6}Z")


class FlightArchive:
    """The flights in one folder.

    Folders are numbered because the clock of a companion computer may be wrong until it meets a
    network: the number tells what is oldest, the time in the name is for people.  Only folders of
    that form are ever removed, and never the one that was begun last by this object.
    """

    def __init__(self, folder: Path, quota_bytes: int, reserve_bytes: int = 0) -> None:
        """Keep at most `quota_bytes` in `folder` and at least `reserve_bytes` free on its disk."""
        self._folder = folder
        self._quota_bytes = quota_bytes
        self._reserve_bytes = reserve_bytes
        self._in_progress: Path | None = None

    def flights(self) -> list[Path]:
        """The flights' folders, oldest first."""
        if not self._folder.is_dir():
            return []
        numbered = ((_FLIGHT.fullmatch(path.name), path) for path in self._folder.iterdir())
        return [path for _, path in sorted((match[1], path) for match, path in numbered if match)]

    def begin(self, started: datetime) -> Path:
        """Make room for a new flight (`started` in UTC), and its folder; returns its log's path."""
        flights = self.flights()
        newest = _FLIGHT.fullmatch(flights[-1].name) if flights else None
        number = int(newest[1]) + 1 if newest else 1
        folder = self._folder / f"flight-{number:06d}-{started:%Y%m%dT%H%M%SZ}"
        self._in_progress = None
        with suppress(OSError):
            self.make_room()  # first: a full disk has none for a folder either
        try:
            folder.mkdir(parents=True)
        except OSError as err:
            raise UnavailableError(f"{folder}: cannot make the flight's folder: {err.strerror}") from None
        self._in_progress = folder
        return folder / LOG_NAME

    async def run(self) -> None:
        """Mend what earlier flights left behind, then keep room on the disk, for ever; works in a thread,
        beside the flight.  TransientError when the disk refuses."""
        await on_disk(self.mend)
        while True:
            await asyncio.sleep(ROOM_S)
            try:
                await on_disk(self.make_room)
            except OSError as err:
                text = f"{self._folder}: cannot make room for the flight's log: {err.strerror}"
                raise TransientError(text) from err

    def mend(self) -> list[Path]:
        """Repair the logs of earlier flights that were cut off; returns those that were changed.

        One that is still being written (a writer outlives its daemon for a moment) stays as it is."""
        mended = []
        for folder in self.flights():
            log = folder / LOG_NAME
            with suppress(InputError, OSError):  # none, not a log, in use, or the disk is full
                if folder != self._in_progress and not is_whole(log):
                    repair(log)
                    mended.append(log)
        return mended

    def make_room(self) -> list[Path]:
        """Remove the oldest flights until quota and reserve are kept; returns what was removed.

        OSError if the disk cannot be asked."""
        flights = [folder for folder in self.flights() if folder != self._in_progress]
        sizes = {folder: _bytes(folder) for folder in flights}
        used = sum(sizes.values()) + (_bytes(self._in_progress) if self._in_progress else 0)
        removed = []
        for folder in flights:
            if used <= self._quota_bytes and self._free_bytes() >= self._reserve_bytes:
                break
            shutil.rmtree(folder, ignore_errors=True)
            used -= sizes[folder]
            removed.append(folder)
        return removed

    def _free_bytes(self) -> int:
        return shutil.disk_usage(self._folder).free


def _bytes(folder: Path) -> int:
    """What a flight's files take on the disk."""
    total = 0
    for path in folder.rglob("*"):
        with suppress(OSError):  # gone meanwhile
            total += path.lstat().st_blocks * 512
    return total
