"""Where frames come from that OpenCV reads: a device, a stream, or a recording."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from pathlib import Path

from flightd.core.errors import InputError
from flightd.core.exposure import AS_IT_IS, ExposureOrder


class SourceKind(enum.StrEnum):
    DEVICE = "device"
    PICAMERA = "picamera"
    STREAM = "stream"
    FILE = "file"
    FOLDER = "folder"

    @property
    def is_live(self) -> bool:
        """Whether frames come when they are exposed, not when they are asked for."""
        return self in {SourceKind.DEVICE, SourceKind.PICAMERA, SourceKind.STREAM}

    @property
    def is_told(self) -> bool:
        """Whether the camera can be told how to expose."""
        return self in {SourceKind.DEVICE, SourceKind.PICAMERA}


@dataclass(frozen=True, slots=True)
class Source:
    """Where frames come from: a path or a stream's URL.  Recordings are played at `fps`, devices set so, and
    to the exposure of `order`."""

    kind: SourceKind
    place: str
    width_px: int
    height_px: int
    fps: float
    order: ExposureOrder = AS_IT_IS

    @property
    def name(self) -> str:
        """As its address has it."""
        return f"{self.kind}:{self.place}"


def parse_source(
    url: str, width_px: int, height_px: int, fps: float, order: ExposureOrder = AS_IT_IS
) -> Source:
    """A `device:`, `picamera:`, `stream:`, `file:` or `folder:` address; InputError for another, or for what
    does not exist."""
    scheme, _, rest = url.partition(":")
    if scheme not in set(SourceKind) or not rest:
        raise InputError(
            f"camera.url {url!r}: expected udp://HOST:PORT, device:PATH, picamera:N, stream:URL, file:PATH or"
            " folder:PATH"
        )
    source = Source(SourceKind(scheme), rest, width_px, height_px, fps, order)
    if source.kind is SourceKind.PICAMERA and not rest.isdecimal():
        raise InputError(f"camera.url {url}: expected the camera's number, for example picamera:0")
    if source.kind is SourceKind.FOLDER and not Path(rest).is_dir():
        raise InputError(f"camera.url {url}: no such folder")
    if source.kind is SourceKind.FILE and not Path(rest).is_file():
        raise InputError(f"camera.url {url}: no such file")
    if source.kind is SourceKind.STREAM and "://" not in rest:
        raise InputError(
            f"camera.url {url}: expected a stream's URL, for example stream:rtsp://10.0.0.2/down"
        )
    return source
