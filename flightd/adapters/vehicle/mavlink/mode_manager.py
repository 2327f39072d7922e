"""Works towards what the mission demands: modes, arming, landing, each asked for until it is so."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
from collections import deque
from collections.abc import Callable
from typing import Protocol

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.authority import Authority
from flightd.adapters.vehicle.mavlink.refusal import (
    CommandRefused,
    ExplainedRefusal,
    OffFloor,
    ParameterUnread,
    TakenOver,
    ThrustMismatch,
)
from flightd.adapters.vehicle.mavlink.services.commands import Answer
from flightd.core.refusal import Refusal
from flightd.core.types import Attitude, Demand, LandedState
from flightd.ports import Clock
from flightd.runtime.within import Within

_LOG = logging.getLogger(__name__)

_SILENT_NS = 3_000_000_000
_TELLING_NS = 500_000_000
"""An attitude this young shows that the line is alive, whatever has become of the heartbeats."""
_FORSAKEN_NS = 1_000_000_000
"""In the mode in which it obeys us, with our hands off, for so long, nobody flies it: a pilot who passes
through that mode does not stay."""
_SEEN_NS = 300_000_000
"""A mode told longer ago may be another by now: less than what the failsafe for our heartbeats waits for."""
_STEP_S = 0.05
_ARM_PAUSE_S = 1.0
_MODE_PAUSE_S = 0.5
_REASON_NS = 2_000_000_000
_FLOOR_M = 0.3
"""Higher than this by the range finder the motors are not stopped, whatever the autopilot says."""
_OWN_DESCENT_NS = 5_000_000_000
"""For so long an unheard vehicle is brought down by setpoints before the landing is ordered."""
_UNHEARD_ORDERS = 6
"""Orders to land that an unheard vehicle gets in quick succession; then one now and again."""
_UNHEARD_PAUSE_NS, _UNHEARD_AGAIN_NS = 500_000_000, 5_000_000_000
_HAND_BACK_S = 0.2
_HAND_BACK_ANSWER_S = 0.06
_ENGAGED = frozenset({Demand.KEEP, Demand.FLY, Demand.LAND, Demand.DISARM})


class FirmwareRules(Protocol):
    """What differs from firmware to firmware."""

    flying_mode: int
    landing_mode: int
    prime_s: float

    def mode_name(self, custom_mode: int) -> str: ...

    def mode_params(self, custom_mode: int) -> tuple[float, ...]: ...

    def not_fit(self) -> Refusal | None:
        """Why the vehicle must not be flown by us; None where it may."""
        ...

    def not_set_up(self) -> Refusal | None:
        """Why the vehicle must not be armed: it would stay in the air if this computer died, or a parameter
        is wrong for the job; None where it may."""
        ...

    def keeps_climb(self) -> bool:
        """Whether the autopilot itself keeps a setpoint's climb rate: our own height loop cannot sink by
        measurements that no longer come."""
        ...


class Heard(Protocol):
    """What has to be known of the vehicle; `heartbeat_ns` is 0 until it was heard."""

    heartbeat_ns: int
    armed: bool

    @property
    def custom_mode(self) -> int | None: ...

    @property
    def attitude(self) -> Attitude | None: ...

    def landed(self, now_ns: int) -> LandedState: ...

    def height_m(self, now_ns: int) -> float: ...


class Commands(Protocol):
    """How the vehicle is commanded: repeated when unanswered while `wanted`."""

    async def send(
        self, command: int, /, *params: float, patience_s: float = ..., wanted: Callable[[], bool] = ...
    ) -> Answer: ...

    def post(self, command: int, *params: float) -> None:
        """Send once, whether anybody answers or not."""
        ...


class ModeArmingManager:
    """Holds the demand and pursues it while the vehicle is ours.

    One arming per FLY demand: a vehicle that was armed under it and is disarmed again (landed, timed
    out, the pilot's switch) is not armed anew until FLY follows another demand.
    """

    def __init__(self, firmware: FirmwareRules, commander: Commands, telemetry: Heard, clock: Clock) -> None:
        self._firmware = firmware
        self._commander = commander
        self._telemetry = telemetry
        self._clock = clock
        self._authority = Authority()
        self._reasons: deque[tuple[int, str]] = deque(maxlen=4)
        self._demand = Demand.STANDBY
        self._was_armed = False
        self._unflown_since_ns: int | None = None
        self._refused: Refusal | None = None
        self._refused_ns = 0
        self._wake = asyncio.Event()
        self._unheard_since_ns = self._unheard_ns = self._unheard_orders = 0
        self._unread = False
        """The vehicle was taken over though it is not known how it takes setpoints: it gets none until it
        is."""

    # What is so

    @property
    def is_engaged(self) -> bool:
        """Whether the mission wants something of the vehicle."""
        return self._demand in _ENGAGED

    @property
    def is_silent(self) -> bool:
        """Whether the vehicle has not been heard for three seconds."""
        heard_ns = self._telemetry.heartbeat_ns
        return not heard_ns or self._clock.now_ns() - heard_ns > _SILENT_NS

    @property
    def lands_unheard(self) -> bool:
        """Whether a vehicle of ours that is no longer heard has to come down: what goes up to it may still
        arrive, and nobody else tells it to."""
        down = self._demand in {Demand.LAND, Demand.DISARM}
        return down and self.is_silent and self._authority.held is not None and self._telemetry.armed

    @property
    def steers_unheard(self) -> bool:
        """Whether setpoints go out to a vehicle that lands unheard: one that a pilot has taken meanwhile
        passes over them."""
        flying = self._authority.held == self._firmware.flying_mode
        return self.lands_unheard and flying and self._firmware.keeps_climb()

    @property
    def in_control(self) -> bool:
        """Whether the vehicle is in a mode that we asked for."""
        return self._authority.held is not None and not self.is_silent

    @property
    def may_steer(self) -> bool:
        """Whether setpoints may go out.  Heartbeats alone that fail to come do not end them: an autopilot
        whose setpoints stop flies on by the last lean until its own time-out, and one that a pilot has
        taken meanwhile passes over them."""
        flying = self._authority.held == self._firmware.flying_mode and not self._unread
        return self.is_engaged and flying and (not self.is_silent or self._tells())

    def _tells(self) -> bool:
        attitude = self._telemetry.attitude
        return attitude is not None and self._clock.now_ns() - attitude.stamp_ns < _TELLING_NS

    @property
    def wants_flight(self) -> bool:
        """Whether FLY is demanded of a vehicle that nobody has taken from us."""
        return self._demand is Demand.FLY and not self._authority.taken and not self.is_silent

    @property
    def may_command(self) -> bool:
        """Whether the mission wants something of a vehicle that nobody has taken from us."""
        return self.is_engaged and not self._authority.taken

    @property
    def is_forsaken(self) -> bool:
        """Whether it waits, armed, for setpoints that we no longer send, and no pilot is in a mode of his
        own: it was given back by switch, or nobody had taken it."""
        now_ns, since_ns = self._clock.now_ns(), self._unflown_since_ns
        waits = since_ns is not None and now_ns - since_ns > _FORSAKEN_NS
        return waits and now_ns - self._telemetry.heartbeat_ns < _SEEN_NS

    @property
    def stands(self) -> bool:
        """On the floor, as far as the autopilot knows."""
        says = self._telemetry.landed(self._clock.now_ns())
        return not self._telemetry.armed or says is LandedState.ON_GROUND

    @property
    def unfit(self) -> Refusal | None:
        """Why a vehicle that stands disarmed would not be armed by us; None where it would."""
        if self._telemetry.armed or self.is_silent:
            return None
        return self._firmware.not_fit() or self._firmware.not_set_up()

    @property
    def off_floor_m(self) -> float | None:
        """The height at which nothing is disarmed, whatever the autopilot says; None on the floor.  NaN where
        no range finder tells and the autopilot does not say that it stands."""
        now_ns = self._clock.now_ns()
        height_m = self._telemetry.height_m(now_ns)
        stands = height_m <= _FLOOR_M or (
            math.isnan(height_m) and self._telemetry.landed(now_ns) is LandedState.ON_GROUND
        )
        return None if stands else height_m

    @property
    def refusal(self) -> Refusal | None:
        """What was refused and the autopilot's own words at that time; None where nothing was."""
        if self._authority.taken:
            return TakenOver()
        said = [text for at_ns, text in self._reasons if abs(at_ns - self._refused_ns) < _REASON_NS]
        refused = self._refused
        return ExplainedRefusal(refused, said[-1]) if refused is not None and said else refused

    # What happens

    def demand(self, demand: Demand) -> None:
        """What the mission wants from now on."""
        if demand is self._demand:
            return
        if demand not in _ENGAGED or self._demand not in _ENGAGED:
            self._authority.release()
        if demand is Demand.FLY:
            self._was_armed = self._telemetry.armed and self._authority.held is not None
        self._demand = demand
        self._unflown_since_ns = None
        self._refused = None
        self._wake.set()

    def heartbeat(self, now_ns: int) -> None:
        """The telemetry has taken a heartbeat."""
        mode = self._telemetry.custom_mode
        assert mode is not None
        if self._authority.heartbeat(mode, now_ns):
            _LOG.warning("taken over by mode %s", self._firmware.mode_name(mode))
            self._wake.set()
        if self._telemetry.armed and self._authority.held == self._firmware.flying_mode:
            self._was_armed = True
        flies_by_us = self._telemetry.armed and mode == self._firmware.flying_mode
        if self._demand is not Demand.HANDS_OFF or not flies_by_us:
            self._unflown_since_ns = None
        elif self._unflown_since_ns is None:
            self._unflown_since_ns = now_ns
            _LOG.warning("armed in mode %s, and nobody flies it", self._firmware.mode_name(mode))

    def text(self, severity: int, text: str, now_ns: int) -> None:
        """The autopilot said something; a warning may be the reason of a refusal."""
        if severity <= dialect.MAV_SEVERITY_WARNING:
            self._reasons.append((now_ns, text))

    # What is done

    async def run(self) -> None:
        """Pursue the demand until cancelled."""
        while True:
            await self._step(self._demand)
            await self._pause(_STEP_S)

    async def hand_back(self) -> None:
        """Leave the vehicle in a state that needs no companion: landing, or disarmed when both the autopilot
        and the range finder have it on the floor."""
        if self._authority.held != self._firmware.flying_mode or not self._telemetry.armed:
            return
        command: int = dialect.MAV_CMD_DO_SET_MODE
        params = self._firmware.mode_params(self._firmware.landing_mode)
        if self.stands and self._telemetry.height_m(self._clock.now_ns()) < _FLOOR_M:  # not when unknown
            command, params = dialect.MAV_CMD_COMPONENT_ARM_DISARM, (0.0,)
        else:
            self._authority.ask(self._firmware.landing_mode, self._telemetry.custom_mode)
        with contextlib.suppress(TimeoutError):
            async with Within(_HAND_BACK_S):
                await self._commander.send(command, *params, patience_s=_HAND_BACK_ANSWER_S)

    async def _step(self, demand: Demand) -> None:
        """One step from what the vehicle does towards what is demanded.  Of a vehicle that is not heard
        nothing is asked but to come down."""
        if demand not in _ENGAGED or self._authority.taken:
            return
        if self.is_silent:
            if self.lands_unheard:
                self._land_unheard()
            return
        self._unheard_since_ns = self._unheard_orders = 0
        firmware, held, armed = self._firmware, self._authority.held, self._telemetry.armed
        problem = self._problem(demand)
        match demand:
            case Demand.KEEP | Demand.LAND if held is None and armed and self._flies_for_nobody(problem):
                self._refused, self._unread = problem, problem is not None
                self._authority.ask(firmware.flying_mode, firmware.flying_mode)
            case Demand.FLY | Demand.KEEP if problem is not None:
                self._refuse(problem)
            case Demand.FLY if held != firmware.flying_mode:
                await self._ask_mode(firmware.flying_mode)
            case Demand.FLY if not armed and not self._was_armed:
                await self._ask("arming", dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
            case Demand.LAND if held is not None and held != firmware.landing_mode:
                await self._ask_mode(firmware.landing_mode)
            case Demand.DISARM if held is not None and armed and (off_m := self.off_floor_m) is not None:
                self._refuse(OffFloor(off_m))
            case Demand.DISARM if held is not None and armed:
                await self._ask("disarming", dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0.0)
            case _:
                pass

    def _problem(self, demand: Demand) -> Refusal | None:
        """What keeps the vehicle from being flown as demanded, where that is to be begun."""
        unfit = self._firmware.not_fit()
        if self._unread and unfit is None:
            self._unread, self._refused = False, None
        begins = demand is Demand.FLY or (demand is Demand.KEEP and self._authority.held is None)
        problem = unfit if begins else None
        if demand is Demand.FLY and not self._telemetry.armed:  # one that flies already is looked after
            problem = problem or self._firmware.not_set_up()
        return problem

    def _flies_for_nobody(self, problem: Refusal | None) -> bool:
        """Whether a vehicle waits in the air for setpoints that nobody sends: it is ours to bring down, even
        where its parameters are not read yet, or are wrong: our heartbeats keep it from landing by itself."""
        ours = problem is None or isinstance(problem, ParameterUnread | ThrustMismatch)
        return ours and self._telemetry.custom_mode == self._firmware.flying_mode

    def _land_unheard(self) -> None:
        """Bring down a vehicle that may hear us: by setpoints first, where they can sink it, for they brake
        its drift by the pictures; then order the landing by every command there is, again and again.

        A pilot may have taken it meanwhile, unheard: setpoints are passed over then, and after the first
        orders there is time between them in which he keeps it.
        """
        now_ns = self._clock.now_ns()
        since_ns = self._unheard_since_ns = self._unheard_since_ns or now_ns
        if self.steers_unheard and now_ns - since_ns < _OWN_DESCENT_NS:
            return
        pause_ns = _UNHEARD_PAUSE_NS if self._unheard_orders < _UNHEARD_ORDERS else _UNHEARD_AGAIN_NS
        if self._unheard_orders and now_ns - self._unheard_ns < pause_ns:
            return
        self._unheard_ns = now_ns
        self._unheard_orders += 1
        firmware = self._firmware
        if self._authority.held != firmware.landing_mode:  # heard again in it, it is still ours
            self._authority.ask(firmware.landing_mode, self._telemetry.custom_mode)
        self._commander.post(dialect.MAV_CMD_DO_SET_MODE, *firmware.mode_params(firmware.landing_mode))
        self._commander.post(dialect.MAV_CMD_NAV_LAND)

    async def _ask_mode(self, mode: int) -> None:
        firmware, demand = self._firmware, self._demand
        if mode == firmware.flying_mode and firmware.prime_s > 0.0:
            await self._pause(firmware.prime_s)
            if not self._still(demand):
                return
        self._authority.ask(mode, self._telemetry.custom_mode)
        what, params = f"mode {firmware.mode_name(mode)}", firmware.mode_params(mode)
        if await self._ask(what, dialect.MAV_CMD_DO_SET_MODE, *params, pause_s=0.0):
            self._authority.accepted(mode, self._clock.now_ns())
        if self._still(demand):
            await self._pause(_MODE_PAUSE_S)

    async def _ask(self, what: str, command: int, *params: float, pause_s: float = _ARM_PAUSE_S) -> bool:
        """Ask once and keep the refusal; then give the heartbeat time to show what changed."""
        demand = self._demand
        answer = await self._commander.send(command, *params, wanted=lambda: self._still(demand))
        if self._still(demand):
            self._note(what, answer)
            if pause_s > 0.0:
                await self._pause(pause_s)
        return answer.accepted

    def _note(self, what: str, answer: Answer) -> None:
        if answer.accepted:
            self._refused = None
        else:
            self._refuse(CommandRefused(what, answer))

    def _refuse(self, refusal: Refusal) -> None:
        self._refused = refusal
        self._refused_ns = self._clock.now_ns()

    def _still(self, demand: Demand) -> bool:
        return self._demand is demand and not self._authority.taken

    async def _pause(self, duration_s: float) -> None:
        """Wait, or until the demand or the vehicle's owner changes."""
        with contextlib.suppress(TimeoutError):
            async with Within(duration_s):
                await self._wake.wait()
        self._wake.clear()
