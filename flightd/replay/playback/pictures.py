"""The pictures of the down camera in a flight log: where each lies, and what was found in it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import msgspec

from flightd.config.schema import recorded_config
from flightd.core.errors import InputError
from flightd.core.geometry import Lens
from flightd.core.preview import FoundLine, found_lines
from flightd.core.topics import Document, RecordedFrame, Topic
from flightd.core.types import LineSet
from flightd.replay.log import decoded_message
from flightd.replay.log_chunks import LogChunks

MOST_PICTURES = 20_000
"""Of a longer flight the rest is left out: at one a second it is more than five hours."""
_MOST_CHUNKS = 200


HeadT = TypeVar("HeadT", bound=msgspec.Struct)


class _Head(msgspec.Struct):
    seq: int


class _LinesHead(msgspec.Struct):
    frame_seq: int


@dataclass(frozen=True, slots=True)
class PicturePlace:
    """Where a picture and its lines lie in the log; `lines_at` is None where none were recorded."""

    seq: int
    stamp_ns: int
    frame_at: tuple[int, int]
    lines_at: tuple[int, int] | None


@dataclass(frozen=True, slots=True)
class Picture:
    """A recorded picture, and the lines that were found in it."""

    seq: int
    stamp_ns: int
    jpeg: bytes
    lines: tuple[FoundLine, ...]


def find_pictures(path: Path) -> tuple[PicturePlace, ...]:
    """All pictures of a log in the order of their stamps.  InputError as `LogChunks`."""
    frames: dict[int, tuple[int, tuple[int, int]]] = {}
    lines: dict[int, tuple[int, int]] = {}
    with LogChunks(path) as log:
        for found in log.messages(log.chunks, {Topic.FRAME, Topic.LINES}):
            at = (found.chunk_at, found.inner_at)
            if found.topic == Topic.LINES:
                if (lines_of := _peeked(_LinesHead, found.payload)) is not None:
                    lines[lines_of.frame_seq] = at
            elif len(frames) < MOST_PICTURES and (head := _peeked(_Head, found.payload)) is not None:
                frames[head.seq] = (found.stamp_ns, at)
    places = (PicturePlace(seq, stamp_ns, at, lines.get(seq)) for seq, (stamp_ns, at) in frames.items())
    return tuple(sorted(places, key=lambda place: place.stamp_ns))


def read_picture(path: Path, place: PicturePlace, lens: Lens | None) -> Picture:
    """One picture with its lines, where they show in it through `lens`.  InputError where the log holds it
    no more."""
    with LogChunks(path) as log:
        frame = decoded_message(path, Topic.FRAME, log.payload_at(*place.frame_at))
        seen = None
        if place.lines_at is not None:
            seen = decoded_message(path, Topic.LINES, log.payload_at(*place.lines_at))
    if not isinstance(frame, RecordedFrame):
        raise InputError("the picture is in the log no more", file=path)
    lines = found_lines(seen, lens or _plain(seen)) if isinstance(seen, LineSet) else ()
    return Picture(frame.seq, frame.stamp_ns, frame.jpeg, lines)


def middle_picture(path: Path) -> bytes:
    """The JPEG nearest to the middle of a log, looked for in some of its chunks only; empty where there is
    none.  InputError as `LogChunks`."""
    with LogChunks(path) as log:
        middle = len(log.chunks) // 2
        near = sorted(range(len(log.chunks)), key=lambda place: abs(place - middle))[:_MOST_CHUNKS]
        for found in log.messages((log.chunks[place] for place in near), {Topic.FRAME}):
            frame = decoded_message(path, Topic.FRAME, found.payload)
            if isinstance(frame, RecordedFrame):
                return frame.jpeg
    return b""


def recorded_lens(documents: Sequence[Document], path: Path) -> Lens | None:
    """The down camera's lens by the recorded configuration; None where it does not say."""
    try:
        return recorded_config(json.loads(documents[-1].text), path).camera.lens()
    except (IndexError, ValueError, InputError):
        return None


def _plain(seen: LineSet) -> Lens:
    """A lens without distortion: lines show where they were found."""
    width, height = seen.width_px, seen.height_px
    return Lens(width, height, float(width), float(width), (width - 1) / 2, (height - 1) / 2)


def _peeked(kind: type[HeadT], payload: bytes) -> HeadT | None:
    try:
        return msgspec.json.decode(payload, type=kind)
    except msgspec.MsgspecError:
        return None
