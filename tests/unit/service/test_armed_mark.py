"""A file says while the motors may turn: for what shall not run beside a flight."""

from __future__ import annotations

import dataclasses
import logging
from pathlib import Path

import pytest

from flightd.app.armed_mark import ArmedMark
from flightd.app.service import monitors
from flightd.config.metrics import MetricsConfig
from flightd.core.snapshot import Snapshot
from tests.rigs.event_loops import real
from tests.unit.service.vitals import START_NS, vitals


def told(*, armed: bool) -> Snapshot:
    found = vitals()
    vehicle = found.vehicle
    assert vehicle is not None
    tick = dataclasses.replace(found.tick, vehicle=dataclasses.replace(vehicle, armed=armed))
    return dataclasses.replace(found, tick=tick)


def mark_in(folder: Path) -> ArmedMark:
    found = ArmedMark.of_environment({"RUNTIME_DIRECTORY": f"{folder}:/elsewhere"})
    assert found is not None
    return found


def test_the_mark_is_there_while_the_vehicle_is_armed(tmp_path: Path) -> None:
    mark, file = mark_in(tmp_path), tmp_path / "armed"
    for armed in (False, True, True, False, True):
        mark.tell(told(armed=armed))
        assert file.exists() is armed


def test_what_a_daemon_left_that_died_in_the_air_stays_until_the_vehicle_is_heard(tmp_path: Path) -> None:
    mark_in(tmp_path).tell(told(armed=True))
    after = mark_in(tmp_path)
    after.tell(vitals(START_NS, heard_ns=None))
    assert (tmp_path / "armed").exists()
    after.tell(told(armed=False))
    assert not (tmp_path / "armed").exists()


def test_a_folder_that_refuses_it_is_told_once_and_holds_up_nothing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    mark = mark_in(tmp_path / "gone")
    with caplog.at_level(logging.WARNING):
        for _ in range(3):
            mark.tell(told(armed=True))
    (line,) = caplog.messages
    assert line.startswith(f"{tmp_path / 'gone' / 'armed'}: No such file")


def test_the_service_keeps_the_mark_and_without_systemd_there_is_none(tmp_path: Path) -> None:
    async def kinds(environment: dict[str, str]) -> list[type]:
        async with monitors(MetricsConfig(), environment, journal=False) as found:
            return [type(one) for one in found]

    assert real(kinds({"RUNTIME_DIRECTORY": str(tmp_path)})) == [ArmedMark]
    assert real(kinds({})) == []
