"""Datagrams of a camera process and the daemon: a frame lies in shared memory; an exposure is wanted."""

from __future__ import annotations

import math
from typing import Annotated, TypeAlias, TypeVar

import msgspec

from flightd.core.errors import InputError

VERSION = 1

_MOST_SLOTS = 1024
_MOST_PX = 1 << 14
_INT64 = 1 << 63

_T = TypeVar("_T")
_Slots: TypeAlias = Annotated[int, msgspec.Meta(ge=1, le=_MOST_SLOTS)]
_Slot: TypeAlias = Annotated[int, msgspec.Meta(ge=0, lt=_MOST_SLOTS)]
_Seq: TypeAlias = Annotated[int, msgspec.Meta(ge=0, le=_INT64 - 1)]
_DeviceTime: TypeAlias = Annotated[int, msgspec.Meta(ge=-_INT64, le=_INT64 - 1)]
_Pixels: TypeAlias = Annotated[int, msgspec.Meta(ge=1, le=_MOST_PX)]


class FrameNotice(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """`device_ns` is mid-exposure in the camera's own clock, `exposure` and `gain` the parts of the camera's
    usual ones that the frame was taken with; the rest says where the frame is, within bounds: the processes
    that look there must not die of a number."""

    ring: str
    slots: _Slots
    slot: _Slot
    seq: _Seq
    device_ns: _DeviceTime
    width_px: _Pixels
    height_px: _Pixels
    exposure: float = 1.0
    gain: float = 1.0
    version: int = VERSION


class ExposureRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The daemon's answer to notices of another exposure or gain than it wants: these parts of the usual
    ones."""

    exposure: float
    gain: float = 1.0
    version: int = VERSION


_ENCODER = msgspec.json.Encoder()
_DECODER = msgspec.json.Decoder(FrameNotice)
_REQUESTS = msgspec.json.Decoder(ExposureRequest)


def encode_notice(notice: FrameNotice) -> bytes:
    return _ENCODER.encode(notice)


def decode_notice(datagram: bytes) -> FrameNotice:
    """Raises InputError for anything that is not a notice of this version."""
    notice = _decoded(_DECODER, datagram, "a frame notice")
    if notice.version != VERSION:
        raise InputError(f"frame notice of version {notice.version}, this is version {VERSION}")
    if not (_is_part(notice.exposure) and _is_part(notice.gain)):
        raise InputError(f"not a frame notice: exposure {notice.exposure}, gain {notice.gain}")
    return notice


def encode_request(request: ExposureRequest) -> bytes:
    return _ENCODER.encode(request)


def decode_request(datagram: bytes) -> ExposureRequest:
    """Raises InputError for anything that is not a request of this version."""
    request = _decoded(_REQUESTS, datagram, "an exposure request")
    if request.version != VERSION or not (_is_part(request.exposure) and _is_part(request.gain)):
        told = f"version {request.version}, exposure {request.exposure}, gain {request.gain}"
        raise InputError(f"not an exposure request: {told}")
    return request


def _decoded(decoder: msgspec.json.Decoder[_T], datagram: bytes, what: str) -> _T:
    try:
        return decoder.decode(datagram)
    except (msgspec.DecodeError, msgspec.ValidationError, UnicodeDecodeError) as err:
        raise InputError(f"not {what}: {err}") from err


def _is_part(value: float) -> bool:
    return math.isfinite(value) and value > 0.0
