"""What the daemon would tell its monitors, made by hand."""

from __future__ import annotations

from flightd.core.snapshot import Snapshot
from flightd.core.tick import TickInput, TickOutput
from flightd.core.types import Attitude, Demand, GridPose, LandedState, Phase, VehicleState

MS = 1_000_000
START_NS = 10**12


def vehicle(stamp_ns: int) -> VehicleState:
    attitude = Attitude(stamp_ns, 0.0, 0.0, 0.0)
    return VehicleState(
        attitude, 1.6, stamp_ns, 0.0, "GUIDED_NOGPS", True, True, LandedState.IN_AIR, 0.81, 12.1, stamp_ns
    )


def vitals(
    now_ns: int = START_NS,
    *,
    phase: Phase = Phase.FOLLOW,
    heard_ns: int | None = START_NS,
    fps: float = 30.0,
    reason: str = "arrived",
    late_s: tuple[float, ...] = (0.001,),
    latencies_ms: tuple[dict[str, float], ...] = (),
    dropped: dict[str, int] | None = None,
) -> Snapshot:
    pose = GridPose(now_ns, "A2", 0.0, 0.0, 0.0, 1.5, 0.0, 0.0, 0.0, 1.6, (0.0,) * 9, 0.99)
    return Snapshot(
        TickInput(now_ns, vehicle=None if heard_ns is None else vehicle(heard_ns)),
        TickOutput(None, Demand.FLY, phase, reason, "A3", 1, 12, pose, None),
        nodes_done=1,
        nodes_planned=12,
        frames=300,
        frames_dropped=2,
        fps=fps,
        latency_ms={"total": 71.4},
        tick_late_s=late_s,
        latencies_ms=latencies_ms,
        dropped=dropped or {"camera": 0, "detection": 2},
        restarts={"detector": 0},
        repeated_level=0,
    )
