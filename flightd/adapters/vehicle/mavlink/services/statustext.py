"""STATUSTEXT: long texts in chunks, both ways."""

from __future__ import annotations

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.link.codec import Message
from flightd.core.types import EventLevel

_CHUNK = 50
_CHUNKS_MAX = 4

SEVERITIES = {
    EventLevel.INFO: dialect.MAV_SEVERITY_INFO,
    EventLevel.WARNING: dialect.MAV_SEVERITY_WARNING,
    EventLevel.ERROR: dialect.MAV_SEVERITY_ERROR,
}


def make_texts(severity: int, text: str, text_id: int) -> list[Message]:
    """The messages that carry `text`: one with id 0 when it fits, else up to four chunks of one id > 0.
    The last one is never full: by that its end is told."""
    data = text.encode("ascii", "replace")[: _CHUNK * _CHUNKS_MAX - 1]
    if len(data) <= _CHUNK:
        return [dialect.MAVLink_statustext_message(severity, data)]
    chunks = [data[at : at + _CHUNK] for at in range(0, len(data) + 1, _CHUNK)]
    return [
        dialect.MAVLink_statustext_message(severity, chunk, text_id, number)
        for number, chunk in enumerate(chunks)
    ]


class TextAssembler:
    """Joins the chunks of one sender; a missing chunk shows as an ellipsis."""

    def __init__(self) -> None:
        self._id = 0
        self._severity = 0
        self._next = 0
        self._parts: list[str] = []

    def add(self, message: Message) -> list[tuple[int, str]]:
        """(severity, text) of every text that this message completes.

        A text ends with a chunk shorter than 50 characters; one that stays open is given out when
        another begins, by its id or, from a sender that never changes it, with a chunk 0.
        """
        text = str(message.text)
        if message.id == 0:
            return [(int(message.severity), text)]
        done = []
        number = message.chunk_seq
        if message.id != self._id or (number == 0 and self._parts != [text]):
            done = self._flush()
            self._id, self._severity = message.id, int(message.severity)
        if number < self._next:
            return done  # it came twice, or too late to find its place
        if number > self._next:
            self._parts.append("...")
        self._next = number + 1
        if number < _CHUNKS_MAX * 2:
            self._parts.append(text)
        if len(text) < _CHUNK or number >= _CHUNKS_MAX * 2:
            done += self._flush()
        return done

    def _flush(self) -> list[tuple[int, str]]:
        whole = [(self._severity, "".join(self._parts))] if self._parts else []
        self._id, self._next, self._parts = 0, 0, []
        return whole
