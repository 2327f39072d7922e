"""A snapshot as the ground link tells it."""

from __future__ import annotations

import math

from flightd.adapters.ground_link.messages.base import VERSION, finite
from flightd.adapters.ground_link.messages.published import (
    HazardReport,
    LinkReport,
    Position,
    SeenLine,
    SensorReport,
    StatusReport,
    VehicleReport,
)
from flightd.core.refusal import words
from flightd.core.snapshot import Snapshot
from flightd.core.tracks import SensorEstimate, TrackSet
from flightd.core.types import CommandKind, GridPose, VehicleState


def status_report(snapshot: Snapshot, session: str, seq: int, link: LinkReport) -> StatusReport:
    """The snapshot as it goes over the link."""
    output, vehicle = snapshot.output, snapshot.vehicle
    tracks = output.tracks
    seen = tracks is not None and bool(tracks.lines_ns)
    return StatusReport(
        version=VERSION,
        session=session,
        seq=seq,
        stamp_ns=snapshot.stamp_ns,
        phase=snapshot.phase,
        reason=snapshot.reason,
        node=snapshot.node,
        goal=snapshot.goal,
        nodes_done=snapshot.nodes_done,
        nodes_planned=snapshot.nodes_planned,
        height_m=finite(snapshot.height_m) if output.pose is not None else None,
        position=_position(output.pose) if output.pose is not None else None,
        lines=_lines(tracks) if tracks is not None else (),
        lines_age_s=(snapshot.stamp_ns - tracks.lines_ns) * 1e-9 if tracks is not None and seen else None,
        vehicle=_vehicle(vehicle, snapshot.stamp_ns) if vehicle is not None else None,
        frames=snapshot.frames,
        frames_dropped=snapshot.frames_dropped,
        fps=snapshot.fps,
        latency_ms={stage: round(ms, 2) for stage, ms in snapshot.latency_ms.items()},
        link=link,
        sensors=_sensors(snapshot.sensors) if snapshot.sensors.is_known else None,
        height_goal_m=finite(snapshot.height_goal_m),
        way=snapshot.outlook.way,
        possible=tuple(kind for kind in CommandKind if kind in snapshot.possible),
        obstacles=snapshot.outlook.obstacles,
        hazards=tuple(
            HazardReport(seen.text, seen.action, round((snapshot.stamp_ns - seen.since_ns) * 1e-9, 1))
            for seen in snapshot.outlook.hazards
        ),
        battery_left_s=finite(snapshot.outlook.battery_left_s),
        home_s=finite(snapshot.outlook.home_s),
        plan=snapshot.outlook.plan,
        waits_at=snapshot.outlook.waits_at,
        lands_at=snapshot.outlook.lands_at,
        dropped=dict(snapshot.dropped),
        restarts=dict(snapshot.restarts),
    )


def _sensors(known: SensorEstimate) -> SensorReport:
    def degrees(angle_rad: float) -> float:
        return round(math.degrees(angle_rad), 3)

    def percent(share: float) -> float | None:
        return None if math.isnan(share) else round(100.0 * share, 2)

    return SensorReport(
        delay_ms=round(-known.delay_s * 1e3, 2),
        delay_sigma_ms=round(known.delay_sigma_s * 1e3, 2),
        mount_roll_deg=degrees(known.mount_roll_rad),
        mount_pitch_deg=degrees(known.mount_pitch_rad),
        mount_sigma_deg=degrees(known.mount_sigma_rad),
        tilt_roll_deg=degrees(known.tilt_roll_rad),
        tilt_pitch_deg=degrees(known.tilt_pitch_rad),
        tilt_sigma_deg=degrees(known.tilt_sigma_rad),
        mount_yaw_deg=degrees(known.mount_yaw_rad),
        mount_yaw_sigma_deg=degrees(known.mount_yaw_sigma_rad),
        shake_deg=degrees(known.shake_rad),
        focal_percent=percent(known.focal_share),
        focal_sigma_percent=percent(known.scale_sigma),
        height_percent=percent(known.height_share),
        height_sigma_percent=percent(known.height_sigma),
    )


def _position(pose: GridPose) -> Position:
    return Position(
        x_m=pose.x_m,
        y_m=pose.y_m,
        yaw_rad=pose.yaw_rad,
        speed_mps=math.hypot(pose.vx_mps, pose.vy_mps),
        integrity=pose.integrity,
        sigma_x_m=_sigma(pose.covariance[0]),
        sigma_y_m=_sigma(pose.covariance[4]),
        sigma_yaw_rad=_sigma(pose.covariance[8]),
    )


def _sigma(variance: float) -> float | None:
    """The standard deviation, None where there is none to tell."""
    return math.sqrt(variance) if 0.0 <= variance < math.inf else None


def _lines(tracks: TrackSet) -> tuple[SeenLine, ...]:
    along = [SeenLine("along", line.offset_m, line.sigma_m) for line in tracks.across_y]
    across = [SeenLine("across", line.offset_m, line.sigma_m) for line in tracks.across_x]
    return (*along, *across)


def _vehicle(state: VehicleState, now_ns: int) -> VehicleReport:
    return VehicleReport(
        mode=state.mode,
        armed=state.armed,
        in_control=state.in_control,
        landed=state.landed.value,
        roll_rad=state.attitude.roll_rad,
        pitch_rad=state.attitude.pitch_rad,
        battery_frac=finite(state.battery_frac),
        battery_v=finite(state.battery_v),
        telemetry_age_s=(now_ns - state.attitude.stamp_ns) * 1e-9,
        heartbeat_age_s=(now_ns - state.heartbeat_ns) * 1e-9,
        refusal=words(state.refusal),
        pose_use=state.pose_use.value,
    )
