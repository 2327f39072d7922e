"""A control tick whose parts fail, the pilot among them: nothing good is taken for their answer."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import pytest

from flightd.app.build import assemble, pilot_of
from flightd.app.publishers import TelemetryPublishers
from flightd.app.tick import Tick
from flightd.core.flight_order import FlightOrder
from flightd.core.outlook import Outlook
from flightd.core.tick import StepFailure, TickInput
from flightd.core.topics import Topic
from flightd.core.types import (
    HEALTHY,
    AttitudeSetpoint,
    Command,
    CommandKind,
    Demand,
    Event,
    Health,
    Phase,
    VehicleState,
)
from flightd.mission.mission import Mission
from flightd.mission.safety.last_resort import LastResort
from tests.sim.ideal.ideal_ports import HeldSetpoint, IdealGround, IdealRecorder, IdealVehicle, IdealVision
from tests.sim.ideal.test_ideal_scan import CONFIG
from tests.unit.mission.shelves import SITE
from tests.unit.mission.test_last_resort import FLYING
from tests.unit.mission.test_readiness import VEHICLE

_T = TypeVar("_T")
S = 10**9


class BrokenError(Exception):
    """What no part ever raises."""


class Ticked:
    """A tick whose parts fail while they are told to, and all that is recorded of it."""

    def __init__(self) -> None:
        self.now_s = 1.0
        self.vehicle: VehicleState | None = VEHICLE
        self.demands: list[Demand] = []
        self.commands: list[Command] = []
        self.silent_s = 0.0
        self.broken: set[str] = set()
        self.kept: list[tuple[str, object]] = []
        self.setpoints = HeldSetpoint()
        self.pilot = pilot_of(CONFIG, SITE, FlightOrder(("A2",)))
        vehicle = IdealVehicle(self._told("vehicle", lambda: self.vehicle), self.demands.append)
        ground = IdealGround(lambda: self.commands, self._told("ground", lambda: self.silent_s))
        recorder = IdealRecorder(
            self._told("recorder", lambda: HEALTHY),
            lambda topic, _, message: self.kept.append((topic, message)),
        )
        self.tick = Tick(
            assemble(
                CONFIG,
                SITE,
                self.pilot,
                vehicle=vehicle,
                setpoints=self.setpoints,
                vision=IdealVision(self._told("vision", lambda: Health(0.02, 3))),
                publishers=TelemetryPublishers(self, vehicle, recorder, ground),
                clock=self,
                recorder=recorder,
                ground=ground,
            )
        )

    def _told(self, part: str, answer: Callable[[], _T]) -> Callable[[], _T]:
        def told() -> _T:
            if part in self.broken:
                raise BrokenError
            return answer()

        return told

    def now_ns(self) -> int:
        """`ports.Clock`."""
        return round(self.now_s * S)

    def of(self, topic: Topic) -> list[object]:
        return [message for kept, message in self.kept if kept == topic]

    def run(self, now_s: float) -> TickInput:
        """What the tick is given then."""
        self.now_s = now_s
        self.tick.run(self.now_ns())
        given = self.of(Topic.TICK)[-1]
        assert isinstance(given, TickInput)
        return given


@pytest.mark.parametrize(("silent_s", "after_s"), [(2.0, 7.0), (0.0, 0.0)])
def test_a_ground_link_that_fails_goes_on_being_silent(silent_s: float, after_s: float) -> None:
    """It was taken for one that nobody attends, and never lost; one that nobody attends loses nobody."""
    flight = Ticked()
    flight.silent_s = silent_s
    assert flight.run(1.0).ground_silent_s == silent_s
    flight.broken = {"ground"}
    assert flight.run(6.0).ground_silent_s == pytest.approx(after_s)
    assert any(
        isinstance(event, Event) and "ground link: Broken" in event.text for event in flight.of(Topic.EVENT)
    )


def test_a_ground_link_that_never_answers_is_silent_from_the_start() -> None:
    flight = Ticked()
    flight.broken = {"ground"}
    flight.run(1.0)
    assert flight.run(6.0).ground_silent_s > 4.9


def test_a_vehicle_that_fails_to_tell_is_as_it_told_last() -> None:
    """It was taken for one that is not there, and so not armed."""
    flight = Ticked()
    flight.broken = {"vehicle"}
    assert flight.run(1.0).vehicle is None
    flight.broken = set()
    assert flight.run(2.0).vehicle == VEHICLE
    flight.broken = {"vehicle"}
    assert flight.run(9.0).vehicle == VEHICLE
    flight.broken, flight.vehicle = set(), None
    assert flight.run(10.0).vehicle is None


def test_a_part_that_cannot_tell_how_it_does_is_not_healthy() -> None:
    flight = Ticked()
    healthy = Health(0.02, 3)
    assert flight.run(1.0).health == healthy
    flight.broken = {"vision", "recorder"}
    assert flight.run(1.5).health == healthy, "for a moment"
    ill = flight.run(2.5).health
    assert ill.latency_p99_s > CONFIG.hazards.latency_s
    assert ill.recorder_error
    assert ill.detectors_replaced == 3
    flight.broken = {"vision"}
    assert flight.run(3.0).health.recorder_error == ""


@pytest.mark.parametrize("resort", [True, False])
def test_an_error_that_escapes_the_pilot_lands_what_flies(
    resort: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It ended the daemon."""
    flight = Ticked()
    flight.vehicle = FLYING
    flight.run(1.0)

    def fail(*_: object) -> None:
        raise BrokenError

    monkeypatch.setattr(LastResort, "given_up", property(fail))
    if not resort:
        monkeypatch.setattr(LastResort, "step", fail)
    for now_s in (1.02, 1.04):
        flight.run(now_s)
        assert flight.demands[-1] is Demand.LAND
        level = flight.setpoints.newest
        assert isinstance(level, AttitudeSetpoint)
        assert (level.roll_rad, level.pitch_rad) == (0.0, 0.0)
        assert level.climb_mps <= 0.0
    assert (flight.tick.output.phase, len(flight.demands)) == (Phase.LAND, 3)
    (failure,) = flight.of(Topic.FAILURE)
    assert isinstance(failure, StepFailure)
    assert "Traceback" in failure.traceback
    flight.vehicle = VEHICLE
    monkeypatch.undo()
    flight.run(1.06)
    assert (flight.tick.output.phase, flight.demands[-1]) == (Phase.ABORTED, Demand.DISARM)


def test_a_stop_behind_an_order_that_fails_is_obeyed(monkeypatch: pytest.MonkeyPatch) -> None:
    flight = Ticked()
    mission = flight.pilot.mission
    command = mission.command

    def breaks(order: Command, now_ns: int) -> None:
        if order.kind is CommandKind.START:
            raise BrokenError
        command(order, now_ns)

    monkeypatch.setattr(mission, "command", breaks)
    flight.commands = [Command("1", CommandKind.START), Command("2", CommandKind.STOP)]
    flight.run(1.0)
    flight.commands = []
    flight.run(1.02)
    assert (mission.phase, mission.reason) == (Phase.ABORTED, "stop ordered")


def test_what_only_people_are_told_is_asked_of_the_mission_when_they_are_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Ten times a second, and at each of sixty ticks all that the record keeps."""
    flight, asked = Ticked(), list[int]()
    outlook = Mission.outlook

    def counted(mission: Mission, now_ns: int) -> Outlook:
        asked.append(now_ns)
        return outlook(mission, now_ns)

    monkeypatch.setattr(Mission, "outlook", counted)
    for tick in range(60):
        flight.run(1.0 + tick / 60)
    assert len(flight.of(Topic.TICK)) == 60
    assert 9 <= len(asked) <= 11
    assert len(flight.of(Topic.STATUS)) == len(asked)
