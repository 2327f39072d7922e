"""A flight by the clock on a real ground link: the daemon's own tick and mission fly the ideal world, people
on the link watch and command it.  It draws what the down camera sees, and needs a twentieth of what the
simulator in real time needs."""

from __future__ import annotations

import asyncio
import queue
import threading
import time
import traceback
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import Any, Self

import cv2

from flightd.adapters.ground_link.link import ZmqGround
from flightd.app.absent_parts import NoGround
from flightd.app.flight import Flight
from flightd.app.publishers import TelemetryPublishers
from flightd.config.schema import Config
from flightd.core.preview import CameraName, Preview, found_lines
from flightd.core.scanning import Finding
from flightd.core.snapshot import Snapshot
from flightd.core.types import Command, Event, LineSet, Phase
from flightd.sim.floor.renderer import Renderer
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.sensors.optics import SimCamera
from flightd.site.site import Site
from tests.rigs.event_loops import real
from tests.rigs.ground_link import local
from tests.sim.ideal.ideal_flight import Faults, IdealFlight
from tests.sim.ideal.ideal_front import IdealFront
from tests.sim.ideal.ideal_ports import HeldSetpoint, IdealVehicle, IdealVision

_LOOK_S = 0.02
_TELL_S = 0.1
_FLIGHT_LIMIT_S = 3600.0


class _Ended(Exception):  # noqa: N818 - no error: the way out of a flight that goes on
    """The test is over."""


class _Mailbox(NoGround):
    """`ports.Ground` between the thread that flies and the link's loop: nothing of either is touched by the
    other."""

    def __init__(self) -> None:
        self.told: queue.SimpleQueue[Snapshot | Event] = queue.SimpleQueue()
        self.newest: Snapshot | None = None
        self.orders: queue.SimpleQueue[Command] = queue.SimpleQueue()
        self.quiet_s = 0.0

    def tell(self, snapshot: Snapshot) -> None:
        self.newest = snapshot
        self.told.put(snapshot)

    def event(self, event: Event) -> None:
        self.told.put(event)

    def take_commands(self) -> list[Command]:
        taken = []
        while not self.orders.empty():
            taken.append(self.orders.get_nowait())
        return taken

    def silent_s(self, now_ns: int) -> float:
        return self.quiet_s


class _PacedFlight(IdealFlight):
    """An ideal flight with people on the ground, `speed` times as fast as the clock at most."""

    def __init__(
        self, site: Site, config: Config, mailbox: _Mailbox, speed: float, front: IdealFront | None
    ) -> None:
        super().__init__(site, config, front=front)
        self._mailbox = mailbox
        self._pace = (time.monotonic(), self.now_ns(), speed)
        self.over = threading.Event()
        self.seen: tuple[LineSet, Kinematics] | None = None
        self.phase = Phase.PREFLIGHT
        self.on_tick = self._keep_pace
        self.found: set[str] = set()
        self.on_record = self._note_count

    def pace(self, speed: float) -> None:
        """From now on so many times as fast as the clock."""
        self._pace = (time.monotonic(), self.now_ns(), speed)

    def end(self) -> None:
        """Leave the flight at its next tick."""
        self.over.set()

    def _composed(self, vehicle: IdealVehicle, vision: IdealVision, setpoints: HeldSetpoint) -> Flight:
        alone, box = super()._composed(vehicle, vision, setpoints), self._mailbox
        publishers = TelemetryPublishers(alone.clock, vehicle, alone.recorder, box)
        return replace(alone, ground=box, publishers=publishers)

    def _see(self, seq: int) -> LineSet:
        lines = super()._see(seq)
        self.seen = lines, self.airframe.kinematics(self.now_ns())
        return lines

    def _note_count(self, _topic: str, _stamp_ns: int, message: object) -> None:
        if isinstance(message, Finding):
            self.found.add(message.location)

    def _keep_pace(self, phase: Phase, now_ns: int) -> None:
        self.phase = phase
        began_s, began_ns, speed = self._pace  # once: another thread sets it
        ahead_s = (now_ns - began_ns) * 1e-9 / speed - (time.monotonic() - began_s)
        if self.over.wait(max(ahead_s, 0.0)):
            raise _Ended


class LiveFlight:
    """A context manager: entered, it waits for a start on loopback ports of its own."""

    def __init__(
        self,
        site: Site,
        config: Config,
        speed: float = 2.0,
        front: IdealFront | None = None,
        **ground: Any,
    ) -> None:
        self._mailbox = _Mailbox()
        self._flight = _PacedFlight(site, config, self._mailbox, speed, front)
        self._link = ZmqGround(local(picture_fps=5.0, **ground), site, self._flight)
        self._link.plan_by(self._flight.pilot.mission)
        camera = SimCamera(lens=config.camera.lens(), mount=config.camera.mount())
        self._renderer = Renderer(site, camera)
        self._lens = config.camera.lens()
        self._ports: Future[tuple[int, int]] = Future()
        self._ending = threading.Event()
        self._failed: list[str] = []
        self._threads = [
            threading.Thread(target=target, name=name, daemon=True)
            for name, target in (("link", self._serve), ("flight", self._fly))
        ]

    def __enter__(self) -> Self:
        self._threads[0].start()
        self._ports.result(10)
        self._threads[1].start()
        return self

    def __exit__(self, *_: object) -> None:
        self._flight.end()
        self._ending.set()
        for thread in self._threads:
            thread.join(20)
            assert not thread.is_alive(), f"the {thread.name} does not end"
        assert not self._failed, "\n".join(self._failed)

    @property
    def ports(self) -> tuple[int, int]:
        """Status and command port."""
        return self._ports.result(10)

    @property
    def phase(self) -> Phase:
        """What the mission does now."""
        return self._flight.phase

    @property
    def counted(self) -> frozenset[str]:
        """The locations that it has counted by now."""
        return frozenset(self._flight.found)

    @property
    def x_m(self) -> float:
        """Where it really is along the aisles."""
        return self._flight.airframe.x_m

    @property
    def at_m(self) -> tuple[float, float, float]:
        """Where it really is: along the aisles, to their right, above the floor."""
        frame = self._flight.airframe
        return frame.x_m, frame.y_m, frame.height_m

    @property
    def quiet_s(self) -> float:
        """How long whoever attends has been silent."""
        return self._mailbox.quiet_s

    @property
    def faults(self) -> Faults:
        """What is wrong with the drone; a test changes it in flight."""
        return self._flight.faults

    def pace(self, speed: float) -> None:
        """Fly so many times as fast as the clock from now on.  What is seen is old by the flight's own clock:
        a fast flight refuses an order that a slow machine brings late."""
        self._flight.pace(speed)

    def wait_s(self, seconds: float) -> None:
        """Let it fly on."""
        self._ending.wait(seconds)

    def fall_silent(self) -> None:
        """Fly on, and tell nobody."""
        self._flight.end()

    def _fly(self) -> None:
        with suppress(_Ended), self._told():
            self._flight.fly(_FLIGHT_LIMIT_S)
            while self._mailbox.newest is not None and not self._flight.over.wait(_TELL_S):
                self._mailbox.tell(self._mailbox.newest)  # a daemon on the floor tells on how it ended

    def _serve(self) -> None:
        with self._told():
            real(self._on_link())

    @contextmanager
    def _told(self) -> Iterator[None]:
        """What ends one of the threads fails whoever leaves the flight."""
        try:
            yield
        except _Ended:
            raise
        except Exception:
            self._failed.append(traceback.format_exc())
            raise

    async def _on_link(self) -> None:
        with self._link as link:
            status, command = (int(endpoint.rpartition(":")[2]) for endpoint in link.endpoints)
            async with asyncio.TaskGroup() as tasks:
                running = tasks.create_task(link.run())
                self._ports.set_result((status, command))
                while not self._ending.is_set():
                    self._exchange(link)
                    await asyncio.sleep(_LOOK_S)
                running.cancel()

    def _exchange(self, link: ZmqGround) -> None:
        box = self._mailbox
        while not box.told.empty():
            said = box.told.get_nowait()
            if isinstance(said, Event):
                link.event(said)
            else:
                link.tell(said)
        for command in link.take_commands():
            box.orders.put(command)
        box.quiet_s = link.silent_s(self._flight.now_ns())
        if self._flight.seen is not None and link.picture_due(self._flight.now_ns()):
            lines, kinematics = self._flight.seen
            picture = self._renderer.render(kinematics, lines.frame_seq)
            jpeg = cv2.imencode(".jpg", picture)[1].tobytes()
            found = found_lines(lines, self._lens)
            link.picture(Preview(CameraName.DOWN, lines.frame_seq, lines.stamp_ns, jpeg, found))
