"""The drone's live video: H.264 in PaVE frames, one encoder per connection.

Both cameras arrive as 640x360 on one stream.  A connection first gets pictures that lean on an IDR it
never saw, then an IDR every 15 frames; a client that reads too slowly loses frames, which shows as a gap
in the frame numbers.
"""

from __future__ import annotations

import enum
import fractions
import struct
from typing import Any

import av
import cv2

from flightd.core.types import Image

WIDTH_PX, HEIGHT_PX = 640, 360
CODED_HEIGHT_PX = 368
IDR_PERIOD = 15

_NAL_SPS, _NAL_PPS, _NAL_IDR, _NAL_SLICE = 7, 8, 5, 1
_START_CODE = b"\0\0\0\1"


class VideoChannel(enum.IntEnum):
    FRONT = 0
    BOTTOM = 1


class Encoder:
    """H.264 as the drone writes it: baseline, one slice, Annex B, SPS and PPS before every IDR."""

    def __init__(self, quality_crf: int = 22) -> None:
        context: Any = av.CodecContext.create("libx264", "w")
        context.width, context.height, context.pix_fmt = WIDTH_PX, HEIGHT_PX, "yuv420p"
        context.time_base = fractions.Fraction(1, 30)
        context.thread_count = 1
        context.options = {
            "profile": "baseline",
            "crf": str(quality_crf),
            "preset": "ultrafast",
            "tune": "zerolatency",
            "x264-params": f"keyint={IDR_PERIOD}:min-keyint={IDR_PERIOD}:scenecut=0:repeat-headers=1:annexb=1"
            ":threads=1:sliced-threads=0",
        }
        self._context = context
        self._count = 0

    def encode(self, bgr: Image) -> list[bytes]:
        """The picture's NAL units (SPS and PPS first when it is an IDR), without start codes."""
        if bgr.shape[:2] != (HEIGHT_PX, WIDTH_PX):
            bgr = cv2.resize(bgr, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_AREA).astype(bgr.dtype)
        frame: Any = av.VideoFrame.from_ndarray(bgr, format="bgr24")
        frame.pts = self._count
        self._count += 1
        data = b"".join(bytes(packet) for packet in self._context.encode(frame))
        units = [unit.lstrip(b"\0") for unit in data.split(b"\0\0\1")[1:]]
        kept = (_NAL_SPS, _NAL_PPS, _NAL_IDR, _NAL_SLICE)
        return [_without_padding(unit) for unit in units if unit and unit[0] & 0x1F in kept]


def _without_padding(unit: bytes) -> bytes:
    """Strip the zero byte that belongs to the next unit's four-byte start code."""
    return unit.rstrip(b"\0")


def is_idr(units: list[bytes]) -> bool:
    return any(unit[0] & 0x1F == _NAL_IDR for unit in units)


class Packer:
    """Puts PaVE headers before the pictures of one stream."""

    def __init__(self, header_size: int = 64, first_number: int = 1) -> None:
        if header_size not in (64, 68):
            raise ValueError(f"PaVE headers have 64 or 68 bytes, not {header_size}")
        self._header_size = header_size
        self._number = first_number
        self._position = 0

    def skip(self) -> None:
        """A picture was dropped: its number is used up."""
        self._number += 1

    def pack(self, units: list[bytes], timestamp_ms: int) -> bytes:
        payload = b"".join(_START_CODE + unit for unit in units)
        sizes = {unit[0] & 0x1F: len(_START_CODE) + len(unit) for unit in units}
        sps, pps = sizes.get(_NAL_SPS, 0), sizes.get(_NAL_PPS, 0)
        idr = is_idr(units)
        header = struct.pack(
            "<4sBBHIHHHHIIBBBBIIHBBBBHI",
            b"PaVE",
            2,
            4,
            self._header_size,
            len(payload),
            WIDTH_PX,
            CODED_HEIGHT_PX,
            WIDTH_PX,
            HEIGHT_PX,
            self._number,
            timestamp_ms & 0xFFFFFFFF,
            1,
            0,
            1 if idr else 3,
            0,
            self._position & 0xFFFFFFFF,
            self._position >> 32,
            1,
            1,
            0,
            sps,
            pps,
            0,
            len(payload),
        )
        self._number += 1
        self._position += len(payload) - sps - pps
        return header.ljust(self._header_size, b"\0") + payload
