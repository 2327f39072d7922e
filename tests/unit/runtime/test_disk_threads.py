"""A disk that hangs keeps nothing waiting but disk work, and what would wait for ever is told."""

from __future__ import annotations

import asyncio
import os
import signal
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from flightd.adapters.store.kept_file import KeptFile
from flightd.app.computer_check import CheckHangs, ComputerCheck
from flightd.core.errors import TransientError
from flightd.runtime import disk_threads
from flightd.runtime.child_process import Child
from flightd.runtime.disk_threads import DiskThreads
from flightd.runtime.within import Within
from tests.rigs.event_loops import real, virtual
from tests.rigs.waiting import until

FILES = 40
"""More than asyncio has threads, on any computer."""


def waiting() -> Callable[[Any], Any]:
    """Of a child that never answers."""
    return lambda _: signal.pause()


async def hanging_files(folder: Path, told: list[str]) -> list[asyncio.Task[None]]:
    """Files that are being written to a disk which takes nothing: pipes that nobody reads."""

    async def kept(file: KeptFile[str]) -> None:
        try:
            await file.run()
        except TransientError as err:
            told.append(str(err))

    tasks = []
    for number in range(FILES):
        os.mkfifo(folder / f"{number}.new")
        file: KeptFile[str] = KeptFile(folder / str(number), "a file", str)
        tasks.append(asyncio.create_task(kept(file)))
        file.put("what is kept")
    return tasks


def pipes_in(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.new"))


def test_children_start_and_threads_work_while_a_disk_hangs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(disk_threads, "_ALL", DiskThreads())

    async def test() -> None:
        told: list[str] = []
        tasks, started = await hanging_files(tmp_path, told), asyncio.Event()
        await asyncio.sleep(0.1)
        try:
            async with Within(20.0):
                assert await asyncio.to_thread(threading.current_thread) is not threading.main_thread()
            child = Child(waiting, lambda _: started.set(), lambda _: None)
            async with Within(20.0):
                await started.wait()
            child.kill()
            child.join(5.0)
            assert told, "what finds no room is told"
            assert set(told) == {"a disk does not answer, and too much waits for it already"}
        finally:
            pipes = [os.open(path, os.O_RDONLY | os.O_NONBLOCK) for path in pipes_in(tmp_path)]
            await until(lambda: len(told) == FILES)
            for pipe in pipes:
                os.close(pipe)
            await asyncio.gather(*tasks)

    real(test())


def test_there_is_room_again_when_it_answers() -> None:
    async def test() -> None:
        disk, answers = DiskThreads(threads=1, most=2), threading.Event()
        waits = [asyncio.create_task(disk.run(answers.wait)) for _ in range(2)]
        await asyncio.sleep(0)
        with pytest.raises(TransientError, match="does not answer"):
            await disk.run(threading.active_count)
        answers.set()
        assert await asyncio.gather(*waits) == [True, True]
        assert await disk.run(int, "7") == 7

    real(test())


def test_a_computer_that_cannot_even_be_looked_at_for_its_disk_is_not_fit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(disk_threads, "_ALL", DiskThreads(threads=1, most=0))

    async def test() -> None:
        check = ComputerCheck(list)
        assert check.unfit is None
        with pytest.raises(TransientError):
            await check.run(lambda: True)
        assert check.unfit == CheckHangs()

    virtual(test())
