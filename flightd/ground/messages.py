"""What goes between the station and its page.

To the page: JSON `{"drone", "topic", "value"}` (the station's own topics have an empty drone), and pictures
as binary messages: four bytes with the length of a JSON head (big endian), the head, the JPEG.  From the
page: `PageMessage` over the WebSocket, an `Act` there too, or by POST.  What a drone says is passed on as
its link says it.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, TypeAlias, TypeVar

import msgspec
from msgspec import Meta

from flightd.adapters.ground_link.messages.answers import PictureAnswer
from flightd.adapters.ground_link.protocol import DECODE_ERRORS
from flightd.core.errors import InputError
from flightd.core.preview import CameraName
from flightd.core.types import CommandKind

MAX_PAGE_MESSAGE_BYTES = 4096
"""A longer message of the page, or act, ends its connection."""

_T = TypeVar("_T")
_Name = Annotated[str, Meta(max_length=64)]


class PictureKey(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Which camera of which drone."""

    drone: _Name
    camera: CameraName


class Want(msgspec.Struct, frozen=True, tag="want", tag_field="say", forbid_unknown_fields=True):
    """The pictures that the page shows now; none while nobody can see it."""

    pictures: Annotated[tuple[PictureKey, ...], Meta(max_length=64)]


class Drawn(msgspec.Struct, frozen=True, tag="drawn", tag_field="say", forbid_unknown_fields=True):
    """The picture that was sent is on the screen, or was given up: the next one may come."""


class Echo(msgspec.Struct, frozen=True, tag="echo", tag_field="say", forbid_unknown_fields=True):
    """To be answered at once with the same number: how long the way to the station and back takes."""

    number: float


class SentAct(msgspec.Struct, frozen=True, tag="act", tag_field="say", forbid_unknown_fields=True):
    """An act for a drone.  It is answered by the station's topic `answer` with the same number, HTTP's status
    and what POST would answer; the act itself is read as POST reads it."""

    number: Annotated[int, Meta(ge=0, le=2**31)]
    drone: _Name
    act: msgspec.Raw


PageMessage: TypeAlias = Want | Drawn | Echo | SentAct


class Act(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A command to one drone; sent again with the same `id` it is done once."""

    id: Annotated[str, Meta(min_length=8, max_length=64)]
    command: CommandKind
    node: _Name = ""
    plan: _Name = ""
    """Only with start: the plan that it is for; empty: whichever stands."""
    session: _Name = ""
    """The flight that the person saw, from `welcome`; empty: the one that the station sees."""
    seen_ns: Annotated[int, Meta(ge=0)] = 0
    """`stamp_ns` of the newest status that the page had; 0: that of the station."""
    waits: bool = False
    """Only with goto: hold there, rather than fly home."""
    lands: bool = False
    """Only with goto: land on the pad there, and wait for another flight."""


class SessionState(msgspec.Struct, frozen=True):
    """Who the page's person is to the station; with `login` and no name: somebody who has to sign in.

    `ends_in_s` is when the session ends at the latest (null: there is none).  `over`: it has ended while a
    drone flew, and until that has landed STOP and Pause are left of it."""

    login: bool
    name: str = ""
    role: str = ""
    ends_in_s: float | None = None
    over: bool = False


class LinkState(msgspec.Struct, frozen=True):
    """How the station hears a drone.

    `heard_s` is the time since its newest status (null: never), `round_trip_ms` that of the newest request
    (null: none was answered lately), `missed` what of its messages never arrived, `trouble` why it is not
    heard, in words.  `attends`: the drone counts this station as one that watches the flight.  `flies`: its
    motors were armed when it was heard last, within this hour."""

    connected: bool
    heard_s: float | None
    round_trip_ms: float | None
    missed: int
    attends: bool
    flies: bool
    trouble: str


@dataclass(frozen=True, slots=True)
class LinkPicture:
    """A camera's picture as the link gave it; `age_ms` since its exposure, as far as the station knows it."""

    answer: PictureAnswer
    age_ms: float | None
    jpeg: bytes


_decode_page: Callable[[str | bytes], PageMessage] = msgspec.json.Decoder(PageMessage).decode
_decode_act: Callable[[str | bytes], Act] = msgspec.json.Decoder(Act).decode
_encode = msgspec.json.encode


def topic_message(drone: str, topic: str, value: Any) -> str:
    """A topic's value as it goes to the page."""
    return _encode({"drone": drone, "topic": topic, "value": value}).decode()


def picture_message(key: PictureKey, picture: LinkPicture) -> bytes:
    """A picture as it goes to the page."""
    answer = picture.answer
    head = {
        "drone": key.drone,
        "camera": key.camera,
        "seq": answer.seq,
        "stamp_ns": answer.stamp_ns,
        "age_ms": picture.age_ms,
        "lines": answer.lines,
        "areas": answer.areas,
    }
    return framed_picture(head, picture.jpeg)


def session_message(state: SessionState) -> str:
    """How it stands with the session as it goes to the page."""
    return topic_message("", "session", state)


def answer_message(number: int, status: int, answer: Mapping[str, Any]) -> str:
    """The answer to a `SentAct` as it goes to the page that sent it."""
    return topic_message("", "answer", {"number": number, "status": status, **answer})


def framed_picture(head: Mapping[str, Any], jpeg: bytes) -> bytes:
    """A picture behind its JSON head, whose length in four bytes comes first."""
    encoded = _encode(head)
    return struct.pack(">I", len(encoded)) + encoded + jpeg


def read_page_message(text: str | bytes) -> PageMessage:
    """What the page says.  InputError for anything else."""
    return _read(_decode_page, text, "not a message of the page")


def read_act(body: bytes) -> Act:
    """The act in a request.  InputError for anything else."""
    act = _read(_decode_act, body, "not an act")
    if (act.command is CommandKind.GOTO) != bool(act.node):
        raise InputError("goto needs a node, the other commands have none")
    return act


def _read(decode: Callable[[str | bytes], _T], text: str | bytes, what: str) -> _T:
    if len(text) > MAX_PAGE_MESSAGE_BYTES:
        raise InputError(f"{what}: longer than {MAX_PAGE_MESSAGE_BYTES} bytes")
    try:
        return decode(text)
    except DECODE_ERRORS as err:
        raise InputError(f"{what}: {err}") from None
