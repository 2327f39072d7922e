"""The ground link: what goes over it, as bytes and back.  The messages stand in `messages`, by what they are
about.

Two sockets of ZMQ, all bodies JSON.  On the status port (PUB) the daemon says `[topic, body]` with the
topics `status` and `event`; on the command port (ROUTER) a client asks with one JSON body and gets one
answer with the `request` it belongs to.  `VERSION` is in every body; whoever speaks another one is told so.
Angles are radians, times nanoseconds of the daemon's monotonic clock, unknown numbers null.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import msgspec

from flightd.adapters.ground_link.messages.answers import (
    Accepted,
    InventoryAnswer,
    PictureAnswer,
    PictureArea,
    PictureLine,
    PlanAnswer,
    Planned,
    Refused,
    StatusAnswer,
    Welcome,
)
from flightd.adapters.ground_link.messages.counts import NodeCount
from flightd.adapters.ground_link.messages.floor import (
    CameraOptics,
    FloorArea,
    FloorLine,
    FloorNode,
    FloorPad,
    FloorRack,
    FloorStatus,
    FloorWay,
)
from flightd.adapters.ground_link.messages.maintenance import (
    AskDoctor,
    AskSettings,
    CheckReport,
    DoctorAnswer,
    ExposureReport,
    FixParameter,
    InstallProfile,
    KeptVersion,
    KeyChange,
    KeyReport,
    Maintenance,
    ProposeSettings,
    Restart,
    SettingsAnswer,
    TakeSettingsBack,
)
from flightd.adapters.ground_link.messages.published import (
    EventReport,
    HazardReport,
    LinkReport,
    Position,
    SeenLine,
    SensorReport,
    StatusReport,
    VehicleReport,
)
from flightd.adapters.ground_link.messages.requests import (
    AskInventory,
    AskPicture,
    AskPlan,
    AskStatus,
    Attend,
    Hello,
    Order,
    PlanFlight,
)

STATUS_TOPIC = b"status"
EVENT_TOPIC = b"event"
MAX_REQUEST_BYTES = 262144
"""A longer request ends its connection; the largest plan with two counts at each node has a third of it."""

Request: TypeAlias = (
    Hello | Order | PlanFlight | AskPlan | AskStatus | AskPicture | AskInventory | Attend | Maintenance
)


class Envelope(msgspec.Struct, frozen=True):
    """The part of a request that any version has; whatever else there is, is not looked at."""

    version: int = 0
    id: str = ""


Answer: TypeAlias = (
    Welcome
    | Accepted
    | Planned
    | PlanAnswer
    | Refused
    | StatusAnswer
    | PictureAnswer
    | InventoryAnswer
    | DoctorAnswer
    | SettingsAnswer
)


_encoder = msgspec.json.Encoder()
encode = _encoder.encode
"""Any message of the link as JSON; a number that is none becomes null."""

decode_envelope = msgspec.json.Decoder(Envelope).decode
decode_request: Callable[[bytes], Request] = msgspec.json.Decoder(Request).decode
decode_answer: Callable[[bytes], Answer] = msgspec.json.Decoder(Answer).decode
decode_status = msgspec.json.Decoder(StatusReport).decode
decode_event = msgspec.json.Decoder(EventReport).decode

DECODE_ERRORS = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)
"""All that decoding bytes of a stranger can raise (msgspec.ValidationError is a DecodeError)."""

PUBLISHED = (StatusReport, EventReport)
REQUESTS = (
    Hello, Order, PlanFlight, AskPlan, AskStatus, AskPicture, AskInventory, Attend, AskDoctor, FixParameter,
    AskSettings, ProposeSettings, TakeSettingsBack, InstallProfile, Restart,
)  # fmt: skip
ANSWERS = (
    Welcome, Accepted, Planned, PlanAnswer, Refused, StatusAnswer, PictureAnswer, InventoryAnswer,
    DoctorAnswer, SettingsAnswer,
)  # fmt: skip
PARTS = (
    NodeCount, Position, SeenLine, VehicleReport, LinkReport, SensorReport, HazardReport, FloorStatus,
    FloorNode, FloorLine, FloorRack, FloorArea, FloorPad, FloorWay, CameraOptics, PictureLine, PictureArea,
    CheckReport, ExposureReport, KeyReport, KeptVersion, KeyChange,
)  # fmt: skip
