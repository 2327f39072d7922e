"""What goes over the ground link: every message, every field, in one place.

Two sockets of ZMQ, all bodies JSON.  On the status port (PUB) the daemon says `[topic, body]` with the
topics `status` and `event`; on the command port (ROUTER) a client asks with one JSON body and gets one
answer with the `request` it belongs to.  `VERSION` is in every body; whoever speaks another one is told so.
Angles are radians, times nanoseconds of the daemon's monotonic clock, unknown numbers null.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable
from typing import Annotated, Any, Literal, TypeAlias

import msgspec
from msgspec import Meta

from flightd.core.planned_flight import MOST_NODES
from flightd.core.preview import CameraName
from flightd.core.types import CommandKind, EventLevel, Phase

VERSION = 1
STATUS_TOPIC = b"status"
EVENT_TOPIC = b"event"
MAX_REQUEST_BYTES = 32768
"""A longer request ends its connection."""


class Role(enum.StrEnum):
    """What a client may do: look, or also command."""

    VIEWER = "viewer"
    OPERATOR = "operator"


_Version = Annotated[int, Meta(description="version of this protocol: 1")]
_Session = Annotated[str, Meta(description="random name of this run of the daemon")]
_Seq = Annotated[int, Meta(description="counts the messages of this topic from 1; a gap is what you missed")]
_Stamp = Annotated[int, Meta(description="the daemon's monotonic clock, ns")]
_RequestId = Annotated[
    str,
    Meta(
        min_length=8,
        max_length=64,
        description="chosen by the client, 8 to 64 characters, never used twice (a UUID); a command sent "
        "again with the same id is answered again, not done again",
    ),
]
_Node = Annotated[str, Meta(max_length=64, description="node of the map, only with goto")]


# What the daemon says on the status port


class Position(msgspec.Struct, frozen=True):
    """Where the drone is on the map."""

    x_m: Annotated[float, Meta(description="m along the aisles")]
    y_m: Annotated[float, Meta(description="m to the right of x, seen from above")]
    yaw_rad: Annotated[float, Meta(description="heading, clockwise from x, seen from above")]
    speed_mps: Annotated[float, Meta(description="speed over the floor, m/s")]
    integrity: Annotated[float, Meta(description="probability that the node is right, 0..1")]
    sigma_x_m: Annotated[float | None, Meta(description="standard deviation of x, m")] = None
    sigma_y_m: Annotated[float | None, Meta(description="standard deviation of y, m")] = None
    sigma_yaw_rad: Annotated[float | None, Meta(description="standard deviation of the heading")] = None


class SeenLine(msgspec.Struct, frozen=True):
    """A painted line that is being tracked, in grid axes centred on the drone."""

    runs: Annotated[Literal["along", "across"], Meta(description="along: parallel to x; across: to y")]
    offset_m: Annotated[float, Meta(description="m from the drone to the line, towards +y (along) or +x")]
    sigma_m: Annotated[float, Meta(description="standard deviation of the offset, m")]


class VehicleReport(msgspec.Struct, frozen=True):
    """The autopilot at one glance."""

    mode: Annotated[str, Meta(description="flight mode in the autopilot's own words")]
    armed: Annotated[bool, Meta(description="motors may turn")]
    in_control: Annotated[bool, Meta(description="it obeys flightd; false: hands off, the pilot flies")]
    landed: Annotated[str, Meta(description="on_ground, in_air or unknown")]
    roll_rad: Annotated[float, Meta(description="+ right side down")]
    pitch_rad: Annotated[float, Meta(description="+ nose up")]
    battery_frac: Annotated[float | None, Meta(description="charge, 0..1")]
    battery_v: Annotated[float | None, Meta(description="V")]
    telemetry_age_s: Annotated[float, Meta(description="age of the newest attitude, s")]
    heartbeat_age_s: Annotated[float, Meta(description="age of the newest heartbeat, s")]
    refusal: Annotated[str, Meta(description="what the vehicle refused last and why, else empty")]


class LinkReport(msgspec.Struct, frozen=True):
    """The ground link's own counters since the daemon started."""

    attending: Annotated[int, Meta(description="clients that attend this flight now")]
    requests: Annotated[int, Meta(description="requests answered")]
    refused: Annotated[int, Meta(description="of these refused, for whatever reason")]
    denied: Annotated[int, Meta(description="connections with a key that is not on the allow-list")]
    dropped: Annotated[int, Meta(description="answers, events and audit lines lost: a queue was full")]


class SensorReport(msgspec.Struct, frozen=True):
    """The drone's own sensors, beyond their configuration; each with its standard deviation."""

    delay_ms: Annotated[float, Meta(description="the camera's, more than `camera.latency_s`, ms")]
    delay_sigma_ms: Annotated[float, Meta(description="standard deviation of the delay, ms")]
    mount_roll_deg: Annotated[float, Meta(description="the camera rolled, its right side down")]
    mount_pitch_deg: Annotated[float, Meta(description="the camera pitched, its front up")]
    mount_sigma_deg: Annotated[float, Meta(description="standard deviation of the mount")]
    tilt_roll_deg: Annotated[float, Meta(description="the roll that is told is too small by this")]
    tilt_pitch_deg: Annotated[float, Meta(description="the pitch that is told is too small by this")]
    tilt_sigma_deg: Annotated[float, Meta(description="standard deviation of the tilt")]
    mount_yaw_deg: Annotated[float, Meta(description="the camera turned in its mount, clockwise from above")]
    mount_yaw_sigma_deg: Annotated[float, Meta(description="standard deviation of that turn")]
    shake_deg: Annotated[float, Meta(description="the picture against the attitude, frame by frame, rms")]


class HazardReport(msgspec.Struct, frozen=True):
    """A hazard that holds now, or held within the last second."""

    text: Annotated[str, Meta(description="what it is")]
    action: Annotated[str, Meta(description="what the drone does about it: hold, land, home, report ...")]
    age_s: Annotated[float, Meta(description="since it was found, s")]


class StatusReport(msgspec.Struct, frozen=True):
    """Topic `status`, ten times a second and at each change of phase; also the answer to `status`."""

    version: _Version
    session: _Session
    seq: _Seq
    stamp_ns: _Stamp
    phase: Annotated[Phase, Meta(description="what the mission does: " + ", ".join(Phase))]
    reason: Annotated[str, Meta(description="why it is in this phase, or what it waits for")]
    node: Annotated[str, Meta(description="nearest node, empty before it is known")]
    goal: Annotated[str, Meta(description="node flown to or hovered at")]
    nodes_done: Annotated[int, Meta(description="planned nodes visited")]
    nodes_planned: Annotated[int, Meta(description="nodes of the plan")]
    height_m: Annotated[float | None, Meta(description="above the floor, m; null before it is known")]
    position: Annotated[Position | None, Meta(description="null before the floor was seen")]
    lines: Annotated[tuple[SeenLine, ...], Meta(description="lines tracked now")]
    lines_age_s: Annotated[float | None, Meta(description="since a line was last seen, s; null: never")]
    vehicle: Annotated[VehicleReport | None, Meta(description="null before it was heard")]
    frames: Annotated[int, Meta(description="frames delivered")]
    frames_dropped: Annotated[int, Meta(description="of these not looked at")]
    fps: Annotated[float, Meta(description="frames used in the last second")]
    latency_ms: Annotated[
        dict[str, float],
        Meta(description="newest frame's stages: capture, transport, detection, track, wire; total"),
    ]
    link: Annotated[LinkReport, Meta(description="the ground link's counters")]
    sensors: Annotated[
        SensorReport | None, Meta(description="what the lines say of them; null before they were seen")
    ] = None
    height_goal_m: Annotated[
        float | None, Meta(description="height that it flies at or makes for, m; 0 on the ground")
    ] = None
    way: Annotated[tuple[str, ...], Meta(description="nodes flown over next, in order; 32 at most")] = ()
    possible: Annotated[tuple[CommandKind, ...], Meta(description="commands that the mission takes now")] = ()
    obstacles: Annotated[
        tuple[str, ...], Meta(description="all that keeps it on the ground while it waits there")
    ] = ()
    hazards: Annotated[tuple[HazardReport, ...], Meta(description="hazards that hold, oldest first")] = ()
    battery_left_s: Annotated[
        float | None, Meta(description="time in the air until only the reserve is left, s")
    ] = None
    home_s: Annotated[float | None, Meta(description="time from the goal down onto a charge pad, s")] = None
    plan: Annotated[
        str, Meta(description="id of the order that the plan came with; empty: the configuration's plan")
    ] = ""


class EventReport(msgspec.Struct, frozen=True):
    """Topic `event`, at once when it happens."""

    version: _Version
    session: _Session
    seq: _Seq
    stamp_ns: _Stamp
    level: Annotated[EventLevel, Meta(description="info, warning or error")]
    name: Annotated[str, Meta(description="what kind of event: phase, visited, command, failure ...")]
    text: Annotated[str, Meta(description="for a person")]


# What a client asks on the command port


class _Request(msgspec.Struct, frozen=True, kw_only=True, tag_field="op", forbid_unknown_fields=True):
    version: _Version
    id: _RequestId


class Hello(_Request, frozen=True, tag="hello"):
    """First of all: do we speak the same protocol, who am I, where does what fly?  Answer: `welcome`."""

    client: Annotated[str, Meta(max_length=64, description="name of the client program, for the log")] = ""


class Order(_Request, frozen=True, tag="command"):
    """A command to the mission; operators only.  Answer: `accepted`, or `refused`."""

    command: Annotated[
        CommandKind, Meta(description=", ".join(CommandKind) + " (plan: by `plan_flight`, not here)")
    ]
    node: _Node = ""
    plan: Annotated[
        str,
        Meta(
            max_length=64,
            description="only with start: id of the order of the plan that it is for; where another one "
            "stands, it does not start",
        ),
    ] = ""
    session: Annotated[
        str, Meta(max_length=64, description="from `welcome`; given, a daemon started since then refuses")
    ] = ""
    seen_ns: Annotated[
        int,
        Meta(
            ge=0,
            description="`stamp_ns` of the newest status that the person had; by one older than 5 s only "
            "stop, land and pause are taken: the order may have lain in a queue",
        ),
    ] = 0


class PlanFlight(_Request, frozen=True, tag="plan_flight", omit_defaults=True):
    """The nodes that the next start flies, for a drone that stands disarmed and was given no start; it does
    not start by that.  Checked by the drone against its map and its battery.  Operators only, but with `dry`.
    Answer: `planned`, or `refused`."""

    nodes: Annotated[
        tuple[Annotated[str, Meta(max_length=64)], ...],
        Meta(max_length=MOST_NODES, description="nodes to visit; none: again what the configuration says"),
    ] = ()
    levels: Annotated[
        tuple[Annotated[int, Meta(ge=1, le=99)], ...],
        Meta(max_length=99, description="shelf levels that are counted there; none: all"),
    ] = ()
    best_order: Annotated[
        bool, Meta(description="in the quickest order (many nodes: aisle by aisle), not as listed")
    ] = False
    dry: Annotated[bool, Meta(description="only say what it would be; by viewers, too")] = False
    session: Annotated[
        str, Meta(max_length=64, description="from `welcome`; given, a daemon started since then refuses")
    ] = ""
    seen_ns: Annotated[
        int, Meta(ge=0, description="`stamp_ns` of the newest status; by one older than 5 s it is refused")
    ] = 0


class AskPlan(_Request, frozen=True, tag="plan"):
    """The plan that is flown, or would be with the next start, and what is left of it.  Answer: `plan`."""


class AskStatus(_Request, frozen=True, tag="status"):
    """The newest status report.  Answer: `status`."""


class AskPicture(_Request, frozen=True, tag="picture", omit_defaults=True):
    """A camera's next picture.  Answer: `picture`, with the JPEG as a second frame."""

    camera: Annotated[CameraName, Meta(description="down or front, of those in `welcome`")] = CameraName.DOWN


class AskInventory(_Request, frozen=True, tag="inventory"):
    """What has been counted.  Answer: `inventory`, or `refused` where no store is kept."""


class Attend(_Request, frozen=True, tag="attend"):
    """ "I watch this flight": operators only, to be repeated at least once a second.  When all who attend
    fall silent for `ground.lost_s`, the ground link counts as lost.  Answer: `accepted`."""

    leave: Annotated[bool, Meta(description="true: I stop watching, my silence means nothing")] = False


_Person = Annotated[str, Meta(max_length=64, description="who asks, for audit log and versions")]
Value: TypeAlias = (
    bool
    | int
    | float
    | Annotated[str, Meta(max_length=200)]
    | Annotated[tuple[bool | int | float | Annotated[str, Meta(max_length=200)], ...], Meta(max_length=200)]
    | None
)
"""A configuration key's value; null: left out, its default holds."""


class AskDoctor(_Request, frozen=True, tag="doctor"):
    """What the drone finds of itself beside its running daemon; operators only, while it stands on the
    ground.  Answer: `doctor`."""


class FixParameter(_Request, frozen=True, tag="fix"):
    """Write the better value of an autopilot's parameter that `doctor` told of, and read it back; operators
    only, while it stands disarmed.  Answer: `doctor`, looked at anew."""

    name: Annotated[str, Meta(min_length=1, max_length=32, description="of the parameter")]
    person: _Person = ""


class AskSettings(_Request, frozen=True, tag="settings"):
    """The configuration as it stands, with what each key means; operators only, while it stands on the
    ground.  Answer: `settings`."""


class ProposeSettings(_Request, frozen=True, tag="propose"):
    """Change keys of the configuration's file; operators only, while it stands disarmed.  The drone checks it
    as a whole, with its site, before it writes.  Answer: `settings`, as they stand then."""

    base: Annotated[str, Meta(max_length=64, description="`tag` of the `settings` that the person saw")]
    changes: Annotated[
        dict[Annotated[str, Meta(max_length=80)], Value],
        Meta(max_length=64, description='by key, as "mission.height_m"; null: leave it out'),
    ]
    person: _Person = ""


class TakeSettingsBack(_Request, frozen=True, tag="take_back"):
    """Bring a kept version of the configuration back: a proposal like any other.  Answer: `settings`."""

    base: Annotated[str, Meta(max_length=64, description="`tag` of the `settings` that the person saw")]
    version_kept: Annotated[int, Meta(ge=1, le=10**9, description="`number` of a kept version")]
    person: _Person = ""


class Restart(_Request, frozen=True, tag="restart"):
    """End the daemon so that systemd starts it anew, by its changed settings; operators only, while it stands
    disarmed.  Answer: `accepted`."""

    person: _Person = ""


Maintenance: TypeAlias = AskDoctor | FixParameter | AskSettings | ProposeSettings | TakeSettingsBack | Restart
"""What looks after a drone on the ground."""
Request: TypeAlias = (
    Hello | Order | PlanFlight | AskPlan | AskStatus | AskPicture | AskInventory | Attend | Maintenance
)


class Envelope(msgspec.Struct, frozen=True):
    """The part of a request that any version has; whatever else there is, is not looked at."""

    version: int = 0
    id: str = ""


# What the daemon answers


class _Answer(msgspec.Struct, frozen=True, kw_only=True, tag_field="answer"):
    version: _Version = VERSION
    request: Annotated[str, Meta(description="id of the request; empty if it could not be read")]


class FloorNode(msgspec.Struct, frozen=True):
    """A crossing on the map."""

    id: Annotated[str, Meta(description="name")]
    x_m: Annotated[float, Meta(description="m along the aisles")]
    y_m: Annotated[float, Meta(description="m to the right of x")]
    aisle: Annotated[str, Meta(description="of which aisle")] = ""
    levels: Annotated[tuple[int, ...], Meta(description="shelf levels with locations that it faces")] = ()


class FloorLine(msgspec.Struct, frozen=True):
    """A stroke of guide paint."""

    x0_m: Annotated[float, Meta(description="one end")]
    y0_m: Annotated[float, Meta(description="one end")]
    x1_m: Annotated[float, Meta(description="other end")]
    y1_m: Annotated[float, Meta(description="other end")]


class FloorRack(msgspec.Struct, frozen=True):
    """A shelf front: a vertical rectangle parallel to x, which faces its aisle."""

    aisle: Annotated[str, Meta(description="of which aisle")]
    side: Annotated[str, Meta(description="left (towards -y) or right of it")]
    x0_m: Annotated[float, Meta(description="one end")]
    x1_m: Annotated[float, Meta(description="other end")]
    y_m: Annotated[float, Meta(description="where the front stands")]
    height_m: Annotated[float, Meta(description="above the floor")]
    bays_m: Annotated[
        tuple[float, ...], Meta(description="x at which its bays meet and end, rising; empty: not divided")
    ] = ()


class FloorArea(msgspec.Struct, frozen=True):
    """A rectangle of floor over which nothing flies between two heights."""

    x0_m: Annotated[float, Meta(description="smaller x")]
    y0_m: Annotated[float, Meta(description="smaller y")]
    x1_m: Annotated[float, Meta(description="larger x")]
    y1_m: Annotated[float, Meta(description="larger y")]
    from_m: Annotated[float, Meta(description="from this height")]
    to_m: Annotated[float | None, Meta(description="to this height; null: without end")]


class FloorPad(msgspec.Struct, frozen=True):
    """A pad to start from, to land or to charge on."""

    id: Annotated[str, Meta(description="name")]
    x_m: Annotated[float, Meta(description="of its centre")]
    y_m: Annotated[float, Meta(description="of its centre")]
    size_m: Annotated[float, Meta(description="length of its sides")]
    charge: Annotated[bool, Meta(description="batteries are charged or changed here")]


class FloorWay(msgspec.Struct, frozen=True):
    """A line between two nodes that is not simply open."""

    a: Annotated[str, Meta(description="node")]
    b: Annotated[str, Meta(description="node")]
    closed: Annotated[bool, Meta(description="blocked, or too near a keep-out; else one way, from a to b")]


class FloorStatus(msgspec.Struct, frozen=True):
    """The warehouse map, as far as a client draws it."""

    name: Annotated[str, Meta(description="of the site")]
    home: Annotated[str, Meta(description="node of the pad")]
    nodes: Annotated[tuple[FloorNode, ...], Meta(description="every node")]
    lines: Annotated[tuple[FloorLine, ...], Meta(description="every painted line")]
    line_width_m: Annotated[float, Meta(description="width of the paint; 0: not told")] = 0.0
    line_colour: Annotated[
        str, Meta(description="colour of the paint, or its tone as #rrggbb; empty: not told")
    ] = ""
    racks: Annotated[tuple[FloorRack, ...], Meta(description="every shelf front")] = ()
    keep_outs: Annotated[tuple[FloorArea, ...], Meta(description="every keep-out")] = ()
    pads: Annotated[tuple[FloorPad, ...], Meta(description="every pad")] = ()
    ways: Annotated[tuple[FloorWay, ...], Meta(description="closed and one-way lines")] = ()


class CameraOptics(msgspec.Struct, frozen=True):
    """A camera's lens, and how it sits in the drone: as its configuration has them."""

    camera: Annotated[CameraName, Meta(description="which camera's")]
    width_px: Annotated[int, Meta(description="width of its frames; pictures may be smaller")]
    height_px: Annotated[int, Meta(description="height of its frames")]
    fx_px: Annotated[float, Meta(description="focal length in x, at the frames' size")]
    fy_px: Annotated[float, Meta(description="focal length in y")]
    cx_px: Annotated[float, Meta(description="principal point x; pixels' centres are integers")]
    cy_px: Annotated[float, Meta(description="principal point y")]
    distortion: Annotated[
        tuple[float, float, float, float, float], Meta(description="k1 k2 p1 p2 k3, OpenCV's order")
    ]
    offset_m: Annotated[
        tuple[float, float, float],
        Meta(description="forward, right, down of the point whose height is reported"),
    ]
    turn: Annotated[
        tuple[float, float, float, float],
        Meta(
            description="quaternion x y z w that turns the picture's axes (right, down, ahead) into the "
            "drone's (forward, right, down)"
        ),
    ]


class Welcome(_Answer, frozen=True, tag="welcome"):
    """Who answers, what you may do, what flies where, and what happened last."""

    flightd: Annotated[str, Meta(description="version of the program")]
    session: _Session
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


class Accepted(_Answer, frozen=True, tag="accepted"):
    """The command goes to the mission at its next tick; what it does shows in status and events."""

    repeated: Annotated[bool, Meta(description="this id was done before; it was not done again")] = False


class Planned(_Answer, frozen=True, tag="planned"):
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
    dry: Annotated[bool, Meta(description="only said, not taken")] = False
    repeated: Annotated[bool, Meta(description="this id was done before; it was not done again")] = False


class PlanAnswer(_Answer, frozen=True, tag="plan"):
    """The plan that is flown, or would be with the next start, and what is left of it."""

    session: _Session
    id: Annotated[str, Meta(description="of the order that it came with; empty: the configuration's")]
    nodes: Annotated[tuple[str, ...], Meta(description="nodes to visit, in order")]
    levels: Annotated[tuple[int, ...], Meta(description="shelf levels that are counted; none: all")]
    visited: Annotated[tuple[str, ...], Meta(description="visited so far, in order")]
    remaining: Annotated[tuple[str, ...], Meta(description="still to be visited, in order")]


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


class Refused(_Answer, frozen=True, tag="refused"):
    """The request had no effect."""

    code: Annotated[Code, Meta(description=", ".join(Code))]
    text: Annotated[str, Meta(description="why, and what to do, for a person")]


class StatusAnswer(_Answer, frozen=True, tag="status"):
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


class PictureAnswer(_Answer, frozen=True, tag="picture"):
    """A camera's picture; the next frame of the message is the JPEG."""

    seq: Annotated[int, Meta(description="number of the frame")]
    stamp_ns: Annotated[int, Meta(description="middle of its exposure, the daemon's monotonic clock, ns")]
    camera: Annotated[CameraName, Meta(description="which camera's")] = CameraName.DOWN
    lines: Annotated[tuple[PictureLine, ...], Meta(description="painted lines found in it")] = ()
    areas: Annotated[tuple[PictureArea, ...], Meta(description="codes and places found in it")] = ()


class InventoryAnswer(_Answer, frozen=True, tag="inventory"):
    """What has been counted so far."""

    places: Annotated[tuple[dict[str, str], ...], Meta(description="one object per place")]


class CheckReport(msgspec.Struct, frozen=True):
    """One thing that was looked at."""

    name: Annotated[str, Meta(description="what was looked at")]
    level: Annotated[str, Meta(description="ok, warning, error, or unseen: only without the daemon")]
    text: Annotated[str, Meta(description="what was found")]
    remedy: Annotated[str, Meta(description="what a person can do about it, else empty")] = ""
    fix: Annotated[str, Meta(description="name for `fix`, where the drone can mend it itself")] = ""


class DoctorAnswer(_Answer, frozen=True, tag="doctor"):
    """What the drone finds of itself."""

    fit: Annotated[bool, Meta(description="no error among the checks")]
    checks: Annotated[tuple[CheckReport, ...], Meta(description="one by one")]
    versions: Annotated[dict[str, str], Meta(description="program, firmware, Python, libraries")]
    log: Annotated[tuple[str, ...], Meta(description="the daemon's newest log lines, oldest first")]
    outcome: Annotated[str, Meta(description="after `fix`: what was written and read back")] = ""


class KeyReport(msgspec.Struct, frozen=True):
    """A key of the configuration: what it takes, and what it means."""

    section: Annotated[str, Meta(description="its table in the file")]
    key: Annotated[str, Meta(description="its name there")]
    type: Annotated[str, Meta(description="what it takes, in words of the file's format")]
    unit: Annotated[str, Meta(description="of its numbers, else empty")]
    range: Annotated[str, Meta(description="values that are taken, else empty")]
    default: Annotated[str, Meta(description='as the file writes it; "required": there is none')]
    text: Annotated[str, Meta(description="what it means")]
    fixed: Annotated[str, Meta(description="why no ground station can change it, else empty")]


class KeyChange(msgspec.Struct, frozen=True):
    """A key before and after a change."""

    key: Annotated[str, Meta(description="section and name")]
    before: Annotated[Value, Meta(description="null: left out")]
    after: Annotated[Value, Meta(description="null: left out")]


class KeptVersion(msgspec.Struct, frozen=True):
    """The configuration as it stood before a change, and the change."""

    number: Annotated[int, Meta(description="for `take_back`; counts from 1")]
    utc: Annotated[str, Meta(description="when it was changed, UTC")]
    client: Annotated[str, Meta(description="whose key changed it")]
    person: Annotated[str, Meta(description="who, as he said")]
    changes: Annotated[tuple[KeyChange, ...], Meta(description="what was changed then")]


class SettingsAnswer(_Answer, frozen=True, tag="settings"):
    """The configuration's file as it stands."""

    file: Annotated[str, Meta(description="its path on the drone")]
    tag: Annotated[str, Meta(description="names these contents; give it with a proposal")]
    table: Annotated[dict[str, Any], Meta(description="what the file gives; the rest has its default")]
    keys: Annotated[tuple[KeyReport, ...], Meta(description="every key, in the order of the sections")]
    sections: Annotated[dict[str, str], Meta(description="what each section is")]
    versions: Annotated[tuple[KeptVersion, ...], Meta(description="kept versions, newest first")]
    pending: Annotated[bool, Meta(description="the file is not what the daemon runs by: at its next start")]
    locked: Annotated[str, Meta(description="why nothing can be changed from the ground, else empty")]
    restarts: Annotated[bool, Meta(description="`restart` works: systemd starts the daemon anew")]


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
"""Any message of this module as JSON; a number that is none becomes null."""

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
    AskSettings, ProposeSettings, TakeSettingsBack, Restart,
)  # fmt: skip
ANSWERS = (
    Welcome, Accepted, Planned, PlanAnswer, Refused, StatusAnswer, PictureAnswer, InventoryAnswer,
    DoctorAnswer, SettingsAnswer,
)  # fmt: skip
PARTS = (
    Position, SeenLine, VehicleReport, LinkReport, SensorReport, HazardReport, FloorStatus, FloorNode,
    FloorLine, FloorRack, FloorArea, FloorPad, FloorWay, CameraOptics, PictureLine, PictureArea, CheckReport,
    KeyReport, KeptVersion, KeyChange,
)  # fmt: skip


def finite(value: float) -> float | None:
    """The number, or None where JSON has no form for it."""
    return value if math.isfinite(value) else None
