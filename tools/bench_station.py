"""What a crowd of browsers costs a flight, and what they see: a simulated flight by the clock, flown alone
and then with the ground station and its pages.

Some pages are stalled (they read nothing, and come again when the station has closed them), one comes
through a slow line.  Printed: the flight's intervals between setpoints, how old statuses and pictures are
when they reach a page, and the station's memory.

python -m tools.bench_station [--pages N] [--stalled N] [--kbit-s N] [--seed N] [--seconds S]
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import os
import statistics
import struct
import sys
import tempfile
import time
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.typing import Origin

ROOT = Path(__file__).parents[1]
_COMMAND = (sys.executable, "-m", "flightd")
_WANT = json.dumps(
    {"say": "want", "pictures": [{"drone": "drone", "camera": camera} for camera in ("down", "front")]}
)
_DRAWN = json.dumps({"say": "drawn"})
_CHUNK_BYTES = 4096
_SETTLED_S = 10.0
"""Before, the station still loads what it needs: its memory is compared from here on."""


@dataclass
class _Seen:
    """What one page was told."""

    status_ms: list[float] = field(default_factory=list)
    picture_ms: list[float] = field(default_factory=list)
    heard_bytes: int = 0
    closed: int = 0


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--pages", type=int, default=20, help="browsers, with those that are stalled")
    parser.add_argument("--stalled", type=int, default=5)
    parser.add_argument("--kbit-s", type=int, default=4000, help="of the slow line of one page")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--seconds", type=float, default=0.0, help="the pages stay for so long, beyond the flight; 0: for it"
    )
    options = parser.parse_args()
    print(json.dumps(asyncio.run(_measured(options)), indent=1))


async def _measured(options: argparse.Namespace) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        alone = await _flown(Path(folder) / "alone", options.seed)
        async with _station(Path(folder)) as (process, url):
            crowd = [_Seen() for _ in range(options.pages)]
            memory: list[float] = []
            async with asyncio.TaskGroup() as tasks, _slow_line(url, options.kbit_s) as slow_url:
                pages = [
                    *(tasks.create_task(_stall(url, seen)) for seen in crowd[: options.stalled]),
                    tasks.create_task(_watch(slow_url, url, crowd[options.stalled])),
                    *(tasks.create_task(_watch(url, url, seen)) for seen in crowd[options.stalled + 1 :]),
                    tasks.create_task(_weigh(process.pid, memory)),
                ]
                began_s = time.monotonic()
                watched = await _flown(Path(folder) / "watched", options.seed)
                await asyncio.sleep(max(began_s + options.seconds - time.monotonic(), 0.0))
                for page in pages:
                    page.cancel()
    quick = crowd[options.stalled + 1 :]
    settled = memory[round(_SETTLED_S) :] or memory
    return {
        "setpoint_interval_ms": {"alone": alone, "watched": watched},
        "status_age_ms": _quantiles([age for seen in quick for age in seen.status_ms]),
        "picture_age_ms": _quantiles([age for seen in quick for age in seen.picture_ms]),
        "slow_line": {
            "status_age_ms": _quantiles(crowd[options.stalled].status_ms),
            "picture_age_ms": _quantiles(crowd[options.stalled].picture_ms),
        },
        "stalled_pages_closed": sum(seen.closed for seen in crowd[: options.stalled]),
        "station_rss_mb": {"settled": settled[0], "most": max(settled), "end": settled[-1]},
        "watched_s": round(len(memory)),
    }


async def _flown(folder: Path, seed: int) -> dict[str, float]:
    """One flight by the clock: its intervals between setpoints, ms."""
    words = ("sim", "--speed", "1", "--seed", str(seed), "--out", str(folder), "--json")
    settings = ("ground.listen=127.0.0.1", "ground.picture_fps=5", "mission.autostart_countdown_s=2")
    arguments = [*words, *(word for setting in settings for word in ("--set", setting))]
    process = await asyncio.create_subprocess_exec(
        *_COMMAND, *arguments, stdout=asyncio.subprocess.PIPE, cwd=ROOT
    )
    out, _ = await process.communicate()
    return dict(json.loads(out)["setpoint_interval_ms"])


@contextlib.asynccontextmanager
async def _station(folder: Path) -> AsyncIterator[tuple[asyncio.subprocess.Process, str]]:
    """A station for the flight on this machine, and where its pages are."""
    arguments = ("ground", "--listen", "127.0.0.1:0", "--folder", str(folder), "--drone", "drone=127.0.0.1")
    process = await asyncio.create_subprocess_exec(
        *_COMMAND, *arguments, stdout=asyncio.subprocess.PIPE, cwd=ROOT
    )
    assert process.stdout is not None
    while "http://" not in (line := (await process.stdout.readline()).decode()):
        if not line:
            raise SystemExit("the station does not start")
    try:
        yield process, next(word for word in line.split() if word.startswith("http://")).rstrip("/.,;")
    finally:
        process.terminate()
        await process.wait()


@contextlib.asynccontextmanager
async def _page(url: str, origin: str, **options: Any) -> AsyncIterator[ClientConnection]:
    where = url.replace("http", "ws") + "/live"
    async with connect(where, origin=Origin(origin), proxy=None, max_size=None, **options) as socket:
        await socket.send(_WANT)
        yield socket


async def _watch(url: str, origin: str, seen: _Seen) -> None:
    """A page that draws whatever comes."""
    async with _page(url, origin, additional_headers={"Host": origin.removeprefix("http://")}) as page:
        async for said in page:
            seen.heard_bytes += len(said)
            if isinstance(said, bytes):
                (length,) = struct.unpack_from(">I", said)
                age_ms = json.loads(said[4 : 4 + length])["age_ms"]
                if age_ms is not None:
                    seen.picture_ms.append(age_ms)
                await page.send(_DRAWN)
            else:
                told = json.loads(said)
                if told["topic"] == "status":
                    seen.status_ms.append((time.monotonic_ns() - told["value"]["stamp_ns"]) * 1e-6)


async def _stall(url: str, seen: _Seen) -> None:
    """A page that reads nothing."""
    while True:
        with contextlib.suppress(ConnectionClosed, InvalidHandshake, OSError):
            async with _page(url, url, max_queue=1) as page:
                await page.wait_closed()
        seen.closed += 1


@contextlib.asynccontextmanager
async def _slow_line(url: str, kbit_s: int) -> AsyncIterator[str]:
    """A way to the station that carries so much, with little room in it."""
    port = int(url.rpartition(":")[2])

    async def carry(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, per_s: float) -> None:
        with contextlib.suppress(OSError):
            while data := await reader.read(_CHUNK_BYTES):
                writer.write(data)
                await writer.drain()
                await asyncio.sleep(len(data) / per_s)
            writer.close()

    async def accepted(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        up_reader, up_writer = await asyncio.open_connection("127.0.0.1", port, limit=_CHUNK_BYTES)
        per_s = kbit_s * 1000 / 8
        await asyncio.gather(carry(reader, up_writer, per_s), carry(up_reader, writer, per_s))

    server = await asyncio.start_server(accepted, "127.0.0.1", 0, limit=_CHUNK_BYTES)
    try:
        yield f"http://127.0.0.1:{server.sockets[0].getsockname()[1]}"
    finally:
        server.close()


async def _weigh(pid: int, memory: list[float]) -> None:
    """The process' memory once a second, MB."""
    while True:
        memory.append(_rss_mb(pid))
        await asyncio.sleep(1.0)


def _rss_mb(pid: int) -> float:
    pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
    return round(pages * os.sysconf("SC_PAGE_SIZE") / 1e6, 1)


def _quantiles(values: list[float]) -> dict[str, float]:
    if len(values) < 2:
        return {"of": len(values)}
    cuts = statistics.quantiles(values, n=100)
    return {
        "of": len(values),
        "p50": round(cuts[49], 1),
        "p99": round(cuts[98], 1),
        "max": round(max(values), 1),
    }


if __name__ == "__main__":
    main()
