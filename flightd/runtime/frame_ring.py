"""Frames in shared memory: one writer fills slots in turn, readers look at them without a copy.

A slot holds a header (sequence number, capture time) and the pixels.  The writer marks a slot as being
written (sequence -1) before it touches the pixels; a reader checks the sequence before and after its
work, so a frame that was overwritten meanwhile is noticed, never used by mistake.
"""

from __future__ import annotations

import contextlib
import mmap
import os
import secrets
import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flightd.core.errors import TransientError, UnavailableError
from flightd.core.types import Image

_HEADER = struct.Struct("<qq")
_ALIGN = 64
_FOLDER = Path("/dev/shm")  # noqa: S108 - memory, not a temporary folder; names are random, mode 0600


@dataclass(frozen=True, slots=True)
class FrameTicket:
    """Where a frame lies and when it was taken: all that the daemon's own process handles of it.

    `stamp_ns` is mid-exposure, `arrival_ns` the time at which it could first be read, both in the
    daemon's clock; `exposure` and `gain` the parts of the camera's usual ones that it was taken with.
    """

    ring: str
    slot: int
    slots: int
    seq: int
    stamp_ns: int
    arrival_ns: int
    width_px: int
    height_px: int
    exposure: float = 1.0
    gain: float = 1.0


class FrameRing:
    """Memory-mapped file of `slots` BGR frames of one size; `create` owns it, `attach` reads it."""

    def __init__(self, path: Path, slots: int, width_px: int, height_px: int, owner: bool) -> None:
        self.name = path.name
        self.slots = slots
        self.width_px = width_px
        self.height_px = height_px
        self._path = path
        self._owner = owner
        self._stride = -(-(_HEADER.size + width_px * height_px * 3) // _ALIGN) * _ALIGN
        size = self._stride * slots
        try:
            fd = os.open(path, os.O_RDWR | (os.O_CREAT | os.O_EXCL if owner else 0), 0o600)
        except OSError as err:
            raise UnavailableError(f"shared frame memory {path.name}: {err.strerror}") from err
        try:
            if owner:
                _reserve(fd, path, size)
            elif os.fstat(fd).st_size < size:
                raise UnavailableError(f"shared frame memory {path.name} is smaller than {slots} frames")
            self._memory = mmap.mmap(fd, size)
        except OSError as err:
            raise UnavailableError(f"shared frame memory {path.name}, {size} bytes: {err.strerror}") from err
        finally:
            os.close(fd)

    @classmethod
    def create(cls, slots: int, width_px: int, height_px: int) -> FrameRing:
        """A new ring.  What processes that were killed have left of theirs is removed on the way."""
        _sweep()
        path = _FOLDER / f"flightd-{os.getpid()}-{secrets.token_hex(4)}"
        return cls(path, slots, width_px, height_px, owner=True)

    @classmethod
    def attach(cls, name: str, slots: int, width_px: int, height_px: int) -> FrameRing:
        if not name.startswith("flightd-") or "/" in name:
            raise UnavailableError(f"{name!r} is not the name of shared frame memory")
        return cls(_FOLDER / name, slots, width_px, height_px, owner=False)

    def pixels(self, slot: int) -> Image:
        """(H, W, 3) view of a slot, for the writer between `begin` and `publish`, or for a checked read."""
        offset = slot * self._stride + _HEADER.size
        count = self.width_px * self.height_px * 3
        flat = np.frombuffer(self._memory, dtype=np.uint8, count=count, offset=offset)
        return flat.reshape(self.height_px, self.width_px, 3)

    def begin(self, seq: int) -> int:
        """Claim the slot of frame `seq`; until `publish` readers find it invalid."""
        slot = seq % self.slots
        _HEADER.pack_into(self._memory, slot * self._stride, -1, 0)
        return slot

    def publish(self, slot: int, seq: int, stamp_ns: int) -> None:
        _HEADER.pack_into(self._memory, slot * self._stride, seq, stamp_ns)

    def check(self, slot: int, seq: int) -> None:
        """Raise TransientError when the slot does not hold frame `seq` (any more)."""
        if not 0 <= slot < self.slots:
            raise TransientError(f"frame {seq}: slot {slot} outside the ring of {self.slots}")
        found, _ = _HEADER.unpack_from(self._memory, slot * self._stride)
        if found != seq:
            raise TransientError(f"frame {seq} was overwritten before it was read")

    def close(self) -> None:
        """Forget the mapping (views must be gone) and, as owner, the file."""
        with contextlib.suppress(BufferError):
            self._memory.close()
        if self._owner:
            with contextlib.suppress(FileNotFoundError):
                self._path.unlink()


def _reserve(fd: int, path: Path, size: int) -> None:
    """Take the memory now: a full /dev/shm must fail here, not as a bus error in flight."""
    try:
        os.posix_fallocate(fd, 0, size)
    except OSError:
        path.unlink(missing_ok=True)
        raise


def _sweep() -> None:
    for path in _FOLDER.glob("flightd-*-*"):
        pid = path.name.split("-")[1]
        if pid.isdigit() and not Path("/proc", pid).exists():
            with contextlib.suppress(OSError):  # another user's, or gone already
                path.unlink()
