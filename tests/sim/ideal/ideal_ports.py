"""Fakes behind the daemon's ports, for a flight without sockets, processes or event loop."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping

from flightd.app.absent_parts import NoCounting, NoGround, NoRecorder
from flightd.app.flight import Tasks
from flightd.core.scanning import CodeSet, CountedPlace
from flightd.core.types import (
    Attitude,
    AttitudeSetpoint,
    Command,
    Demand,
    Event,
    Health,
    LineSet,
    VehicleState,
)


class HeldSetpoint:
    """`app.flight.SetpointSink`: the newest setpoint, for the airframe to follow."""

    stale = failed = 0

    def __init__(self) -> None:
        self.newest: AttitudeSetpoint | None = None

    def set(self, setpoint: AttitudeSetpoint | None) -> None:
        self.newest = setpoint

    async def run(self) -> None:
        """Nothing is sent anywhere."""

    def interval_quantiles_ms(self) -> dict[str, float]:
        return {}


class IdealVehicle:
    """`ports.Vehicle` that tells what `state` says and hands demands to `obey`."""

    def __init__(self, state: Callable[[], VehicleState | None], obey: Callable[[Demand], None]) -> None:
        self._state = state
        self._obey = obey
        self.samples: list[Attitude] = []

    async def run(self) -> None:
        """There is no link."""

    def state(self) -> VehicleState | None:
        return self._state()

    def attitudes(self) -> list[Attitude]:
        samples, self.samples = self.samples, []
        return samples

    def demand(self, demand: Demand) -> None:
        self._obey(demand)

    def send(self, setpoint: AttitudeSetpoint) -> bool:
        return True

    def notify(self, event: Event) -> None:
        """Nobody looks."""


class IdealVision:
    """`app.flight.Vision`: line sets that arrive when they are due; its health is `health`'s."""

    fps = 30.0
    latency_ms: Mapping[str, float] = {}
    dropped: Mapping[str, int] = {}

    def __init__(self, health: Callable[[], Health]) -> None:
        self._health = health
        self._coming: deque[tuple[int, LineSet]] = deque()

    def put(self, due_ns: int, lines: LineSet) -> None:
        self._coming.append((due_ns, lines))

    def tasks(self) -> Tasks:
        return {}

    async def arrival(self) -> None:
        """The flight's own loop ticks at a fixed rate."""

    def fresh(self, now_ns: int) -> tuple[LineSet, ...]:
        lines = []
        while self._coming and self._coming[0][0] <= now_ns:
            lines.append(self._coming.popleft()[1])
        return tuple(lines)

    @property
    def replaced(self) -> int:
        return self._health().detectors_replaced

    def latency_p99_s(self, now_ns: int) -> float:
        return self._health().latency_p99_s

    def drain_latencies_ms(self) -> tuple[Mapping[str, float], ...]:
        return ()

    def latency_quantiles_ms(self) -> dict[str, float]:
        return {}

    def arrival_to_wire_ms(self) -> dict[str, float]:
        return {}

    def not_flying(self) -> None:
        """No frame waits for a setpoint."""


class IdealRecorder(NoRecorder):
    """Hands what it is given to `keep`; its health is `health`'s."""

    def __init__(self, health: Callable[[], Health], keep: Callable[[str, int, object], None]) -> None:
        self._health = health
        self._keep = keep

    def record(self, topic: str, stamp_ns: int, message: object) -> None:
        self._keep(topic, stamp_ns, message)

    @property
    def restarts(self) -> int:  # type: ignore[override]
        return self._health().recorder_restarts

    @property
    def error(self) -> str:  # type: ignore[override]
        return self._health().recorder_error


class IdealGround(NoGround):
    """People who order `commands` and have been silent for `quiet_s`."""

    def __init__(self, take: Callable[[], list[Command]], quiet_s: Callable[[], float]) -> None:
        self._take = take
        self._quiet_s = quiet_s

    def take_commands(self) -> list[Command]:
        return self._take()

    def silent_s(self, now_ns: int) -> float:
        return self._quiet_s()


class IdealCount(NoCounting):
    """Codes that are read and locations that were counted before."""

    def __init__(
        self, codes: Callable[[], tuple[CodeSet, ...]], counted: Callable[[], tuple[CountedPlace, ...]]
    ) -> None:
        self._codes = codes
        self._counted = counted

    def take(self) -> tuple[CodeSet, ...]:
        return self._codes()

    def take_counted(self) -> tuple[CountedPlace, ...]:
        return self._counted()


class IdealInterlock:
    """`ports.Interlock` that says what `closed` says."""

    def __init__(self, closed: Callable[[], bool]) -> None:
        self._closed = closed

    @property
    def is_closed(self) -> bool:
        return self._closed()

    async def run(self) -> None:
        """There is no file."""
