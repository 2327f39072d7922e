"""What a crowd on the ground link costs the flight: a 50 Hz tick beside the link, alone and under attack.

Subscribers, a flood of junk on the command port and connections with wrong keys come from a process of
their own.  Printed: how late the ticks were, how long a stop took from the client's call to the tick
that takes it, the daemon's processor share and its memory.

python tools/bench_ground.py [--seconds S] [--clients N] [--junk PER_S]
"""

from __future__ import annotations

import argparse
import asyncio
import json
import multiprocessing
import os
import random
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

import zmq
import zmq.asyncio

from flightd.adapters.ground_link.client import Address, GroundClient
from flightd.adapters.ground_link.keys import load_pair, load_public, make_keys
from flightd.adapters.ground_link.link import ZmqGround
from flightd.config.ground import GroundConfig
from flightd.core.errors import FlightdError
from flightd.core.snapshot import Snapshot
from flightd.core.tick import TickInput, TickOutput
from flightd.core.types import CommandKind, Demand, Phase
from flightd.runtime.clock import LoopClock
from flightd.site.site_file import load_site

ROOT = Path(__file__).parents[1]
TICK_S = 0.02


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--clients", type=int, default=100)
    parser.add_argument("--junk", type=int, default=1000, help="junk requests and wrong keys per second")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        rows = asyncio.run(_measure(Path(folder), options.seconds, options.clients, options.junk))
    print(json.dumps(rows, indent=1))


async def _measure(folder: Path, seconds: float, clients: int, junk: int) -> dict[str, Any]:
    for name in ("daemon", "ann", "stranger"):
        make_keys(folder, name)
    (folder / "clients").write_text(f"operator {load_public(folder / 'ann.key')} ann\n")
    config = GroundConfig(
        listen="0.0.0.0",  # noqa: S104 - what is measured is the guarded link
        status_port=0,
        command_port=0,
        server_key=folder / "daemon.key_secret",
        clients=folder / "clients",
        audit=folder / "audit.jsonl",
    )
    site = load_site(ROOT / "configs" / "site-demo.toml")
    rows: dict[str, Any] = {}
    with ZmqGround(config, site, LoopClock()) as link:
        ports = [int(endpoint.rpartition(":")[2]) for endpoint in link.endpoints]
        address = Address(
            "127.0.0.1",
            ports[0],
            ports[1],
            load_pair(folder / "ann.key_secret"),
            load_public(folder / "daemon.key"),
        )
        async with asyncio.TaskGroup() as tasks:
            serving = tasks.create_task(link.run())
            rows["alone"] = await _fly(link, address, seconds)
            context = multiprocessing.get_context("spawn")
            crowd = context.Process(target=_crowd, args=(folder, ports, clients, junk), daemon=True)
            crowd.start()
            await asyncio.sleep(4.0)
            rows["crowd"] = await _fly(link, address, seconds)
            crowd.kill()
            crowd.join()
            serving.cancel()
    return rows


async def _fly(link: ZmqGround, address: Address, seconds: float) -> dict[str, Any]:
    """The daemon's part: ticks, statuses, and stops now and then by a client in the same loop."""
    late_ms: list[float] = []
    taken: dict[str, float] = {}
    loop = asyncio.get_running_loop()
    processor_s, started_s = time.process_time(), loop.time()
    status: Any = None

    async def tick() -> None:
        nonlocal status
        due_s = loop.time()
        for count in range(round(seconds / TICK_S)):
            due_s += TICK_S
            await asyncio.sleep(due_s - loop.time())
            late_ms.append((loop.time() - due_s) * 1e3)
            taken.update({command.id: loop.time() for command in link.take_commands()})
            if count % 5 == 0:
                status = _tell(link)

    stops_ms: list[float] = []
    async with GroundClient(address, timeout_s=10.0) as client, asyncio.TaskGroup() as tasks:
        ticking = tasks.create_task(tick())
        while not ticking.done():
            order_id = os.urandom(8).hex()
            asked_s = loop.time()
            try:
                await client.order(CommandKind.STOP, order_id=order_id)
            except FlightdError as err:
                print(f"no stop: {err}")
            await asyncio.sleep(0.1 + 0.05 * random.random())
            if order_id in taken:
                stops_ms.append((taken[order_id] - asked_s) * 1e3)
    spent_s = time.process_time() - processor_s
    return {
        "ticks_late_ms": _quantiles(late_ms),
        "stop_to_tick_ms": _quantiles(stops_ms),
        "stops": len(stops_ms),
        "processor_share": round(spent_s / (loop.time() - started_s), 3),
        "rss_mb": round(_rss_mb(), 1),
        "link": {key: getattr(status.link, key) for key in ("requests", "refused", "denied", "dropped")},
    }


def _tell(link: ZmqGround) -> Any:
    now_ns = LoopClock().now_ns()
    output = TickOutput(None, Demand.FLY, Phase.FOLLOW, "", "A2", 0, 2, None, None)
    link.tell(Snapshot(TickInput(now_ns), output, frames=1, fps=30.0))
    return link._handler.status  # noqa: SLF001 - the counters as they were just published


def _crowd(folder: Path, ports: list[int], clients: int, junk: int) -> None:
    """In a process of its own: subscribers, junk from one with a right key, and wrong keys."""
    with zmq.Context(io_threads=1) as context:
        context.set(zmq.MAX_SOCKETS, 4096)
        server = load_public(folder / "daemon.key").encode()

        def connected(kind: int, key: str, port: int) -> Any:
            pair, socket = load_pair(folder / f"{key}.key_secret"), context.socket(kind)
            socket.linger = 0
            socket.curve_publickey, socket.curve_secretkey = pair.public.encode(), pair.secret.encode()
            socket.curve_serverkey = server
            socket.connect(f"tcp://127.0.0.1:{port}")
            return socket

        subscribers = [connected(zmq.SUB, "ann", ports[0]) for _ in range(clients)]
        for socket in subscribers:
            socket.subscribe(b"")
        flood = connected(zmq.DEALER, "ann", ports[1])
        count = 0
        while True:
            for _ in range(max(junk // 100, 1)):
                flood.send(os.urandom(40))
                count += 1
            if count % 100 < 10:
                connected(zmq.DEALER, "stranger", ports[1]).close()
            while flood.poll(0):
                flood.recv_multipart()
            for socket in subscribers:
                while socket.poll(0):
                    socket.recv_multipart()
            time.sleep(0.01)


def _quantiles(values: list[float]) -> dict[str, float]:
    cuts = statistics.quantiles(values, n=100)
    return {"p50": round(cuts[49], 2), "p99": round(cuts[98], 2), "max": round(max(values), 2)}


def _rss_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


if __name__ == "__main__":
    main()
