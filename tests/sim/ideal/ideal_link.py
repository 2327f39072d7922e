"""The way between autopilot and daemon: real messages, stamped by the autopilot's clock, that come late."""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.services.clock_offset import ASK_FAST_S, ASK_S, ClockSync
from flightd.adapters.vehicle.mavlink.telemetry import MavlinkTelemetry
from flightd.adapters.vehicle.mavlink.vehicle import RATES_HZ
from flightd.core.types import Attitude, AttitudeSetpoint, VehicleState
from flightd.sim.autopilot.radio import RadioParams
from flightd.sim.autopilot.telemetry import LANDED_AIR, LANDED_GROUND, Instruments
from flightd.sim.leap import LeapInFlight
from flightd.sim.plant.airframe import Airframe
from flightd.sim.sensors.instruments import Sensors
from flightd.sim.unknowns import Unknowns

ItemT = TypeVar("ItemT")

_BOOT_NS = 20_000_000_000
"""The autopilot was switched on so long before the flight."""


class Line(Generic[ItemT]):
    """Carries items late, in their order: `flightd.sim.autopilot.radio.Radio` in virtual time."""

    def __init__(self, params: RadioParams, seed: str) -> None:
        self._params = params
        self._rng = random.Random(seed)
        self._under_way: deque[tuple[int, ItemT]] = deque()

    def put(self, now_ns: int, item: ItemT) -> None:
        jitter_s = self._params.jitter_s
        late_s = self._params.delay_s + (self._rng.expovariate(1.0 / jitter_s) if jitter_s else 0.0)
        due_ns = now_ns + round(late_s * 1e9)
        if self._under_way:
            due_ns = max(due_ns, self._under_way[-1][0])
        self._under_way.append((due_ns, item))

    def arrived(self, now_ns: int) -> list[ItemT]:
        items = []
        while self._under_way and self._under_way[0][0] <= now_ns:
            items.append(self._under_way.popleft()[1])
        return items


class IdealLink:
    """Setpoints up and telemetry down: in each step of the world `command` before it moves, `tell` after."""

    def __init__(
        self, unknowns: Unknowns, airframe: Airframe, sensors: Sensors, seed: int, now_ns: int
    ) -> None:
        down, up = unknowns.radio(RadioParams())
        self._down: Line[Any] = Line(down, f"down {seed}")
        self._up: Line[Any] = Line(up, f"up {seed}")
        self._boot_ns, self._ppm = now_ns - _BOOT_NS, unknowns.clock_ppm
        self._leap = LeapInFlight(unknowns.clock_leap)
        self._airframe = airframe
        self._instruments = Instruments(airframe, sensors)
        self._due_ns = dict.fromkeys(RATES_HZ, now_ns)
        self.sync = ClockSync()
        self._telemetry = MavlinkTelemetry(self.sync)
        self._ask_ns = now_ns
        self._sent: AttitudeSetpoint | None = None
        self.obeyed: AttitudeSetpoint | None = None
        """The setpoint that the autopilot has; None before the first."""

    def command(self, now_ns: int, setpoint: AttitudeSetpoint | None) -> None:
        """Carry on what goes up; `setpoint` is the newest that the daemon has made."""
        self._talk(now_ns, setpoint)
        for message in self._up.arrived(now_ns):
            if isinstance(message, AttitudeSetpoint):
                self.obeyed = message
            else:
                self._down.put(now_ns, ("answer", message, self._theirs_ns(now_ns)))

    def tell(self, now_ns: int, *, armed: bool) -> None:
        """Carry on what comes down; the airframe and its sensors are where they are now."""
        self._tell(now_ns, armed=armed)
        for kind, message, stamp_ns in self._down.arrived(now_ns):
            if kind == "answer":
                self.sync.answered(message, stamp_ns, now_ns)
            elif kind == "beat":
                self._telemetry.heartbeat_ns, self._telemetry.armed = now_ns, message
            else:
                self._telemetry.take(message, now_ns)

    def attitudes(self) -> list[Attitude]:
        return self._telemetry.attitudes()

    def state(self, now_ns: int, *, in_control: Callable[[bool], bool]) -> VehicleState | None:
        """What the daemon knows; `in_control` says of a vehicle that is armed whether it is ours."""
        armed = self._telemetry.armed
        return self._telemetry.state(now_ns, "GUIDED_NOGPS", in_control=in_control(armed), refusal=None)

    def _theirs_ns(self, now_ns: int) -> int:
        since_ns = now_ns - self._boot_ns
        leapt_ns = self._leap.ns(now_ns, self._airframe.height_m)
        return since_ns + round(since_ns * self._ppm * 1e-6) + leapt_ns

    def _talk(self, now_ns: int, setpoint: AttitudeSetpoint | None) -> None:
        if setpoint is not None and setpoint is not self._sent:
            self._up.put(now_ns, setpoint)
        self._sent = setpoint
        if now_ns >= self._ask_ns:
            self._ask_ns = now_ns + round((ASK_S if self.sync.is_settled else ASK_FAST_S) * 1e9)
            self._up.put(now_ns, self.sync.ask(now_ns))

    def _tell(self, now_ns: int, *, armed: bool) -> None:
        instruments = self._instruments
        instruments.boot_ms = self._theirs_ns(now_ns) // 1_000_000
        instruments.landed_state = LANDED_GROUND if self._airframe.on_floor else LANDED_AIR
        for message_id, rate_hz in RATES_HZ.items():
            if now_ns < self._due_ns[message_id]:
                continue
            self._due_ns[message_id] += round(1e9 / rate_hz)
            if message_id == dialect.MAVLINK_MSG_ID_HEARTBEAT:
                self._down.put(now_ns, ("beat", armed, 0))
            else:
                for message in instruments.messages(message_id):
                    self._down.put(now_ns, ("told", message, 0))
