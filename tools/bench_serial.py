"""What reading a busy serial line costs: the transport's own reader and pyserial-asyncio-fast's, on a pseudo
terminal that brings telemetry at 500 frames a second (as an autopilot's at 921600 baud).

Printed: the processor time of a second of it, and how often the loop was woken.
Needs `pip install pyserial-asyncio-fast`; without it, only the own reader is timed.

python tools/bench_serial.py [--seconds S]
"""

from __future__ import annotations

import argparse
import asyncio
import json
import multiprocessing
import os
import pty
import time
from collections.abc import Callable
from importlib import import_module
from typing import Any

from flightd.adapters.vehicle.mavlink.link.endpoint import parse_endpoint
from flightd.adapters.vehicle.mavlink.link.transport import make_transport

FRAME_BYTES = 40
FRAMES_PER_S = 500
BAUD = 921600


def autopilot(line: int, seconds: float) -> None:
    """Write frames at an even rate, then one byte that ends it."""
    began_s = time.perf_counter()
    for number in range(round(seconds * FRAMES_PER_S)):
        os.write(line, b"\xfd" * FRAME_BYTES)
        time.sleep(max(0.0, began_s + number / FRAMES_PER_S - time.perf_counter()))
    os.write(line, b"\x00")


async def own(device: str, take: Callable[[bytes], None], done: asyncio.Event) -> None:
    transport = make_transport(parse_endpoint(f"serial://{device}:{BAUD}"))
    transport.received = lambda data, _source: take(data)
    await transport.open()
    await done.wait()
    transport.close()


async def pyserial(device: str, take: Callable[[bytes], None], done: asyncio.Event) -> None:
    class Protocol(asyncio.Protocol):
        def data_received(self, data: bytes) -> None:
            take(data)

    library: Any = import_module("serial_asyncio_fast")
    loop = asyncio.get_running_loop()
    transport, _ = await library.create_serial_connection(loop, Protocol, device, baudrate=BAUD)
    await done.wait()
    transport.close()


async def measure(reader: Any, seconds: float) -> dict[str, float]:
    line, other = pty.openpty()
    device = os.ttyname(other)
    done = asyncio.Event()
    wakes = taken = 0

    def take(data: bytes) -> None:
        nonlocal wakes, taken
        wakes, taken = wakes + 1, taken + len(data)
        if data.endswith(b"\x00"):
            done.set()

    reading = asyncio.create_task(reader(device, take, done))
    await asyncio.sleep(0.5)
    if reading.done():
        await reading
    writer = multiprocessing.get_context("fork").Process(target=autopilot, args=(line, seconds))
    writer.start()
    began_s = time.process_time()
    await reading
    used_s = time.process_time() - began_s
    writer.join()
    os.close(line)
    os.close(other)
    return {
        "cpu_ms_per_s": round(used_s / seconds * 1e3, 2),
        "wakes_per_s": round(wakes / seconds, 1),
        "bytes_per_s": round(taken / seconds),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n", maxsplit=1)[0])
    parser.add_argument("--seconds", type=float, default=5.0)
    options = parser.parse_args()
    for reader in (own, pyserial):
        try:
            print(json.dumps({"reader": reader.__name__} | asyncio.run(measure(reader, options.seconds))))
        except ModuleNotFoundError as err:
            print(f"{err.name}: not installed")


if __name__ == "__main__":
    main()
