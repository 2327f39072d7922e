"""Faults that are done to the daemon: to its processes, over its ground link, to its own code."""

from __future__ import annotations

import asyncio
import os
import resource
import signal
import time
from collections.abc import Sequence
from contextlib import suppress

from flightd.adapters.ground_link.client import Address, GroundClient
from flightd.adapters.ground_link.link import ZmqGround
from flightd.adapters.recorder.recorder import McapRecorder
from flightd.app.detection.detector_pool import DetectorPool
from flightd.config.schema import Config
from flightd.core.errors import FlightdError, InputError
from flightd.mission.guidance import Guidance, MissionInputs
from flightd.mission.mission import Mission
from flightd.sim.scenario.fault_schema import (
    AisleOpened,
    CpuTaken,
    DetectorKilled,
    Fault,
    GroundOrder,
    GroundSilent,
    LoopStalled,
    OfCamera,
    ProcessFault,
    StepFails,
)
from flightd.sim.scenario.faults import OF_ARDRONE, place_of
from flightd.site.site import Site

_ATTEND_S = 0.5
_LOOK_S = 0.005
_TURN_S = 0.4
"""One turn in which the processor is taken and given back."""


def check_faults(faults: Sequence[Fault], config: Config, site: Site, *, external: bool) -> None:
    """InputError for a fault that this site or this vehicle's simulation cannot have."""
    for fault in faults:
        place_of(fault, site)
        is_had = config.vehicle.kind != "ardrone" or fault.kind in OF_ARDRONE
        if fault.by_vehicle and (external or not is_had):
            raise InputError(
                f"scenario: fault {fault.kind}: only the simulated MAVLink autopilots have it;"
                " fly --vehicle ardupilot or px4, without --truth-url"
            )
        if fault.by_airframe and external:
            raise InputError(f"scenario: fault {fault.kind}: leave out --truth-url, its airframe is not ours")
        if isinstance(fault, OfCamera) and fault.camera == "front" and not config.front_camera.is_fitted:
            raise InputError(f"scenario: fault {fault.kind}: no front camera; fly a --warehouse with racks")


def needs_ground(faults: Sequence[Fault]) -> bool:
    """Whether a fault comes over the ground link."""
    return any(isinstance(fault, GroundSilent | GroundOrder) for fault in faults)


class LauncherFaults:
    """`tell` takes a fault's number when it begins or ends; `run` does what goes on, until cancelled."""

    def __init__(
        self,
        faults: Sequence[Fault],
        pool: DetectorPool,
        recorder: McapRecorder,
        ground: ZmqGround | None = None,
    ) -> None:
        self._faults = tuple(faults)
        self._pool = pool
        self._recorder = recorder
        self._ground = ground
        self._turns: asyncio.Queue[tuple[Fault, bool]] = asyncio.Queue()
        self._attending = any(isinstance(fault, GroundSilent) for fault in faults)
        self._taken = 0.0
        self.interlock = SimulatedInterlock()
        self.mission: Mission | None = None
        """Of the flight, once that is built."""

    def tell(self, index: int, begins: bool) -> None:
        self._turns.put_nowait((self._faults[index], begins))

    async def run(self) -> None:
        async with asyncio.TaskGroup() as tasks:
            if self._attending:
                tasks.create_task(self._attend(), name="ground station")
            if any(isinstance(fault, CpuTaken) for fault in self._faults):
                tasks.create_task(self._take_cpu(), name="taken cpu")
            while True:
                fault, begins = await self._turns.get()
                await self._turn(fault, begins)

    async def _turn(self, fault: Fault, on: bool) -> None:
        match fault:
            case DetectorKilled() if on:
                _signal(self._pool.pids, signal.SIGKILL)
            case ProcessFault(kind="detector_hung"):
                _signal(self._pool.pids, signal.SIGSTOP if on else signal.SIGCONT)
            case ProcessFault(kind="writer_killed") if on:
                _signal((self._recorder.pid,), signal.SIGKILL)
            case ProcessFault(kind="writer_hung") if on:
                _signal((self._recorder.pid,), signal.SIGSTOP)
            case ProcessFault(kind="disk_full"):
                self._fill_disk(on)
            case LoopStalled() if on:
                _stand_still(fault.stall_s)
            case AisleOpened():
                self.interlock.is_closed = not on
            case StepFails() if self.mission is not None:
                _break(self.mission, on)
            case CpuTaken():
                self._taken = fault.share if on else 0.0
            case GroundSilent():
                self._attending = not on
            case GroundOrder() if on:
                async with GroundClient(self._address()) as client:
                    await client.hello()
                    await client.order(fault.command)

    def _fill_disk(self, full: bool) -> None:
        """Nothing that the log's writer writes grows beyond its present size, as on a full disk."""
        _, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
        soft = self._recorder.path.stat().st_size if full else hard
        with suppress(ProcessLookupError):
            resource.prlimit(self._recorder.pid, resource.RLIMIT_FSIZE, (soft, hard))

    async def _take_cpu(self) -> None:
        """The detectors stand still for their share of each turn, as a processor's quota makes them."""
        while True:
            taken_s = self._taken * _TURN_S
            if taken_s:
                stopped = self._pool.pids
                _signal(stopped, signal.SIGSTOP)
                await asyncio.sleep(taken_s)
                _signal(stopped, signal.SIGCONT)
            await asyncio.sleep(_TURN_S - taken_s)

    async def _attend(self) -> None:
        async with GroundClient(self._address(), "station") as client:
            await client.hello()
            while self._attending:
                with suppress(FlightdError):  # asked again in a moment
                    await client.attend()
                await asyncio.sleep(_ATTEND_S)

    def _address(self) -> Address:
        assert self._ground is not None
        status, command = (int(endpoint.rpartition(":")[2]) for endpoint in self._ground.endpoints)
        return Address("127.0.0.1", status, command)


def _stand_still(stall_s: float) -> None:
    """Let nothing else on the loop have its turn for so long, by the loop's own time."""
    loop = asyncio.get_running_loop()
    until_s = loop.time() + stall_s
    while loop.time() < until_s:
        time.sleep(_LOOK_S)


class SimulatedInterlock:
    """`ports.Interlock` of the simulated hall: closed until a fault opens an aisle."""

    is_closed = True

    async def run(self) -> None:
        await asyncio.get_running_loop().create_future()


class SimulatedFaultError(Exception):
    """An error as any part of the flight software might raise it."""


def _break(mission: Mission, broken: bool) -> None:
    """The mission's step raises from now on; or does its work again."""

    def fail(_: MissionInputs) -> Guidance:
        raise SimulatedFaultError("the scenario wants it")

    if broken:
        mission.__dict__["step"] = fail
    else:
        mission.__dict__.pop("step", None)


def _signal(pids: Sequence[int], what: signal.Signals) -> None:
    for pid in pids:
        with suppress(ProcessLookupError):
            os.kill(pid, what)
