"""Whatever fails in a control tick, the drone is levelled and landed, and the record is whole.

Every public function that the pilot's step reaches in the air is made to raise, at a random one of the
moments at which it is called, once or for ever.  FLIGHTD_FAILURES says how many of these are flown, drawn by
a fixed seed.
"""

from __future__ import annotations

import cProfile
import gc
import itertools
import math
import os
import random
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from functools import cache
from pathlib import Path
from types import CodeType, FrameType, FunctionType
from typing import Any

import pytest

import flightd
from flightd.app.absent_parts import NO_RECORDER
from flightd.app.build import assemble, pilot_of
from flightd.app.publishers import TelemetryPublishers
from flightd.app.tick import Tick
from flightd.core.flight_order import FlightOrder
from flightd.core.snapshot import Snapshot
from flightd.core.tick import TickInput, TickOutput
from flightd.core.topics import Topic
from flightd.core.types import HEALTHY, Command, CommandKind, Demand, EventLevel, Phase
from flightd.mission.guidance import Guidance, MissionInputs
from flightd.mission.mission import Mission
from flightd.mission.reasons import in_words
from flightd.mission.safety.last_resort import LastResort
from flightd.pilot import Pilot
from flightd.runtime.clock import LoopClock
from tests.rigs.event_loops import virtual
from tests.sim.ideal.ideal_flight import Flown, IdealFlight
from tests.sim.ideal.ideal_ports import HeldSetpoint, IdealGround, IdealVehicle, IdealVision
from tests.sim.ideal.test_ideal_scan import CONFIG, ONE_SIDED, scan_flight
from tests.unit.mission.shelves import SITE

PACKAGE = str(Path(flightd.__file__).parent)
MANY = int(os.environ.get("FLIGHTD_FAILURES", "4"))
TOGETHER = 10
"""In one test: which functions there are takes a whole flight to find out."""
APART = {Pilot.step.__code__, LastResort.step.__code__}
"""What catches, and what flies then."""
TICK_NS = 20_000_000
EARLY_S = 24.0
"""Until when after arming a function is made to raise that is called so early."""


class InjectedError(Exception):
    """What no part ever raises."""


@contextmanager
def profiled(profile: Callable[[FrameType, str, Any], None]) -> Iterator[None]:
    sys.setprofile(profile)
    try:
        yield
    finally:
        sys.setprofile(None)


FAIL: list[Callable[[], None]] = []


def fail_now(*_args: Any, **_kwargs: Any) -> None:
    """What a broken function does instead of its own work."""
    __import__("sys").modules["tests.sim.hazards.test_step_failures"].FAIL[0]()


def breaking(code: CodeType) -> Callable[[Callable[[], None]], AbstractContextManager[None]]:
    """What makes all functions of this code call something else meanwhile.  Those that use variables of the
    function around them cannot be changed: they are watched, which costs a flight three times as long."""
    gc.unfreeze()  # what stood before the tests began is looked through too
    functions = [one for one in gc.get_referrers(code) if isinstance(one, FunctionType)]

    @contextmanager
    def changed(fail: Callable[[], None]) -> Iterator[None]:
        FAIL[:] = [fail]
        for function in functions:
            function.__code__ = fail_now.__code__
        try:
            yield
        finally:
            for function in functions:
                function.__code__ = code

    @contextmanager
    def watched(fail: Callable[[], None]) -> Iterator[None]:
        def seen(frame: FrameType, event: str, _: Any) -> None:
            if event == "call" and frame.f_code is code:
                fail()

        with profiled(seen):
            yield

    return changed if functions and not code.co_freevars else watched


def name_of(code: CodeType) -> str:
    return f"{Path(code.co_filename).relative_to(PACKAGE).with_suffix('')}:{code.co_qualname}"


def short_flight() -> IdealFlight:
    return scan_flight(("A2",), site=ONE_SIDED)


def reached() -> dict[str, tuple[CodeType, list[float]]]:
    """The public functions that the steps of a whole flight call once it is armed, by name, with the times
    since then."""
    found = dict[CodeType, list[float]]()
    armed_ns = list[int]()
    flight = short_flight()
    step = flight.pilot.step

    def noted(tick: TickInput) -> TickOutput:
        if tick.vehicle is None or not tick.vehicle.armed:
            return step(tick)
        armed_ns[:] = armed_ns or [tick.now_ns]
        calls = cProfile.Profile(builtins=False)  # notes them a few times as fast as a function of ours
        output: TickOutput = calls.runcall(step, tick)
        for code in {entry.code for entry in calls.getstats() if isinstance(entry.code, CodeType)}:
            found.setdefault(code, []).append((tick.now_ns - armed_ns[0]) * 1e-9)
        return output

    flight.pilot.step = noted  # type: ignore[method-assign]
    assert flight.fly().phase is Phase.DONE
    return {
        name_of(code): (code, times)
        for code, times in found.items()
        if code not in APART
        and code.co_filename.startswith(PACKAGE)
        and not code.co_name.startswith(("_", "<"))
    }


def fly_with(code: CodeType, at_s: float, *, once: bool) -> tuple[Flown, list[tuple[str, Any]], int]:
    """A flight in which the function raises from that time after arming on, all that was recorded of it, and
    the tick in which it first raised, 0 for none."""
    kept: list[tuple[str, Any]] = []
    flight = short_flight()
    flight.on_record = lambda topic, _stamp_ns, message: kept.append((topic, message))
    step, raised = _failing(flight.pilot.step, code, at_s, once=once)
    flight.pilot.step = step  # type: ignore[method-assign,assignment]
    flown = flight.fly(120.0)
    return flown, kept, raised[0] if raised else 0


def _failing(
    step: Callable[[TickInput], TickOutput], code: CodeType, at_s: float, *, once: bool
) -> tuple[Callable[[TickInput], TickOutput], list[int]]:
    raised: list[int] = []
    armed_ns: list[int] = []
    breaks = breaking(code)

    def failing(tick: TickInput) -> TickOutput:
        if tick.vehicle is not None and tick.vehicle.armed and not armed_ns:
            armed_ns.append(tick.now_ns)
        due = armed_ns and (tick.now_ns - armed_ns[0]) * 1e-9 >= at_s and not (once and raised)

        def fail() -> None:
            raised.append(tick.now_ns)
            raise InjectedError(code.co_qualname)

        if not due:
            return step(tick)
        with breaks(fail):
            return step(tick)

    return failing, raised


@cache
def trials() -> list[tuple[str, CodeType, bool, float]]:
    """Each function once and for ever, from a time drawn of those at which it is called; the first of them
    are flown."""
    draw = random.Random(14)
    found = [
        (name, code, once, draw.choice([at_s for at_s in times if at_s <= EARLY_S] or times))
        for name, (code, times) in sorted(reached().items())
        for once in (True, False)
    ]
    draw.shuffle(found)
    return found


@pytest.mark.parametrize("first", range(0, MANY, TOGETHER))
def test_whatever_a_step_raises_the_drone_is_levelled_and_landed(first: int) -> None:
    for trial in trials()[first : min(first + TOGETHER, MANY)]:
        is_levelled_and_landed(*trial)


def is_levelled_and_landed(name: str, code: CodeType, once: bool, at_s: float) -> None:
    print(f"{name} raises {'once' if once else 'for ever'} from {at_s:.1f} s on")
    flown, kept, raised_ns = fly_with(code, at_s, once=once)
    ticks = [message.now_ns for topic, message in kept if topic == Topic.TICK]
    assert len(ticks) == len(flown.outputs)
    assert all(0 < b - a <= TICK_NS for a, b in itertools.pairwise(ticks)), "a tick is missing in the record"
    if not raised_ns:  # it is not called so late in a flight
        assert flown.phase is Phase.DONE
        return
    outputs = dict(zip(ticks, flown.outputs, strict=True))
    is_level_and_comes_down(flown, outputs, raised_ns)
    told = [event for event in flown.events if event.name == "step_failed"]
    assert told
    assert "InjectedError" in told[0].text, "what was left half done may raise something else after it"
    assert all(event.level is EventLevel.ERROR for event in told)
    assert told == [message for topic, message in kept if topic == Topic.EVENT and message in told]
    failures = [message for topic, message in kept if topic == Topic.FAILURE]
    assert [failure.stamp_ns for failure in failures] == [event.stamp_ns for event in told]
    assert all("Traceback" in failure.traceback for failure in failures)
    assert name.split(":")[1] in failures[0].error


def is_level_and_comes_down(flown: Flown, outputs: Mapping[int, TickOutput], raised_ns: int) -> None:
    failed = outputs[raised_ns]
    if failed.setpoint is not None:
        assert (failed.setpoint.roll_rad, failed.setpoint.pitch_rad) == (0.0, 0.0)
        assert failed.setpoint.climb_mps <= 0.0
    after = [output.phase for stamp_ns, output in outputs.items() if stamp_ns > raised_ns]
    assert set(after) <= {Phase.LAND, Phase.DONE, Phase.ABORTED}
    assert len(after) * TICK_NS < 20_000_000_000
    assert flown.phase in {Phase.DONE, Phase.ABORTED}
    assert flown.truth[-1][1].height_m < 0.2


def test_without_its_mission_it_comes_to_rest_over_the_floor_and_sinks_there() -> None:
    flown, kept, raised_ns = fly_with(Mission.step.__code__, 5.0, once=False)
    ticks = [message.now_ns for topic, message in kept if topic == Topic.TICK]
    outputs = dict(zip(ticks, flown.outputs, strict=True))
    is_level_and_comes_down(flown, outputs, raised_ns)
    after = [output for stamp_ns, output in outputs.items() if stamp_ns > raised_ns]
    demands = [demand for demand, _ in itertools.groupby(output.demand for output in after)]
    assert demands[:2] == [Demand.KEEP, Demand.LAND], "the last of it is the autopilot's own landing"
    down = [truth for phase, truth in flown.truth if phase in {Phase.LAND, Phase.ABORTED}]
    assert math.hypot(down[0].vx_mps, down[0].vy_mps) > 0.3, "it was on its way"
    assert math.hypot(down[0].x_m - down[-1].x_m, down[0].y_m - down[-1].y_m) < 0.5


class Broken:
    """Somebody who is told of a flight, and fails at it."""

    def __init__(self) -> None:
        self.told = 0

    def __call__(self, snapshot: Snapshot) -> None:
        self.told += 1
        raise InjectedError("no display")


def test_whoever_fails_at_being_told_ends_no_flight_and_is_named_once() -> None:
    display, kept = Broken(), list[tuple[str, Any]]()
    flight = scan_flight(("A3",), site=ONE_SIDED, observers=[display])
    flight.on_record = lambda topic, _stamp_ns, message: kept.append((topic, message))
    assert flight.fly(120.0).phase is Phase.DONE
    assert display.told > 100
    assert [message.error for topic, message in kept if topic == Topic.FAILURE] == [
        "display: InjectedError: no display"
    ]
    assert [
        message.text for topic, message in kept if topic == Topic.EVENT and message.name == "failure"
    ] == ["display: InjectedError: no display"]


def test_the_words_for_a_failure_may_fail_too() -> None:
    flown, _, raised_ns = fly_with(in_words.__code__, 16.4, once=False)
    assert raised_ns
    assert flown.phase is Phase.ABORTED
    assert flown.truth[-1][1].height_m < 0.2


def test_a_mission_that_is_given_up_takes_no_command() -> None:
    pilot = scan_flight(("A2",)).pilot

    def fail(_: MissionInputs) -> Guidance:
        raise ValueError("broken")

    assert pilot.possible_commands
    pilot.mission.__dict__["step"] = fail
    for now_ns in (20_000_000, 40_000_000):
        pilot.step(TickInput(now_ns))
    assert not pilot.possible_commands


def test_an_order_outlasts_a_ground_link_that_fails() -> None:
    answers: list[Exception | None] = [ValueError("broken"), None]

    def take() -> list[Command]:
        answer = answers.pop(0)
        if answer is not None:
            raise answer
        return []

    async def test() -> tuple[Phase, Phase]:
        clock = LoopClock()
        vehicle, ground = IdealVehicle(lambda: None, lambda _: None), IdealGround(take, lambda: 0.0)
        flight = assemble(
            CONFIG,
            SITE,
            pilot_of(CONFIG, SITE, FlightOrder(("A2",))),
            vehicle=vehicle,
            setpoints=HeldSetpoint(),
            vision=IdealVision(lambda: HEALTHY),
            publishers=TelemetryPublishers(clock, vehicle, NO_RECORDER, ground),
            clock=clock,
            ground=ground,
        )
        tick = Tick(flight)
        tick.order(Command("order", CommandKind.STOP))
        return tick.run(TICK_NS).phase, tick.run(2 * TICK_NS).phase

    assert virtual(test()) == (Phase.PREFLIGHT, Phase.ABORTED)
