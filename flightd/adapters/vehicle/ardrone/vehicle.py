"""The AR.Drone 2.0 behind the `Vehicle` port."""

from __future__ import annotations

import asyncio
import logging
import math

from flightd.adapters.vehicle.ardrone import at
from flightd.adapters.vehicle.ardrone.configurator import Configurator, kept
from flightd.adapters.vehicle.ardrone.flight import FlightLogic
from flightd.adapters.vehicle.ardrone.link import ArDroneLink
from flightd.adapters.vehicle.ardrone.navdata import DroneState, Major, Navdata
from flightd.adapters.vehicle.ardrone.refusal import KeepsValue, NotConfigured
from flightd.adapters.vehicle.ardrone.settings import ArDroneSettings, DroneCamera
from flightd.adapters.vehicle.ardrone.telemetry import NavdataTelemetry
from flightd.core.refusal import Refusal
from flightd.core.types import Attitude, AttitudeSetpoint, Demand, Event, LandedState, VehicleState
from flightd.ports import Clock
from flightd.runtime.supervisor import insisted

_log = logging.getLogger(__name__)

MIN_GAP_NS = 20_000_000
"""Parrot's own refresh; setpoints that come faster share a datagram."""

_DEAF_NS = 1_000_000_000
_LAST_WORDS = 3
_CAMERA_ATTEMPTS = 3
_CELLS = 3
"""Of its battery."""

_MODES: dict[int, str] = {
    Major.DEFAULT: "default",
    Major.INIT: "init",
    Major.LANDED: "landed",
    Major.FLYING: "flying",
    Major.HOVERING: "hovering",
    Major.TEST: "test",
    Major.TAKE_OFF: "taking off",
    Major.GO_TO_FIX: "braking",
    Major.LANDING: "landing",
    Major.LOOPING: "looping",
}


class ArDroneVehicle:
    """One AR.Drone 2.0: `ports.Vehicle`, and the choice of the camera that its video shows.

    Commands go out at least every `period_s`; a setpoint goes out at once unless the last datagram is
    younger than 20 ms, then with the next.  `armed` means that the rotors turn.  `height_m` is the sonar's
    in the air, the standing height on the ground, and NaN when telemetry is late.  Cancelled in flight,
    `run` orders the drone to land: nobody else holds its controls, and it would land by itself two
    seconds later.
    """

    def __init__(self, settings: ArDroneSettings, clock: Clock) -> None:
        self._settings = settings
        self._clock = clock
        self._telemetry = NavdataTelemetry(round(settings.attitude_latency_s * 1e9))
        self._flight = FlightLogic(settings, self._telemetry)
        self._link = ArDroneLink(settings, clock, self._receive)
        self._configurator = Configurator(self._link, settings)
        self._kept: KeepsValue | None = None
        self._unconfigured = asyncio.Event()
        self._unconfigured.set()
        self._deaf_since_ns: int | None = None
        self._camera = settings.camera
        self._camera_wanted = asyncio.Event()
        self._camera_since_ns: int | None = None

    # Vehicle

    async def run(self) -> None:
        try:
            async with asyncio.TaskGroup() as tasks:
                tasks.create_task(self._beat(), name="ardrone commands")
                tasks.create_task(insisted(self._keep_configured), name="ardrone configuration")
                tasks.create_task(insisted(self._keep_camera), name="ardrone camera")
        finally:
            await self._release()
            self._link.close()

    def state(self) -> VehicleState | None:
        telemetry, now_ns = self._telemetry, self._clock.now_ns()
        demo, attitude = telemetry.demo, telemetry.attitude
        if demo is None or attitude is None:
            return None
        linked = self._flight.linked(now_ns)
        landed = LandedState.IN_AIR if telemetry.airborne else LandedState.ON_GROUND
        height_m = telemetry.height_m if telemetry.airborne else self._settings.standing_height_m
        return VehicleState(
            attitude=attitude,
            height_m=height_m if linked else math.nan,
            height_stamp_ns=telemetry.height_ns,
            climb_mps=telemetry.climb_mps(now_ns),
            mode="emergency" if telemetry.emergency else _MODES.get(demo.major, "unknown"),
            in_control=self._flight.in_control(now_ns),
            armed=telemetry.airborne,
            landed=landed if linked else LandedState.UNKNOWN,
            battery_frac=demo.battery_percent / 100.0,
            battery_v=telemetry.battery_v(now_ns),
            battery_stamp_ns=telemetry.flight_ns,
            battery_cells=_CELLS,
            heartbeat_ns=telemetry.arrival_ns,
            refusal=self._flight.refusal(now_ns),
            unfit=self._unfit(),
            keeps_climb=True,
            hovers_unsteered=True,
            unheard=not linked,
        )

    def _unfit(self) -> Refusal | None:
        """Why a drone that stands would not be flown; None where it would.  An emergency is none: the start
        that follows it ends it."""
        if self._telemetry.airborne:
            return None
        return self._kept if self._flight.configured else NotConfigured()

    def attitudes(self) -> list[Attitude]:
        return self._telemetry.drain()

    def demand(self, demand: Demand) -> None:
        if demand is Demand.HANDS_OFF and self._flight.demand is not demand and self._telemetry.airborne:
            self._link.send(*self._flight.hush(self._clock.now_ns()))
            self._link.restart_numbers()
            self._link.send(at.comwdg())
        self._flight.want(demand)

    def send(self, setpoint: AttitudeSetpoint) -> bool:
        now_ns = self._clock.now_ns()
        if self._flight.demand is not Demand.FLY or not self._flight.in_control(now_ns):
            return False
        self._flight.steer(setpoint, now_ns)
        if now_ns - self._link.sent_ns >= MIN_GAP_NS:
            self._link.send(*self._flight.commands(now_ns))
        return True

    def notify(self, event: Event) -> None:
        """An AR.Drone has no ground station to show anything on."""

    @property
    def dropped(self) -> int:
        """Groups of commands that the network could not take."""
        return self._link.dropped

    @property
    def bad_packets(self) -> int:
        """Packets of telemetry that were damaged or not the drone's."""
        return self._link.bad_packets

    @property
    def stale_packets(self) -> int:
        """Packets of telemetry that a newer one had overtaken."""
        return self._link.stale_packets

    # Camera

    def select_camera(self, camera: DroneCamera) -> None:
        """Have the video show this camera; `camera_since_ns` tells when it does."""
        if camera != self._camera:
            self._camera = camera
            self._camera_since_ns = None
            self._camera_wanted.set()

    @property
    def video_address(self) -> tuple[str, int]:
        """Host and port of the video stream."""
        return self._settings.host, self._settings.video_port

    @property
    def camera(self) -> DroneCamera:
        """The camera asked for."""
        return self._camera

    @property
    def camera_since_ns(self) -> int | None:
        """From when on pictures are surely of `camera`; None while the switch is under way."""
        return self._camera_since_ns

    # The link

    async def _beat(self) -> None:
        """Commands in the drone's rhythm, for ever."""
        period_ns = round(self._settings.period_s * 1e9)
        while True:
            now_ns = self._clock.now_ns()
            await self._link.tend()
            self._mind_numbers(now_ns)
            if now_ns - self._link.sent_ns >= period_ns:
                self._link.send(*self._flight.commands(now_ns))
            due_ns = max(self._link.sent_ns, now_ns - period_ns // 2) + period_ns
            await asyncio.sleep(max(1_000_000, due_ns - self._clock.now_ns()) / 1e9)

    def _receive(self, packet: Navdata, now_ns: int) -> None:
        self._telemetry.observe(packet, now_ns)
        self._flight.follow(now_ns)
        if packet.state & DroneState.NAVDATA_BOOTSTRAP and self._flight.configured:
            self._flight.forget_drone()
            self._camera_since_ns = None  # it may show either camera now
            self._unconfigured.set()

    def _mind_numbers(self, now_ns: int) -> None:
        """A drone that hears us and yet misses commands holds a larger number than ours: a second client
        was here.  Starting at 1 again makes it obey."""
        telemetry = self._telemetry
        missing = telemetry.state & DroneState.COM_WATCHDOG and now_ns - telemetry.arrival_ns < _DEAF_NS
        if not missing or self._flight.silent:
            self._deaf_since_ns = None
        elif self._deaf_since_ns is None:
            self._deaf_since_ns = now_ns
        elif now_ns - self._deaf_since_ns >= _DEAF_NS:
            _log.warning("the drone passes over our commands: counting from 1 again")
            self._link.restart_numbers()
            self._deaf_since_ns = now_ns

    async def _keep_configured(self) -> None:
        """Configure the drone whenever it has come up anew."""
        while True:
            await self._unconfigured.wait()
            await self._link.packet()
            try:
                values = await self._configurator.configure()
            except TimeoutError:
                _log.warning("navdata stopped while the drone was being configured: beginning again")
                continue
            self._flight.limits.take(values)
            self._kept = kept(self._settings, values)
            self._flight.configured = True
            self._unconfigured.clear()
            self._camera_wanted.set()

    async def _keep_camera(self) -> None:
        """Switch the video when another camera is wanted."""
        while True:
            await self._camera_wanted.wait()
            self._camera_wanted.clear()
            if not self._flight.configured:
                continue
            wanted = self._camera
            try:
                for _ in range(_CAMERA_ATTEMPTS):  # some firmware never acknowledges: then it has to do
                    if await self._configurator.write("video:video_channel", str(int(wanted))):
                        break
            except TimeoutError:
                self._camera_wanted.set()
                await self._link.packet()
                continue
            if wanted == self._camera:
                self._camera_since_ns = self._clock.now_ns() + round(self._settings.camera_settle_s * 1e9)

    async def _release(self) -> None:
        """Hand the drone back: land it if it flies at our demand."""
        if not self._telemetry.airborne or self._flight.demand is Demand.HANDS_OFF:
            return
        self._flight.want(Demand.LAND)
        for _ in range(_LAST_WORDS):
            self._link.send(*self._flight.commands(self._clock.now_ns()))
            await asyncio.sleep(self._settings.period_s)
