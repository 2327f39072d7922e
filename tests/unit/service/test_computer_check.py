"""This computer is looked at again while the drone waits on the ground."""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

import pytest

from flightd.app import computer_check
from flightd.app.computer_check import ComputerCheck
from flightd.core.refusal import words
from flightd.doctor.check import Check, error, ok, warning
from tests.rigs.event_loops import in_real_time
from tests.rigs.waiting import until

WELL = [ok("disk", "12.0 GB free")]
FULL = [error("disk", "0.1 GB free", "delete something")]


class Disk:
    """What is found when it is looked at; it `answers` or hangs."""

    def __init__(self) -> None:
        self.found: list[Check] = WELL
        self.looks = 0
        self.answers = threading.Event()
        self.answers.set()

    def look(self) -> list[Check]:
        self.looks += 1
        self.answers.wait(60.0)
        return self.found


@asynccontextmanager
async def checked(
    disk: Disk, monkeypatch: pytest.MonkeyPatch, waits: Callable[[], bool] = lambda: True
) -> AsyncIterator[ComputerCheck]:
    monkeypatch.setattr(computer_check, "PERIOD_S", 0.01)
    monkeypatch.setattr(computer_check, "PATIENCE_S", 0.05)
    check = ComputerCheck(disk.look)
    running = asyncio.ensure_future(check.run(waits))
    try:
        yield check
    finally:
        disk.answers.set()
        running.cancel()
        await asyncio.wait([running])


@in_real_time
async def test_what_comes_up_while_it_waits_is_found_and_what_is_mended_forgotten(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    disk = Disk()
    async with checked(disk, monkeypatch) as check:
        assert check.unfit is None
        disk.found = FULL
        await until(lambda: words(check.unfit) == "0.1 GB free (delete something)", 20.0)
        disk.found = [error("disk", "0.2 GB free", "delete something")]
        looks = disk.looks
        await until(lambda: disk.looks > looks + 2, 20.0)
        assert words(check.unfit).startswith("0.1 GB"), "a figure that moves is no news"
        disk.found = WELL
        await until(lambda: check.unfit is None, 20.0)


@in_real_time
async def test_in_flight_nothing_is_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    disk, asked = Disk(), 0

    def waits() -> bool:
        nonlocal asked
        asked += 1
        return False

    async with checked(disk, monkeypatch, waits):
        await until(lambda: asked > 3, 20.0)
        assert disk.looks == 1, "before the flight"


@in_real_time
async def test_a_disk_that_hangs_keeps_nothing_else_waiting_and_the_drone_on_the_ground(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    disk = Disk()
    async with checked(disk, monkeypatch) as check:
        disk.answers.clear()
        await until(lambda: "does not end" in words(check.unfit), 20.0)
        looks = disk.looks
        await asyncio.sleep(0)
        assert disk.looks == looks == 2, "never twice at once"
        disk.answers.set()
        await until(lambda: check.unfit is None, 20.0)


@in_real_time
async def test_what_only_deserves_a_look_is_logged_once(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    disk = Disk()
    with caplog.at_level(logging.WARNING, computer_check.__name__):
        async with checked(disk, monkeypatch) as check:
            disk.found = [warning("cpu", "load 3.1", "stop what else runs")]
            await until(lambda: disk.looks > 3, 20.0)
            assert check.unfit is None
    assert [record.getMessage() for record in caplog.records] == ["cpu: load 3.1; stop what else runs"]
