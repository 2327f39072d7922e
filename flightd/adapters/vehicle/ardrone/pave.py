"""PaVE: the framing of the AR.Drone 2.0's video on TCP 5555.

Every encoded picture comes behind a little-endian header that names its own size (64 or 68 bytes in the
field; older notes speak of 76) and the payload's.  The parser finds "PaVE" again after anything broken.
"""

from __future__ import annotations

import enum
import struct
from dataclasses import dataclass

MAGIC = b"PaVE"
CODEC_H264 = 4

_HEADER = struct.Struct("<4sBBHIHHHHIIBBBBIIHBBBBHI")
MIN_HEADER_BYTES = 64
MAX_HEADER_BYTES = 256
MAX_PAYLOAD_BYTES = 1 << 20
_MAX_CODEC = 4
_MAX_SIDE_PX = 4096


class FrameType(enum.IntEnum):
    UNKNOWN = 0
    IDR = 1
    I = 2  # noqa: E741  the standard's own name
    P = 3
    HEADERS = 4


class Control(enum.IntEnum):
    DATA = 0
    ADVERTISEMENT = 1
    LAST = 2


@dataclass(frozen=True, slots=True)
class PaveHeader:
    """The fields in wire order; `timestamp_ms` counts from an epoch of the video encoder's own."""

    version: int
    video_codec: int
    header_size: int
    payload_size: int
    encoded_width: int
    encoded_height: int
    display_width: int
    display_height: int
    frame_number: int
    timestamp_ms: int
    total_chunks: int
    chunk_index: int
    frame_type: int
    control: int
    stream_pos_lw: int
    stream_pos_uw: int
    stream_id: int
    total_slices: int
    slice_index: int
    sps_size: int
    pps_size: int
    padding: int
    advertised_size: int

    @property
    def frame_size(self) -> int:
        """Header and payload, bytes; an advertisement announces a payload without carrying it."""
        return self.header_size + (0 if self.control == Control.ADVERTISEMENT else self.payload_size)


@dataclass(frozen=True, slots=True)
class PaveFrame:
    """One header with its payload (Annex B NAL units for H.264); an advertisement has none."""

    header: PaveHeader
    payload: bytes


def parse_header(data: bytes | bytearray, at: int = 0) -> PaveHeader | None:
    """The header at `at`, or None when no encoder can have written it; needs `MIN_HEADER_BYTES` there."""
    magic, *fields = _HEADER.unpack_from(data, at)
    header = PaveHeader(*fields)
    sound = (
        magic == MAGIC
        and MIN_HEADER_BYTES <= header.header_size <= MAX_HEADER_BYTES
        and header.payload_size <= MAX_PAYLOAD_BYTES
        and header.video_codec <= _MAX_CODEC
        and header.frame_type <= FrameType.HEADERS
        and header.control <= Control.LAST
        and header.chunk_index < max(1, header.total_chunks)
        and header.slice_index < max(1, header.total_slices)
        and 0 < header.display_width <= header.encoded_width <= _MAX_SIDE_PX
        and 0 < header.display_height <= header.encoded_height <= _MAX_SIDE_PX
    )
    return header if sound else None


class PaveParser:
    """Cuts a byte stream into frames; fed in chunks of any size, it hands each frame on with its last byte.

    A header met inside a payload means that the outer frame lost bytes or its size lied: the outer one is
    dropped and the stream taken up at the inner, so damage never costs the sound frames behind it.
    `skipped_bytes` counts what belonged to no frame.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._searched = 0
        self._kept = 0
        self.skipped_bytes = 0

    @property
    def waiting_bytes(self) -> int:
        """What may yet become a frame."""
        return len(self._buffer)

    def feed(self, chunk: bytes) -> list[PaveFrame]:
        self._buffer += chunk
        frames: list[PaveFrame] = []
        while (frame := self._next()) is not None:
            frames.append(frame)
        return frames

    def _next(self) -> PaveFrame | None:
        while self._align():
            header = parse_header(self._buffer)
            if header is None:
                self._skip(1)
                continue
            size = header.header_size + (
                0 if header.control == Control.ADVERTISEMENT else header.payload_size
            )
            inner = self._inner_magic(min(size, len(self._buffer)))
            if inner is not None and len(self._buffer) < inner + MIN_HEADER_BYTES:
                return None
            if inner is not None:
                self._skip(inner)
            elif len(self._buffer) < size:
                return None
            else:
                return self._take(header, size)
        return None

    def _take(self, header: PaveHeader, size: int) -> PaveFrame:
        frame = PaveFrame(header, bytes(self._buffer[header.header_size : size]))
        # A frame that lost its last one to three bytes ends with the start of the next magic: leave it there.
        self._kept = next((n for n in (3, 2, 1) if frame.payload.endswith(MAGIC[:n])), 0)
        del self._buffer[: size - self._kept]
        self._searched = 0
        return frame

    def _align(self) -> bool:
        """Put "PaVE" at the front; True when a whole minimal header stands there."""
        at = self._buffer.find(MAGIC)
        if at < 0:
            at = max(0, len(self._buffer) - len(MAGIC) + 1)
        if at:
            self._skip(at)
        return self._buffer.startswith(MAGIC) and len(self._buffer) >= MIN_HEADER_BYTES

    def _inner_magic(self, end: int) -> int | None:
        """Where a header, sound or not yet whole, starts inside the frame at the front; searches each
        byte once."""
        at = max(self._searched, len(MAGIC))
        while (at := self._buffer.find(MAGIC, at, end)) >= 0:
            self._searched = at
            if at + MIN_HEADER_BYTES > len(self._buffer) or parse_header(self._buffer, at) is not None:
                return at
            at += 1
        self._searched = max(len(MAGIC), end - len(MAGIC) + 1)
        return None

    def _skip(self, count: int) -> None:
        self.skipped_bytes += max(0, count - self._kept)
        self._kept = 0
        del self._buffer[:count]
        self._searched = 0
