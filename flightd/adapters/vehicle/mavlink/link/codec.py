"""MAVLink frames to messages and back, on pymavlink's generated dialect but with our own framing.

Own framing because pymavlink's parser skips the whole length that a false start marker claims and so
loses good frames behind it, keeps a torn frame across datagrams, and hands out unknown message ids before
their checksum is looked at.  Here every candidate frame has to decode; if it does not, the search goes on
one byte further, so no sound frame is lost to garbage before or between.
"""

from __future__ import annotations

import os
from typing import Any, TypeAlias

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.link.signing import Signing
from flightd.adapters.vehicle.mavlink.link.wire import layout
from flightd.core.errors import InputError

Message: TypeAlias = Any
"""An instance of one of the dialect's generated message classes."""

COMPANION = dialect.MAV_COMP_ID_ONBOARD_COMPUTER

_MARKER_V2 = dialect.PROTOCOL_MARKER_V2
_MARKER_V1 = dialect.PROTOCOL_MARKER_V1
_SIGNED = dialect.MAVLINK_IFLAG_SIGNED
_OVERHEAD_V2, _OVERHEAD_V1, _SIGNATURE = 12, 8, 13


def refuse_unchecked_frames() -> None:
    """InputError when the environment switches pymavlink's checksum off: noise would fly the vehicle."""
    if "MAV_IGNORE_CRC" in os.environ:
        raise InputError("MAV_IGNORE_CRC is set: it disables MAVLink's checksum; unset it and start again")


class Codec:
    """Packs what we send, with our identity and sequence numbers, and decodes single frames."""

    def __init__(self, system_id: int, component_id: int = COMPANION, signing: Signing | None = None) -> None:
        refuse_unchecked_frames()
        self._mav = dialect.MAVLink(None, srcSystem=system_id, srcComponent=component_id)
        self._signing = signing
        if signing is not None:
            signing.attach(self._mav)

    @property
    def system_id(self) -> int:
        """Ours, from which everything comes."""
        return int(self._mav.srcSystem)

    def pack(self, message: Message) -> bytes:
        """One MAVLink 2 frame; the sequence number counts modulo 256 (pymavlink's `pack` does not)."""
        mav = self._mav
        form = layout(message.get_msgId()) if self._signing is None else None
        if self._signing is not None:
            self._signing.before_pack(mav)
        if form is not None:
            frame = form.pack(message, mav.srcSystem, mav.srcComponent, mav.seq)
        else:
            frame = message.pack(mav)
        mav.seq = (mav.seq + 1) % 256
        return frame

    def decode(self, frame: bytearray) -> Message | None:
        """The message in one whole frame of a known id, or None when its checksum or signature is wrong."""
        if self._signing is not None:
            return self._signing.decode(self._mav, frame)
        if frame[0] == _MARKER_V2 and not frame[2]:
            form = layout(frame[7] | frame[8] << 8 | frame[9] << 16)
            if form is not None:
                return form.read(frame)
        try:
            return self._mav.decode(frame)
        except dialect.MAVError:
            return None


class FrameParser:
    """The frames in what one peer sends; one parser per peer."""

    def __init__(self, codec: Codec) -> None:
        self._codec = codec
        self._pending = bytearray()

    @property
    def pending_bytes(self) -> int:
        """What of a stream waits for the rest of its frame."""
        return len(self._pending)

    def datagram(self, data: bytes) -> list[Message]:
        """The messages of one datagram, which holds whole frames; nothing is kept for the next."""
        messages, _ = self._scan(bytearray(data), whole=True)
        return messages

    def stream(self, chunk: bytes) -> list[Message]:
        """The messages that a chunk of a byte stream completes; an unfinished frame waits for the next."""
        self._pending += chunk
        messages, used = self._scan(self._pending, whole=False)
        del self._pending[:used]
        return messages

    def _scan(self, data: bytearray, *, whole: bool) -> tuple[list[Message], int]:
        messages: list[Message] = []
        at, size = 0, len(data)
        while at < size:
            length = _frame_length(data, at)
            if length is None or (length > size - at and not whole):
                break  # the rest may still become a frame
            message = self._codec.decode(data[at : at + length]) if 0 < length <= size - at else None
            if message is None:
                at += 1
                continue
            messages.append(message)
            # The checksum does not cover a signature: what stands there may be the next frame already.
            at += length - _SIGNATURE if data[at] == _MARKER_V2 and data[at + 2] & _SIGNED else length
        return messages, at


def _frame_length(data: bytearray, at: int) -> int | None:
    """Bytes of the frame that may start at `at`; 0 when none of a known message can, None when more bytes
    are needed to tell."""
    marker = data[at]
    if marker == _MARKER_V2:
        if len(data) - at < 10:
            return None
        flags = data[at + 2]
        message_id = data[at + 7] | data[at + 8] << 8 | data[at + 9] << 16
        if flags & ~_SIGNED or message_id not in dialect.mavlink_map:
            return 0
        return data[at + 1] + _OVERHEAD_V2 + (_SIGNATURE if flags & _SIGNED else 0)
    if marker == _MARKER_V1:
        if len(data) - at < 6:
            return None
        return data[at + 1] + _OVERHEAD_V1 if data[at + 5] in dialect.mavlink_map else 0
    return 0
