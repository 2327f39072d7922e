"""Plain MAVLink 2 frames to and from the dialect's messages, by the tables which pymavlink generates.

The same bytes and fields as pymavlink's own `pack` and `decode`, which cost three times as much because
they also serve MAVLink 1, signatures and text: what has any of these is left to them.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable
from itertools import accumulate
from operator import attrgetter, itemgetter
from typing import Any

from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import ardupilotmega as dialect

_HEADER = struct.Struct("<BBBBBBBHB")
_CHECKSUM_BYTES = 2


class Layout:
    """How the payload of one kind of message without text is laid out."""

    def __init__(self, kind: Any) -> None:
        self._kind = kind
        self._id_low, self._id_high = kind.id & 0xFFFF, kind.id >> 16
        self._seed = bytes([kind.crc_extra])
        self._struct: struct.Struct = kind.unpacker
        self._lengths: list[int] = kind.lengths
        starts = list(accumulate(self._lengths, initial=0))
        self._places = [slice(starts[place], starts[place + 1]) for place in kind.orders]
        self._fields = attrgetter(*kind.ordered_fieldnames)
        self._arrange: Callable[[tuple[Any, ...]], Iterable[Any]] = itemgetter(*kind.orders)
        if len(self._lengths) == 1 or max(self._lengths) > 1:
            self._arrange = self._gather

    def pack(self, message: Any, system: int, component: int, sequence: int) -> bytes:
        """The frame of a message; struct.error when a field does not fit its place."""
        values: Any = self._fields(message)
        if self._arrange == self._gather:
            values = self._spread(values)
        payload = self._struct.pack(*values).rstrip(b"\0") or b"\0"
        place = (sequence, system, component, self._id_low, self._id_high)
        frame = _HEADER.pack(dialect.PROTOCOL_MARKER_V2, len(payload), 0, 0, *place) + payload
        checksum: int = mcrf4xx(frame[1:] + self._seed)
        return frame + checksum.to_bytes(_CHECKSUM_BYTES, "little")

    def read(self, frame: bytearray) -> Any | None:
        """The message in a frame whose length is right, or None when its checksum is wrong."""
        if mcrf4xx(bytes(frame[1:-2]) + self._seed) != frame[-2] | frame[-1] << 8:
            return None
        payload = frame[_HEADER.size : -_CHECKSUM_BYTES].ljust(self._struct.size, b"\0")
        message = self._kind(*self._arrange(self._struct.unpack_from(payload)))
        header = message.get_header()
        header.mlen, header.seq, header.srcSystem, header.srcComponent = (
            frame[1],
            frame[4],
            frame[5],
            frame[6],
        )
        return message

    def _spread(self, values: Any) -> list[Any]:
        """The parts of fields and arrays, in the order of the wire."""
        flat: list[Any] = []
        for value, length in zip(values if len(self._lengths) > 1 else (values,), self._lengths, strict=True):
            if length == 1:
                flat.append(value)
            else:
                flat += value[:length]
        return flat

    def _gather(self, values: tuple[Any, ...]) -> list[Any]:
        """Fields and arrays in the order of the constructor."""
        return [
            values[place.start] if place.stop == place.start + 1 else list(values[place])
            for place in self._places
        ]


_LAYOUTS: dict[int, Layout | None] = {
    message_id: None if "char" in kind.fieldtypes else Layout(kind)
    for message_id, kind in dialect.mavlink_map.items()
}


def layout(message_id: int) -> Layout | None:
    """The layout of one kind of message; None when it holds text or is not in the dialect."""
    return _LAYOUTS.get(message_id)
