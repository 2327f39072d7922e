"""How `flightd run` begins a flight and ends it: the vehicle first, whatever disk and signals do."""

from __future__ import annotations

import asyncio
import gc
import os
import signal
import threading
from typing import Any, cast

import pytest

from flightd.adapters.store.settings_file import SettingsFile
from flightd.app.daemon import Daemon
from flightd.app.maintenance.maintainer import DroneMaintainer
from flightd.app.run import RestartAsked, flown
from flightd.core.errors import UnavailableError
from flightd.runtime.ending_signals import end_on_signals
from tests.rigs.event_loops import real


class Flight:
    """A daemon, its maintainer and its settings' file: in which order they end."""

    def __init__(self, ends: Exception | None = None) -> None:
        self.ended: list[str] = []
        self.leaves = asyncio.Event()
        self.flies = asyncio.Event()
        self._ends = ends
        self.frozen = 0

    async def fly(self) -> None:
        self.frozen = gc.get_freeze_count()
        self.flies.set()
        if self._ends is not None:
            raise self._ends
        try:
            await asyncio.get_running_loop().create_future()
        finally:
            await asyncio.sleep(0.05)  # the last message to the vehicle
            self.ended.append("handed back")

    async def restart_asked(self) -> None:
        await self.leaves.wait()

    def confirm(self) -> None:
        beside = threading.current_thread() is not threading.main_thread()
        self.ended.append("settings confirmed beside the loop" if beside else "settings confirmed")

    async def flown(self) -> Any:
        try:
            return await flown(cast(Daemon, self), cast(DroneMaintainer, self), cast(SettingsFile, self))
        finally:
            gc.unfreeze()


IN_ORDER = ["handed back", "settings confirmed beside the loop"]


def test_a_signal_hands_the_vehicle_back_before_the_disk_is_asked_and_a_second_one_changes_nothing() -> None:
    async def test() -> None:
        flight = Flight()
        flying = asyncio.ensure_future(flight.flown())
        came: list[signal.Signals] = []
        end_on_signals(flying, came)
        await flight.flies.wait()
        for number in (signal.SIGTERM, signal.SIGINT):
            os.kill(os.getpid(), number)
            await asyncio.sleep(0.01)
        assert not flight.ended, "it is being handed back"
        with pytest.raises(asyncio.CancelledError):
            await flying
        assert flight.ended == IN_ORDER
        assert came == [signal.SIGTERM, signal.SIGINT]

    real(test())


def test_a_restart_that_is_asked_for_ends_in_the_same_order() -> None:
    async def test() -> None:
        flight = Flight()
        flight.leaves.set()
        assert isinstance(await flight.flown(), RestartAsked)
        assert flight.ended == IN_ORDER

    real(test())


def test_no_collection_in_flight_walks_what_was_there_before() -> None:
    async def test() -> None:
        flight = Flight()
        flight.leaves.set()
        made_before = len(gc.get_objects())
        await flight.flown()
        assert flight.frozen > made_before / 2, "but for what was garbage"

    real(test())


def test_settings_by_which_it_failed_stay_on_trial() -> None:
    async def test() -> None:
        flight = Flight(UnavailableError("no camera"))
        with pytest.raises(UnavailableError):
            await flight.flown()
        assert flight.ended == []

    real(test())
