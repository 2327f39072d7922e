"""A flight, put together: every part that `app.build` composed and `app.daemon` runs."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import Protocol, TypeAlias, TypeVar

from flightd.adapters.store.progress import LeftOver
from flightd.app.frame_tap import NO_FRAMES, FrameTap
from flightd.app.publishers import TelemetryPublishers
from flightd.core.errors import FlightdError
from flightd.core.learnt import LearntSensors
from flightd.core.refusal import Refusal
from flightd.core.scanning import CodeSet, CountedPlace
from flightd.core.shared_pose import SharedPose
from flightd.core.tick import TickOutput
from flightd.core.types import AttitudeSetpoint, LineSet
from flightd.pilot import Pilot
from flightd.ports import Camera, Clock, Ground, Interlock, Lamp, Recorder, Vehicle

T_contra = TypeVar("T_contra", contravariant=True)

Tasks: TypeAlias = Mapping[str, Callable[[], Awaitable[None]]]
"""What is run beside the tick until it is cancelled, and anew where it fails, by name."""


class Vision(Protocol):
    """Lines of the down camera's frames, and how fast they come."""

    @property
    def dropped(self) -> Mapping[str, int]:
        """Frames that never became lines, by where they were lost."""
        ...

    @property
    def replaced(self) -> int:
        """Detector processes that died or hung and were replaced."""
        ...

    @property
    def fps(self) -> float:
        """Frames flown by in the last second."""
        ...

    @property
    def latency_ms(self) -> Mapping[str, float]:
        """The stages of the newest frame flown by."""
        ...

    def tasks(self) -> Tasks: ...

    async def arrival(self) -> None:
        """Until there are lines that no tick has taken."""
        ...

    def fresh(self, now_ns: int) -> tuple[LineSet, ...]:
        """Lines since the last tick, in the order of their frames."""
        ...

    def latency_p99_s(self, now_ns: int) -> float:
        """From exposure to the wire over the last second; 0 without a frame flown by."""
        ...

    def drain_latencies_ms(self) -> tuple[Mapping[str, float], ...]:
        """The stages of each frame flown by since the last call."""
        ...

    def latency_quantiles_ms(self) -> dict[str, float]:
        """p50 and p99 of the whole way, over the flight."""
        ...

    def arrival_to_wire_ms(self) -> dict[str, float]:
        """The same from the frames' arrival on, without the camera's own delay."""
        ...

    def not_flying(self) -> None:
        """No setpoint goes out: frames on their way to one count for nothing."""
        ...


class SetpointSink(Protocol):
    """What sends setpoints at their own rate."""

    @property
    def stale(self) -> int:
        """Setpoints that went out level because no tick made one."""
        ...

    @property
    def failed(self) -> int:
        """Setpoints at which the adapter failed: they are lost."""
        ...

    def set(self, setpoint: AttitudeSetpoint | None) -> None: ...

    async def run(self) -> None: ...

    def interval_quantiles_ms(self) -> dict[str, float]:
        """Between setpoints on the wire: p50, p99 and the longest."""
        ...


class Count(Protocol):
    """The count of the shelves: codes on the way in, findings on the way out."""

    def tasks(self, on_trouble: Callable[[str], None]) -> Tasks: ...

    def take(self) -> tuple[CodeSet, ...]:
        """What was read since the last tick."""
        ...

    def take_counted(self) -> tuple[CountedPlace, ...]:
        """The locations that an earlier flight of this count has booked, told once."""
        ...

    def keep(self, output: TickOutput) -> None:
        """Hand a tick's findings to the inventory."""
        ...

    @property
    def dropped(self) -> Mapping[str, int]:
        """What was lost on the way, by where."""
        ...

    @property
    def replaced(self) -> int:
        """Readers that died or hung and were replaced."""
        ...


class Fitness(Protocol):
    """Whether this computer is fit for a flight."""

    @property
    def unfit(self) -> Refusal | None:
        """What was found against one, as it was looked at last."""
        ...

    async def run(self, waits: Callable[[], bool]) -> None:
        """Keep that up to date while the drone `waits` on the ground, until cancelled."""
        ...


class Kept(Protocol[T_contra]):
    """Keeps what is told last beyond the end of the daemon."""

    async def run(self) -> None: ...

    def put(self, value: T_contra) -> None: ...


@dataclass(frozen=True, slots=True)
class Flight:
    """Everything composed; nothing runs yet.

    `share_pose` tells the vehicle's own estimator of the motion, where it takes it.  `startup_fault` is what
    the daemon should not fly with: on the ground it ends with that; a vehicle that it finds flying is looked
    after all the same.  `down_frames` are the down camera's on their way to `vision`."""

    clock: Clock
    pilot: Pilot
    vehicle: Vehicle
    setpoints: SetpointSink
    camera: Camera
    front_camera: Camera
    lamp: Lamp
    vision: Vision
    counting: Count
    recorder: Recorder
    ground: Ground
    progress: Kept[LeftOver]
    learnt: Kept[LearntSensors]
    publishers: TelemetryPublishers
    share_pose: Callable[[SharedPose | None], None]
    interlock: Interlock
    fitness: Fitness
    startup_fault: FlightdError | None = None
    down_frames: FrameTap = NO_FRAMES
