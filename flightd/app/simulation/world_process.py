"""The simulated world as a process of its own, and how its launcher hears of it."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Coroutine
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from flightd.adapters.recorder.recorder import McapRecorder
from flightd.core.errors import FlightdError, RunError
from flightd.runtime.clock import LoopClock
from flightd.runtime.event_loops import ScaledLoop
from flightd.sim.scenario.faults import FaultListener
from flightd.sim.world import World, WorldSpec


async def watch_world(process: Any, pipe: Connection, tell: FaultListener) -> None:
    """Pass on what the world tells; return when its process has died; raises what it died of."""
    loop, died, failed = asyncio.get_running_loop(), asyncio.Event(), list[BaseException]()

    def read() -> None:
        try:
            while pipe.poll():
                news = pipe.recv()
                if isinstance(news, BaseException):
                    failed.append(news)
                else:
                    tell(*news)
        except (EOFError, OSError):
            loop.remove_reader(pipe.fileno())

    loop.add_reader(process.sentinel, died.set)
    loop.add_reader(pipe.fileno(), read)
    try:
        await died.wait()
        read()
    finally:
        loop.remove_reader(process.sentinel)
        loop.remove_reader(pipe.fileno())
    if failed:
        raise failed[0]


def run_world(spec: WorldSpec, factor: float, log: Path, pipe: Connection) -> None:
    """The world's process: lives until the other end of `pipe` closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    async def main() -> None:
        closed = asyncio.Event()
        asyncio.get_running_loop().add_reader(pipe.fileno(), closed.set)
        with McapRecorder(log) as recorder:
            world = World(spec, LoopClock(), recorder, lambda *turn: pipe.send(turn))
            parts: tuple[Coroutine[Any, Any, Any], ...] = (world.run(), recorder.run(), closed.wait())
            tasks = [asyncio.ensure_future(part) for part in parts]
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in tasks:
                task.cancel()
            await asyncio.wait(tasks)
            for task in tasks:
                if not task.cancelled():
                    task.result()

    try:
        with asyncio.Runner(loop_factory=lambda: ScaledLoop(factor)) as runner:
            runner.run(main())
    except FlightdError as err:
        pipe.send(err)
    except Exception as err:
        pipe.send(RunError(f"the simulated world failed: {type(err).__name__}: {err}"))
        raise
