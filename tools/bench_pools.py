"""What a picture costs in the detectors' own pool and in pebble's and loky's, and how long a dead or a hung
worker keeps the next pictures waiting.

One worker, pictures one after the other, the detector does nothing: what is timed is the way there and back.
Needs `pip install pebble loky`; one that is missing is left out.

python tools/bench_pools.py [--pictures N] [--deaths N]
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import os
import signal
import statistics
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from functools import partial
from importlib import import_module
from typing import Any, TypeAlias

from flightd.app.detection.detector_pool import DetectorPool
from flightd.core.types import Image, LineSet
from flightd.runtime.child_process import child_context
from flightd.runtime.clock import LoopClock
from flightd.runtime.frame_ring import FrameRing, FrameTicket

TIMEOUT_S = 0.5
FINE, DIES, HANGS = 0, 1, 2

Ask: TypeAlias = Callable[[FrameTicket], Awaitable[bool]]
"""One picture through a pool; whether an answer came."""


class NoDetector:
    """Finds nothing; the picture's number says how it goes wrong."""

    def detect(self, _bgr: Image, seq: int = 0, stamp_ns: int = 0) -> LineSet:
        if seq % 3 == DIES:
            os.kill(os.getpid(), signal.SIGKILL)
        if seq % 3 == HANGS:
            time.sleep(60)
        return LineSet(seq, stamp_ns, 640, 360, (), (), "none")


_rings: dict[str, FrameRing] = {}


def in_worker(ticket: FrameTicket) -> LineSet:
    """What the detectors' own worker does, for pools that run a plain function."""
    if ticket.ring not in _rings:
        _rings[ticket.ring] = FrameRing.attach(ticket.ring, ticket.slots, ticket.width_px, ticket.height_px)
    return NoDetector().detect(_rings[ticket.ring].pixels(ticket.slot), ticket.seq, ticket.stamp_ns)


@contextlib.asynccontextmanager
async def own() -> AsyncIterator[Ask]:
    with DetectorPool(partial(NoDetector), 1, TIMEOUT_S, LoopClock()) as pool:
        await pool.ready()

        async def ask(ticket: FrameTicket) -> bool:
            return await pool.detect(ticket) is not None

        yield ask


@contextlib.asynccontextmanager
async def pebble() -> AsyncIterator[Ask]:
    pool = import_module("pebble").ProcessPool(max_workers=1, context=child_context())

    async def ask(ticket: FrameTicket) -> bool:
        try:
            await asyncio.wrap_future(pool.schedule(in_worker, args=[ticket], timeout=TIMEOUT_S))
        except Exception:  # noqa: BLE001 - the library raises its own kinds: an answer or none is all that counts
            return False
        return True

    try:
        yield ask
    finally:
        pool.stop()
        await asyncio.to_thread(pool.join)


@contextlib.asynccontextmanager
async def loky() -> AsyncIterator[Ask]:
    make = partial(import_module("loky").get_reusable_executor, max_workers=1, kill_workers=True)

    async def ask(ticket: FrameTicket) -> bool:
        executor = make()  # anew where the last one broke; it starts longer than a picture may take
        await asyncio.wrap_future(executor.submit(os.getpid))
        try:
            await asyncio.wait_for(asyncio.wrap_future(executor.submit(in_worker, ticket)), TIMEOUT_S)
        except Exception:  # noqa: BLE001 - as above
            if not executor._flags.broken:  # noqa: SLF001 - it knows no time-out: a hung worker is ours to end
                await asyncio.to_thread(executor.shutdown, wait=False, kill_workers=True)
            return False
        return True

    try:
        yield ask
    finally:
        await asyncio.to_thread(make().shutdown, wait=True, kill_workers=True)


async def measure(pool: Any, pictures: int, deaths: int) -> dict[str, float]:
    """Milliseconds: a picture (median, 99th percentile), and from a death or time-out to the next answer."""
    ring = FrameRing.create(8, 640, 360)
    seq = 0

    def ticket(fate: int) -> FrameTicket:
        nonlocal seq
        seq += 3
        slot = ring.begin(seq + fate)
        ring.publish(slot, seq + fate, seq)
        return FrameTicket(ring.name, slot, ring.slots, seq + fate, seq, seq, ring.width_px, ring.height_px)

    try:
        async with pool() as ask:
            while not await ask(ticket(FINE)):
                pass

            async def timed(fate: int) -> float:
                began_s = time.perf_counter()
                while not await ask(ticket(fate)):
                    fate = FINE
                return (time.perf_counter() - began_s) * 1e3

            costs = sorted([await timed(FINE) for _ in range(pictures)])
            died = [await timed(DIES) for _ in range(deaths)]
            hung = [await timed(HANGS) - TIMEOUT_S * 1e3 for _ in range(deaths)]
    finally:
        ring.close()
    return {
        "picture_ms": statistics.median(costs),
        "picture_p99_ms": costs[int(0.99 * len(costs))],
        "after_death_ms": statistics.median(died),
        "after_hang_ms": statistics.median(hung),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n", maxsplit=1)[0])
    parser.add_argument("--pictures", type=int, default=1000)
    parser.add_argument("--deaths", type=int, default=10)
    options = parser.parse_args()
    for pool in (own, pebble, loky):
        try:
            found = asyncio.run(measure(pool, options.pictures, options.deaths))
        except ModuleNotFoundError as err:
            print(f"{err.name}: not installed")
            continue
        print(json.dumps({"pool": pool.__name__} | {key: round(value, 2) for key, value in found.items()}))


if __name__ == "__main__":
    main()
