"""The setpoint stream: its own rate, level when its maker is dead, silent when told."""

from __future__ import annotations

import asyncio
import itertools

import pytest

from flightd.app.absent_parts import NoRecorder
from flightd.app.build import noted
from flightd.app.detection.latency import LatencyBook
from flightd.app.setpoint_pump import SetpointPump
from flightd.core.types import Attitude, AttitudeSetpoint, Demand, Event, VehicleState
from flightd.runtime.clock import LoopClock
from flightd.runtime.supervisor import FaultBarrier
from tests.rigs.event_loops import virtual

MS = 1_000_000


class Wire:
    """Takes setpoints and the time they came."""

    def __init__(self, clock: LoopClock) -> None:
        self._clock = clock
        self.sent: list[tuple[int, AttitudeSetpoint]] = []
        self.broken = False

    async def run(self) -> None: ...

    def state(self) -> VehicleState | None:
        return None

    def attitudes(self) -> list[Attitude]:
        return []

    def demand(self, demand: Demand) -> None: ...

    def send(self, setpoint: AttitudeSetpoint) -> bool:
        if self.broken:
            raise ValueError("it does not fit a message")
        self.sent.append((self._clock.now_ns(), setpoint))
        return True

    def notify(self, event: Event) -> None: ...


class BrokenRecorder(NoRecorder):
    def record(self, topic: str, stamp_ns: int, message: object) -> None:
        raise TypeError("it has no JSON form")


async def pumped(
    stop_after_s: float, watch_s: float, silence: bool = False
) -> list[tuple[int, AttitudeSetpoint]]:
    clock = LoopClock()
    start = clock.now_ns()
    wire = Wire(clock)
    pump = SetpointPump(wire, clock, lambda *_: None)
    running = asyncio.ensure_future(pump.run())
    while clock.now_ns() - start < stop_after_s * 1e9:
        pump.set(AttitudeSetpoint(clock.now_ns(), roll_rad=0.1, climb_mps=0.5))
        await asyncio.sleep(0.02)
    if silence:
        pump.set(None)
    await asyncio.sleep(watch_s)
    running.cancel()
    await asyncio.wait([running])
    return [(at - start, setpoint) for at, setpoint in wire.sent]


def test_a_dead_maker_of_set_points_leaves_level_and_hold_on_the_wire() -> None:
    sent = virtual(pumped(0.2, 1.0))
    gaps = [b[0] - a[0] for a, b in itertools.pairwise(sent)]
    assert max(gaps) <= 30 * MS
    late = [s for at, s in sent if at > (200 + 150 + 30) * MS]
    assert late
    assert {(s.roll_rad, s.pitch_rad, s.yaw_rate_radps, s.climb_mps) for s in late} == {(0.0, 0.0, 0.0, 0.0)}


def test_a_fresh_set_point_leaves_at_once() -> None:
    sent = virtual(pumped(1.0, 0.0))
    assert all(at == setpoint.stamp_ns - sent[0][1].stamp_ns + sent[0][0] for at, setpoint in sent)


def test_hands_off_means_silence() -> None:
    sent = virtual(pumped(0.2, 1.0, silence=True))
    assert max(at for at, _ in sent) <= 200 * MS


def test_a_setpoint_at_which_the_adapter_fails_is_counted_and_the_next_goes_out() -> None:
    async def test() -> None:
        clock = LoopClock()
        wire = Wire(clock)
        pump = SetpointPump(wire, clock, lambda *_: None)
        running = asyncio.ensure_future(pump.run())
        for wire.broken in (False, True, False):
            sent = len(wire.sent)
            pump.set(AttitudeSetpoint(clock.now_ns()))
            await asyncio.sleep(0.01)
            assert (len(wire.sent) == sent) is wire.broken
        assert pump.failed == 1
        running.cancel()
        await asyncio.wait([running])

    virtual(test())


def test_an_adapter_that_goes_on_failing_is_not_left_alone_with_the_vehicle() -> None:
    """Its heartbeats would go on: the daemon ends, and hands the vehicle back to land."""

    async def test() -> None:
        clock = LoopClock()
        wire = Wire(clock)
        wire.broken = True
        pump = SetpointPump(wire, clock, lambda *_: None)
        pump.set(AttitudeSetpoint(clock.now_ns()))
        with pytest.raises(ValueError, match="does not fit"):
            await asyncio.wait_for(pump.run(), 1.0)

    virtual(test())


def test_whoever_fails_at_being_told_of_a_setpoint_stops_none() -> None:
    """The flight log and the book of latencies: the wire is not theirs to keep waiting, or to end."""

    async def test() -> None:
        told: list[str] = []
        clock = LoopClock()
        wire = Wire(clock)
        barrier = FaultBarrier(lambda part, err: told.append(f"{part}: {err}"))
        pump = SetpointPump(wire, clock, noted(LatencyBook(), BrokenRecorder(), barrier))
        running = asyncio.ensure_future(pump.run())
        for _ in range(3):
            pump.set(AttitudeSetpoint(clock.now_ns()))
            await asyncio.sleep(0.01)
        assert not running.done()
        assert len(wire.sent) == 3
        assert told == ["recorder: it has no JSON form"]
        running.cancel()
        await asyncio.wait([running])

    virtual(test())
