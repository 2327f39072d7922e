"""The status report, put together from what the daemon knows at a tick."""

from __future__ import annotations

import math

from flightd.adapters.ground_link.protocol import (
    VERSION,
    LinkReport,
    Position,
    SeenLine,
    StatusReport,
    VehicleReport,
    finite,
)
from flightd.core.tick import TickInput, TickOutput
from flightd.core.tracks import TrackSet
from flightd.core.types import GridPose, Status, VehicleState


def status_report(
    status: Status, tick: TickInput, output: TickOutput, session: str, seq: int, link: LinkReport
) -> StatusReport:
    """`status` with position, lines and vehicle as the tick had them."""
    tracks, vehicle = output.tracks, tick.vehicle
    seen = tracks is not None and bool(tracks.lines_ns)
    return StatusReport(
        version=VERSION,
        session=session,
        seq=seq,
        stamp_ns=status.stamp_ns,
        phase=status.phase,
        reason=status.reason,
        node=status.node,
        goal=status.goal,
        nodes_done=status.nodes_done,
        nodes_planned=status.nodes_planned,
        height_m=finite(status.height_m) if output.pose is not None else None,
        position=_position(output.pose) if output.pose is not None else None,
        lines=_lines(tracks) if tracks is not None else (),
        lines_age_s=(tick.now_ns - tracks.lines_ns) * 1e-9 if tracks is not None and seen else None,
        vehicle=_vehicle(vehicle, tick.now_ns) if vehicle is not None else None,
        frames=status.frames,
        frames_dropped=status.frames_dropped,
        fps=status.fps,
        latency_ms={stage: round(ms, 2) for stage, ms in status.latency_ms.items()},
        link=link,
    )


def _position(pose: GridPose) -> Position:
    return Position(
        x_m=pose.x_m,
        y_m=pose.y_m,
        yaw_rad=pose.yaw_rad,
        speed_mps=math.hypot(pose.vx_mps, pose.vy_mps),
        integrity=pose.integrity,
    )


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
        refusal=state.refusal,
    )
