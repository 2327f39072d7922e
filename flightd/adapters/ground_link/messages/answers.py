"""What the daemon answers on the command port to requests of the flight."""

from __future__ import annotations

import enum
from typing import Annotated

import msgspec
from msgspec import Meta

from flightd.adapters.ground_link.messages.base import DaemonAnswer, Role, Session
from flightd.adapters.ground_link.messages.counts import Counts
from flightd.adapters.ground_link.messages.floor import CameraOptics, FloorStatus
from flightd.adapters.ground_link.messages.published import EventReport, StatusReport
from flightd.core.preview import CameraName


class Welcome(DaemonAnswer, frozen=True, tag="welcome"):
    """Who answers, what you may do, what flies where, and what happened last."""

    flightd: Annotated[str, Meta(description="version of the program")]
    session: Session
    role: Annotated[Role, Meta(description="viewer: look; operator: command")]
    client: Annotated[str, Meta(description="your name on the allow-list; `local` without keys")]
    picture_fps: Annotated[
        float, Meta(description="most pictures of each camera per second, all clients together")
    ]
    floor: Annotated[FloorStatus, Meta(description="the map")]
    events: Annotated[tuple[EventReport, ...], Meta(description="newest events, oldest first")]
    cameras: Annotated[tuple[CameraName, ...], Meta(description="those whose pictures may be asked for")] = (
        CameraName.DOWN,
    )
    optics: Annotated[tuple[CameraOptics, ...], Meta(description="of the cameras, as far as known")] = ()


class Accepted(DaemonAnswer, frozen=True, tag="accepted"):
    """The command goes to the mission at its next tick; what it does shows in status and events."""

    repeated: Annotated[bool, Meta(description="this id was done before; it was not done again")] = False


class PlannedPass(msgspec.Struct, frozen=True):
    """How places are counted in passing, in all the aisles where it is the same."""

    aisles: tuple[str, ...]
    levels: Annotated[tuple[int, ...], Meta(description="flown past at once")]
    places: Annotated[int, Meta(description="locations that are counted")]
    height_m: Annotated[float, Meta(description="of the flight, m")]
    distance_m: Annotated[float, Meta(description="from the shelf, m")]
    speed_mps: Annotated[float, Meta(description="m/s")]
    limit: Annotated[
        str, Meta(description="what keeps it from being faster: blur, overlap, cruise, configured")
    ]
    limits_mps: Annotated[dict[str, float], Meta(description="what each limit alone allows, m/s")]
    exposure: Annotated[float, Meta(description="part of the front camera's usual one")]
    px_per_module: Annotated[float, Meta(description="pixels for each module of a label")]
    views: Annotated[float, Meta(description="pictures that show each place whole")]
    fps: Annotated[float, Meta(description="frames that are read, 1/s")]
    needed_fps: Annotated[float, Meta(description="frames that this speed needs, 1/s")]
    swept: Annotated[bool, Meta(description="false: counted by stopping")]
    text: Annotated[str, Meta(description="all that in a line")]
    stops_for: Annotated[
        str,
        Meta(
            description="why by stopping: labels, width (of a place), line, nodes (too few); empty: it is not"
        ),
    ] = ""


class PlannedUnread(msgspec.Struct, frozen=True):
    """Places whose labels are not surely read, from as near as a stop looks from."""

    places: Annotated[int, Meta(description="of those that are counted")]
    px_per_module: Annotated[float, Meta(description="from the aisle's line, at the worst place")]
    within_m: Annotated[float, Meta(description="from the shelf they would be read, m")]
    what: Annotated[str, Meta(description="how many, and whether they are read at all")]
    remedy: Annotated[str, Meta(description="what helps")]


class Planned(DaemonAnswer, frozen=True, tag="planned"):
    """What the flight over the nodes is; not `dry`, it waits for the start."""

    nodes: Annotated[tuple[str, ...], Meta(description="in the order in which they are flown")]
    levels: Annotated[tuple[int, ...], Meta(description="shelf levels that are counted; none: all")]
    way: Annotated[tuple[str, ...], Meta(description="all nodes where it stops or turns, from pad to pad")]
    places: Annotated[int, Meta(description="locations that are counted")]
    way_m: Annotated[float, Meta(description="length of the way, m")]
    seconds: Annotated[float, Meta(description="estimated time in the air, s")]
    batteries: Annotated[int, Meta(description="estimated, with the one that is in it")]
    charge: Annotated[
        float, Meta(description="of the battery that is in it, by which that is estimated, 0..1")
    ]
    battery_s: Annotated[float, Meta(description="time in the air of a full battery down to its reserve, s")]
    sweeps: Annotated[tuple[PlannedPass, ...], Meta(description="what is counted in passing, and how")] = ()
    unread: Annotated[
        PlannedUnread | None, Meta(description="of these places, with labels too small to read; null: none")
    ] = None
    dry: Annotated[bool, Meta(description="only said, not taken")] = False
    repeated: Annotated[bool, Meta(description="this id was done before; it was not done again")] = False


class PlanAnswer(DaemonAnswer, frozen=True, tag="plan"):
    """The plan that is flown, or would be with the next start, and what is left of it."""

    session: Session
    id: Annotated[str, Meta(description="of the order that it came with; empty: the configuration's")]
    nodes: Annotated[tuple[str, ...], Meta(description="nodes to visit, in order")]
    levels: Annotated[tuple[int, ...], Meta(description="shelf levels that are counted; none: all")]
    visited: Annotated[tuple[str, ...], Meta(description="visited so far, in order")]
    remaining: Annotated[tuple[str, ...], Meta(description="still to be visited, in order")]
    counts: Annotated[
        Counts,
        Meta(description="only this is counted at its nodes; null: by `levels`"),
    ] = None


class Code(enum.StrEnum):
    """Why a request was refused."""

    MALFORMED = "malformed"
    VERSION = "version"
    ROLE = "role"
    SESSION = "session"
    ID_REUSED = "id_reused"
    PHASE = "phase"
    NODE = "node"
    PLAN = "plan"
    BUSY = "busy"
    LATE = "late"
    UNAVAILABLE = "unavailable"
    INVALID = "invalid"


class Refused(DaemonAnswer, frozen=True, tag="refused"):
    """The request had no effect."""

    code: Annotated[Code, Meta(description=", ".join(Code))]
    text: Annotated[str, Meta(description="why, and what to do, for a person")]


class StatusAnswer(DaemonAnswer, frozen=True, tag="status"):
    """The newest status."""

    status: Annotated[StatusReport | None, Meta(description="null before the first tick")]


class PictureLine(msgspec.Struct, frozen=True):
    """A painted line that was found in the picture."""

    points: Annotated[
        tuple[tuple[float, float], ...],
        Meta(description="of its centre line, as parts of the picture's width and height"),
    ]
    width: Annotated[float, Meta(description="of the line, as a part of the picture's width")]


class PictureArea(msgspec.Struct, frozen=True):
    """A code or a place of the shelf that was found in the picture."""

    kind: Annotated[str, Meta(description="code or place")]
    text: Annotated[str, Meta(description="the code's text, or the place and what it holds")]
    corners: Annotated[
        tuple[tuple[float, float], ...],
        Meta(description="in order, as parts of the picture's width and height"),
    ]


class PictureAnswer(DaemonAnswer, frozen=True, tag="picture"):
    """A camera's picture; the next frame of the message is the JPEG."""

    seq: Annotated[int, Meta(description="number of the frame")]
    stamp_ns: Annotated[int, Meta(description="middle of its exposure, the daemon's monotonic clock, ns")]
    camera: Annotated[CameraName, Meta(description="which camera's")] = CameraName.DOWN
    lines: Annotated[tuple[PictureLine, ...], Meta(description="painted lines found in it")] = ()
    areas: Annotated[tuple[PictureArea, ...], Meta(description="codes and places found in it")] = ()


class InventoryAnswer(DaemonAnswer, frozen=True, tag="inventory"):
    """What has been counted so far."""

    places: Annotated[
        tuple[dict[str, str], ...],
        Meta(
            description="one object per place; `codes` is the list of its codes in JSON, `texts` has them"
            " joined by spaces"
        ),
    ]
