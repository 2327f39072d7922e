"""The datagram by which a camera process tells that a picture lies in shared memory."""

from __future__ import annotations

import msgspec

from flightd.core.errors import InputError

VERSION = 1


class FrameNotice(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """`device_ns` is mid-exposure in the camera's own clock; the rest says where the picture is."""

    ring: str
    slots: int
    slot: int
    seq: int
    device_ns: int
    width_px: int
    height_px: int
    version: int = VERSION


_ENCODER = msgspec.json.Encoder()
_DECODER = msgspec.json.Decoder(FrameNotice)


def encode_notice(notice: FrameNotice) -> bytes:
    return _ENCODER.encode(notice)


def decode_notice(datagram: bytes) -> FrameNotice:
    """Raises InputError for anything that is not a notice of this version."""
    try:
        notice = _DECODER.decode(datagram)
    except (msgspec.DecodeError, msgspec.ValidationError, UnicodeDecodeError) as err:
        raise InputError(f"not a picture notice: {err}") from err
    if notice.version != VERSION:
        raise InputError(f"picture notice of version {notice.version}, this is version {VERSION}")
    return notice
