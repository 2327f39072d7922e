"""What the daemon needs of the world; each port has real and simulated peers behind it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol, runtime_checkable

from flightd.core.exposure import ExposureState
from flightd.core.inventory import LocationRecord, Observation, PlannedLocation
from flightd.core.planned_flight import Planner
from flightd.core.preview import CameraName, Preview
from flightd.core.scanning import CountedPlace
from flightd.core.shared_pose import SharedPose
from flightd.core.snapshot import Snapshot
from flightd.core.types import (
    Attitude,
    AttitudeSetpoint,
    Command,
    Demand,
    Event,
    VehicleState,
)


class Clock(Protocol):
    """Monotonic time of the running event loop (real, scaled or virtual)."""

    def now_ns(self) -> int: ...


class Vehicle(Protocol):
    """One flying machine on one link.

    `run` owns the link: it connects, keeps it, reconnects for ever and, cancelled, hands the vehicle
    back.  Everything else is synchronous and never blocks: `state` is the newest telemetry (None until
    heartbeat and attitude were heard), `attitudes` drains the attitude samples since the last call,
    oldest first, `demand` states what the mission wants now (level, not edge: the adapter repeats
    what the vehicle refused and passes the reason on in `VehicleState.refusal`), `send` puts one
    setpoint on the wire and says whether it went out (never while the vehicle is not ours).
    """

    async def run(self) -> None: ...

    def state(self) -> VehicleState | None: ...

    def attitudes(self) -> list[Attitude]: ...

    def demand(self, demand: Demand) -> None: ...

    def send(self, setpoint: AttitudeSetpoint) -> bool: ...

    def notify(self, event: Event) -> None:
        """Show an event to the pilot's ground station (best effort)."""
        ...


@runtime_checkable
class PoseTaker(Protocol):
    """A vehicle whose own estimator can be told of our motion."""

    def share_pose(self, pose: SharedPose | None, pad_m: tuple[float, float] | None = None) -> None:
        """At each tick: what a new frame tells of the motion, None where there is none or it tells nothing;
        and the place of the charge pad on the map (metres) if it shall land by it.  Never blocks."""
        ...


@runtime_checkable
class CountsDrops(Protocol):
    """A vehicle that counts what its link could not take."""

    @property
    def dropped(self) -> int: ...


class Interlock(Protocol):
    """Whether the aisles are closed to people; `run` keeps it up to date until cancelled."""

    @property
    def is_closed(self) -> bool: ...

    async def run(self) -> None: ...


class Lamp(Protocol):
    """Lights the shelf before the front camera.  `shine` says at each tick whether it is wanted, and never
    blocks: where that was not said for half a second it goes out.  `run` switches it until cancelled."""

    def shine(self, on: bool) -> None: ...

    async def run(self) -> None: ...


class Camera(Protocol):
    """The down camera or the front camera.  `run` delivers tickets of pictures in shared memory until
    cancelled; it raises TransientError when the source failed and another `run` may succeed."""

    @property
    def frames(self) -> int:
        """Pictures delivered so far."""
        ...

    @property
    def refused(self) -> int:
        """Pictures that came and were not delivered: out of order, old, or of no known time."""
        ...

    def expose(self, part: float, gain: float) -> None:
        """From now on, take pictures of these parts of the usual exposure and gain (1.0: the usual one
        again).  Never blocks.  Each ticket tells what its picture was taken with: a camera that cannot go by
        this leaves it at 1.0."""
        ...

    async def run(self) -> None: ...


@runtime_checkable
class TellsExposure(Protocol):
    """A camera that is read back: how it exposes."""

    @property
    def exposure_state(self) -> ExposureState | None:
        """As it was read back last; None while nothing was."""
        ...


class Recorder(Protocol):
    """The black box: takes what is worth keeping, never blocks, counts what it had to drop.

    `message` is a dataclass of plain fields or a dict of JSON values; topics and their types are in
    `core.topics`.  Stamps are the flight clock's.  `run` hands over what waits; it raises
    TransientError after a failure that another `run` may mend.
    """

    @property
    def dropped(self) -> int: ...

    @property
    def restarts(self) -> int:
        """How often its own process died and was brought back."""
        ...

    async def run(self) -> None: ...

    @property
    def error(self) -> str:
        """Why the disk refuses, "" while it does not."""
        ...

    def record(self, topic: str, stamp_ns: int, message: object) -> None: ...

    def image(self, topic: str, stamp_ns: int, seq: int, jpeg: bytes) -> None: ...


class Ground(Protocol):
    """People on the ground: they are told what happens and give orders.  Nothing but `run` ever waits.

    `tell` comes ten times a second and at each change of phase, `event` with each event.  `take_commands`
    drains the orders since the last call, oldest first; `silent_s` is the time since any client that attends
    the flight was heard, 0 when none attends.  `plan_by` gives what answers what a flight would be.
    `picture_due` says whether a camera's picture exposed at that time is asked for (True at a capped rate
    only), `picture` then hands it over.  `run` serves until cancelled; TransientError when another `run` may
    succeed.
    """

    async def run(self) -> None: ...

    def tell(self, snapshot: Snapshot) -> None: ...

    def event(self, event: Event) -> None: ...

    def take_commands(self) -> list[Command]: ...

    def silent_s(self, now_ns: int) -> float: ...

    def plan_by(self, planner: Planner) -> None: ...

    def picture_due(self, stamp_ns: int, camera: CameraName = CameraName.DOWN) -> bool: ...

    def picture(self, preview: Preview) -> None: ...


class Monitor(Protocol):
    """Who watches the daemon: a service manager, metrics, a log.  Called by the control tick itself: nothing
    here waits."""

    def tell(self, snapshot: Snapshot) -> None:
        """Ten times a second and at each change of phase."""
        ...

    def event(self, event: Event) -> None:
        """At once when it happens."""
        ...

    def over(self) -> None:
        """Once, when no tick follows any more: the flight is over, and its parts are closed now."""
        ...


class Store(Protocol):
    """The inventory, kept through a power cut.

    Every call blocks for the disk (call it from a worker, any thread) and is whole or not at all: what
    `plan` and `commit` have returned from is on the disk.  All of them may be repeated: the same location
    or observation again changes nothing.  They raise UnavailableError when the disk refuses.
    """

    def plan(self, locations: Iterable[PlannedLocation], site: str = "") -> None:
        """Make locations known, of the site of that name; new ones are not visited yet."""
        ...

    def keep_evidence(self, jpeg: bytes) -> str:
        """Keep a picture (JPEG, at most 50 KB) and return the name that an observation refers to."""
        ...

    def commit(self, observation: Observation, confirmed: bool = True) -> None:
        """Record one look at one location; the newest confirmed look is the location's state."""
        ...

    def settle(self, run: str, locations: Iterable[str], confirmed: bool) -> None:
        """Confirm or withdraw what is pending of a run (committed unconfirmed) at these locations."""
        ...

    def contradict(self, run: str, locations: Iterable[str]) -> None:
        """Withdraw every look of a run at these locations, confirmed ones, too."""
        ...

    def withdraw_pending(self, run: str) -> None:
        """Withdraw all that is pending of a run: the flights that saw it are over."""
        ...

    def counted(self, run: str) -> tuple[CountedPlace, ...]:
        """The locations with a confirmed look of a run, with what the newest of these read."""
        ...

    def locations(self) -> list[LocationRecord]:
        """Every location by its code, as it stands."""
        ...
