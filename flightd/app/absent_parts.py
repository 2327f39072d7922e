"""Parts that a flight can do without: they do nothing, so that nobody has to ask whether they are there."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping

from flightd.app.flight import Tasks
from flightd.core.planned_flight import Planner
from flightd.core.preview import CameraName, Preview
from flightd.core.refusal import Refusal
from flightd.core.scanning import CodeSet, CountedPlace
from flightd.core.shared_pose import SharedPose
from flightd.core.snapshot import Snapshot
from flightd.core.tick import TickOutput
from flightd.core.types import Command, Event


async def _idle() -> None:
    """Until cancelled."""
    await asyncio.get_running_loop().create_future()


class NoRecorder:
    """`ports.Recorder` that keeps nothing."""

    dropped = 0
    restarts = 0
    error = ""

    async def run(self) -> None:
        await _idle()

    def record(self, topic: str, stamp_ns: int, message: object) -> None:
        pass

    def image(self, topic: str, stamp_ns: int, seq: int, jpeg: bytes) -> None:
        pass


class NoGround:
    """`ports.Ground` without anybody on it."""

    async def run(self) -> None:
        await _idle()

    def tell(self, snapshot: Snapshot) -> None:
        pass

    def event(self, event: Event) -> None:
        pass

    def take_commands(self) -> list[Command]:
        return []

    def plan_by(self, planner: Planner) -> None:
        """Nobody asks."""

    def silent_s(self, now_ns: int) -> float:  # noqa: ARG002 - the port names it
        return 0.0

    def picture_due(
        self,
        stamp_ns: int,  # noqa: ARG002 - the port names it
        camera: CameraName = CameraName.DOWN,  # noqa: ARG002
    ) -> bool:
        return False

    def picture(self, preview: Preview) -> None:
        pass


class NoLamp:
    """`ports.Lamp` that is not fitted."""

    def shine(self, on: bool) -> None:
        pass

    async def run(self) -> None:
        await _idle()


class NoInterlock:
    """`ports.Interlock` where no site demands one: people may be anywhere."""

    is_closed = True

    async def run(self) -> None:
        await _idle()


class NoFitness:
    """`app.flight.Fitness` of a computer that nobody looks at: a simulation's."""

    unfit: Refusal | None = None

    async def run(self, waits: Callable[[], bool]) -> None:  # noqa: ARG002 - the protocol names it
        await _idle()


class NoCamera:
    """`ports.Camera` that is not fitted."""

    frames = 0
    refused = 0

    def expose(self, part: float, gain: float) -> None:
        pass

    async def run(self) -> None:
        await _idle()


class NoCounting:
    """A flight that counts no shelves."""

    def tasks(self, on_trouble: Callable[[str], None]) -> Tasks:  # noqa: ARG002 - as `app.flight.Count`
        return {}

    def take(self) -> tuple[CodeSet, ...]:
        return ()

    def take_counted(self) -> tuple[CountedPlace, ...]:
        return ()

    def keep(self, output: TickOutput) -> None:
        pass

    @property
    def dropped(self) -> Mapping[str, int]:
        return {}

    @property
    def replaced(self) -> int:
        return 0


class NothingKept:
    """`Kept` of what nobody asks for once the daemon has ended."""

    async def run(self) -> None:
        await _idle()

    def put(self, value: object) -> None:
        pass


def keep_pose(pose: SharedPose | None) -> None:
    """A vehicle whose estimator cannot use the pose is not given it."""


NO_RECORDER = NoRecorder()
NO_GROUND = NoGround()
NO_INTERLOCK = NoInterlock()
NO_LAMP = NoLamp()
NO_FITNESS = NoFitness()
NO_CAMERA = NoCamera()
NO_COUNTING = NoCounting()
NOTHING_KEPT = NothingKept()
