"""What the daemon would tell its monitors, made by hand."""

from __future__ import annotations

from flightd.core.types import Attitude, LandedState, Phase, Status, VehicleState
from flightd.ports import Vitals

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
) -> Vitals:
    status = Status(now_ns, phase, reason, "A2", "A3", 1, 12, 0.81, 1.6, 300, 2, fps, {"total": 71.4})
    return Vitals(
        status=status,
        vehicle=None if heard_ns is None else vehicle(heard_ns),
        ground_silent_s=0.0,
        tick_late_s=late_s,
        latencies_ms=latencies_ms,
        dropped=dropped or {"camera": 0, "detection": 2},
        restarts={"detector": 0},
        repeated_level=0,
    )
