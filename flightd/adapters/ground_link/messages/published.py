"""What the daemon says on the status port: status reports and events."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from flightd.adapters.ground_link.messages.base import Seq, Session, Stamp, Version
from flightd.core.types import CommandKind, EventLevel, Phase


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
    pose_use: Annotated[
        str,
        Meta(description="whether its estimator gets our motion: none, unknown (yet), not_taken or given"),
    ] = "none"


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
    focal_percent: Annotated[float | None, Meta(description="focal length, more than configured, %")] = None
    focal_sigma_percent: Annotated[float | None, Meta(description="standard deviation of that, %")] = None
    height_percent: Annotated[float | None, Meta(description="height, more than the vehicle tells, %")] = None
    height_sigma_percent: Annotated[float | None, Meta(description="standard deviation of that, %")] = None


class HazardReport(msgspec.Struct, frozen=True):
    """A hazard that holds now, or held within the last second."""

    text: Annotated[str, Meta(description="what it is")]
    action: Annotated[str, Meta(description="what the drone does about it: hold, land, home, report ...")]
    age_s: Annotated[float, Meta(description="since it was found, s")]


class StatusReport(msgspec.Struct, frozen=True):
    """Topic `status`, ten times a second and at each change of phase; also the answer to `status`."""

    version: Version
    session: Session
    seq: Seq
    stamp_ns: Stamp
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
    waits_at: Annotated[
        str | None,
        Meta(
            description="node ahead at which its way ends: it holds there until another order; empty: it "
            "flies home; null: a daemon that always does"
        ),
    ] = None
    lands_at: Annotated[
        str | None,
        Meta(
            description="node of the pad on which it comes down at last; null: a daemon that takes no `lands`"
        ),
    ] = None
    dropped: Annotated[
        dict[str, int],
        Meta(description="lost since the start, by where, as the metric `flightd_dropped_total`"),
    ] = {}
    restarts: Annotated[
        dict[str, int],
        Meta(description="replaced since the start, by the part, as the metric `flightd_restarts_total`"),
    ] = {}


class EventReport(msgspec.Struct, frozen=True):
    """Topic `event`, at once when it happens."""

    version: Version
    session: Session
    seq: Seq
    stamp_ns: Stamp
    level: Annotated[EventLevel, Meta(description="info, warning or error")]
    name: Annotated[str, Meta(description="what kind of event: phase, visited, command, failure ...")]
    text: Annotated[str, Meta(description="for a person")]
