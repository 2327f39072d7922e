"""The daemon at one tick, as everybody is told of it: recorder, ground stations, monitors, the terminal."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from flightd.core.outlook import NO_OUTLOOK, Outlook
from flightd.core.tick import StepFailure, TickInput, TickOutput
from flightd.core.tracks import NOT_SEEN, SensorEstimate
from flightd.core.types import CommandKind, Phase, Status, VehicleState

_REASON_SHOWN = frozenset({Phase.PREFLIGHT, Phase.ARMING, Phase.SWAP, Phase.HOLD, Phase.RELOCATE})


@dataclass(frozen=True, slots=True)
class Snapshot:
    """What the pilot was given and what it answered at one tick, and how the daemon itself does.

    `nodes_done` of the `nodes_planned` were visited, each counted once.  `frames` were delivered so far,
    `frames_dropped` of them never became lines, `fps` became lines in the last second.  `latency_ms` are the
    newest frame's stages: capture, transport, detection, track, wire (each from its predecessor), and total
    (mid-exposure to setpoint on the wire).  `tick_late_s` is how late each tick came and `latencies_ms` the
    stages of each frame flown by, both since the last that was told.  The others count since the start:
    `dropped` what a full queue or a lost worker cost, `restarts` what died and was brought back, each by the
    part's name; `repeated_level` the setpoints that went out because no tick made one.  `possible` are the
    operator's commands that the mission takes now, `failure` what the step raised, if anything.
    `height_goal_m` is the commanded height above the floor, `view_m` the place on the map from which a shelf
    is to be looked at (None: it does not scan), `outlook` what the mission expects.
    """

    tick: TickInput
    output: TickOutput
    nodes_done: int = 0
    nodes_planned: int = 0
    frames: int = 0
    frames_dropped: int = 0
    fps: float = 0.0
    latency_ms: Mapping[str, float] = field(default_factory=dict)
    tick_late_s: tuple[float, ...] = ()
    latencies_ms: tuple[Mapping[str, float], ...] = ()
    dropped: Mapping[str, int] = field(default_factory=dict)
    restarts: Mapping[str, int] = field(default_factory=dict)
    repeated_level: int = 0
    possible: frozenset[CommandKind] = frozenset()
    failure: StepFailure | None = None
    height_goal_m: float = 0.0
    view_m: tuple[float, float] | None = None
    outlook: Outlook = NO_OUTLOOK

    @property
    def stamp_ns(self) -> int:
        return self.tick.now_ns

    @property
    def phase(self) -> Phase:
        return self.output.phase

    @property
    def reason(self) -> str:
        return self.output.reason

    @property
    def node(self) -> str:
        """The nearest node, empty before it is known."""
        return self.output.pose.node if self.output.pose else ""

    @property
    def goal(self) -> str:
        return self.output.goal

    @property
    def vehicle(self) -> VehicleState | None:
        return self.tick.vehicle

    @property
    def battery_frac(self) -> float:
        """Charge, 0 to 1; NaN before the vehicle told it."""
        return self.tick.vehicle.battery_frac if self.tick.vehicle else math.nan

    @property
    def battery_text(self) -> str:
        """The charge for people: a hyphen where it is not known."""
        return "-" if math.isnan(self.battery_frac) else f"{self.battery_frac:.0%}"

    @property
    def waits(self) -> bool:
        """It stands on the ground or holds, and the reason says what for."""
        return self.phase in _REASON_SHOWN

    @property
    def height_m(self) -> float:
        """Above the floor; 0 before it is known."""
        return self.output.pose.height_m if self.output.pose else 0.0

    @property
    def sensors(self) -> SensorEstimate:
        """What the lines say of the drone's own sensors."""
        return self.output.tracks.sensors if self.output.tracks is not None else NOT_SEEN

    @property
    def ground_silent_s(self) -> float:
        return self.tick.ground_silent_s

    def status(self) -> Status:
        """The snapshot as the flight log keeps it."""
        return Status(
            stamp_ns=self.stamp_ns,
            phase=self.phase,
            reason=self.reason,
            node=self.node,
            goal=self.goal,
            nodes_done=self.nodes_done,
            nodes_planned=self.nodes_planned,
            battery_frac=self.battery_frac,
            height_m=self.height_m,
            frames=self.frames,
            frames_dropped=self.frames_dropped,
            fps=self.fps,
            latency_ms=dict(self.latency_ms),
            height_goal_m=self.height_goal_m,
            sensors=self.sensors,
            view_x_m=self.view_m[0] if self.view_m else None,
            view_y_m=self.view_m[1] if self.view_m else None,
        )
