"""The simulated world as a process of its own, and how its launcher hears of it."""

from __future__ import annotations

import asyncio
import signal
import socket
from collections.abc import Coroutine
from pathlib import Path
from typing import Any

from flightd.adapters.recorder.recorder import McapRecorder
from flightd.core.errors import FlightdError, RunError
from flightd.runtime.clock import LoopClock
from flightd.runtime.event_loops import ScaledLoop
from flightd.runtime.message_channel import Channel, ChildEnd
from flightd.sim.scenario.faults import FaultListener
from flightd.sim.world import World, WorldSpec

_END_S = 15.0
"""So long a world may take to close its log, once it has told all."""


async def watch_world(process: Any, channel: Channel, tell: FaultListener) -> None:
    """Pass on what the world tells; return when its process has died; raises what it died of."""
    died, failed = asyncio.Event(), list[BaseException]()

    def take(news: Any) -> None:
        if isinstance(news, BaseException):
            failed.append(news)
        else:
            tell(*news)

    channel.listen(take, lambda _: died.set())
    try:
        await died.wait()
    finally:
        channel.close()
    await asyncio.to_thread(process.join, _END_S)
    if failed:
        raise failed[0]


def run_world(spec: WorldSpec, factor: float, log: Path, link: socket.socket) -> None:
    """The world's process: lives until the other end of `link` closes."""
    parent = ChildEnd(link)
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    async def main() -> None:
        closed = asyncio.Event()
        asyncio.get_running_loop().add_reader(parent.fileno(), closed.set)
        with McapRecorder(log) as recorder:
            world = World(spec, LoopClock(), recorder, lambda *turn: parent.send(turn))
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
        parent.send(err)
    except Exception as err:
        parent.send(RunError(f"the simulated world failed: {type(err).__name__}: {err}"))
        raise
