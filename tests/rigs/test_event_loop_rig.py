"""What an asynchronous test leaves behind fails it."""

from __future__ import annotations

import asyncio
import socket
import subprocess
import sys
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import pytest

from tests.rigs.event_loops import in_real_time, real, virtual

ROOT = Path(__file__).parents[2]
Run = Callable[[Coroutine[Any, Any, None]], None]

both = pytest.mark.parametrize("run", [real, virtual])


@both
def test_a_task_left_behind_fails(run: Run) -> None:
    kept = []

    async def main() -> None:
        kept.append(asyncio.create_task(asyncio.sleep(100.0), name="forgotten"))

    with pytest.raises(AssertionError, match=r"tasks left behind.*forgotten"):
        run(main())


@both
def test_a_task_cancelled_and_not_awaited_fails(run: Run) -> None:
    async def main() -> None:
        running = asyncio.create_task(asyncio.sleep(100.0))
        await asyncio.sleep(0)
        running.cancel()

    with pytest.raises(AssertionError, match="tasks left behind"):
        run(main())


@both
def test_a_transport_just_closed_is_no_fault(run: Run) -> None:
    async def main() -> None:
        loop = asyncio.get_running_loop()
        transport, _ = await loop.create_datagram_endpoint(
            asyncio.DatagramProtocol, local_addr=("127.0.0.1", 0)
        )
        transport.close()

    run(main())


@both
def test_what_the_loop_still_watches_fails(run: Run) -> None:
    async def main(ours: socket.socket) -> None:
        asyncio.get_running_loop().add_reader(ours, print)

    theirs, ours = socket.socketpair()
    with theirs, ours, pytest.raises(AssertionError, match="transports left open"):
        run(main(ours))


@both
def test_an_exception_nobody_heard_of_fails(run: Run) -> None:
    async def main() -> None:
        asyncio.get_running_loop().call_soon(lambda: 1 // 0)
        await asyncio.sleep(0.01)

    with pytest.raises(AssertionError, match=r"nobody heard of.*ZeroDivisionError"):
        run(main())


def test_the_result_and_the_failure_are_those_of_the_test() -> None:
    async def main() -> int:
        return 7

    @in_real_time
    async def failing(number: int) -> None:
        raise ValueError(number)

    assert virtual(main()) == 7
    with pytest.raises(ValueError, match="8"):
        failing(8)


CARELESS = """
import asyncio, pytest
from tests.rigs.event_loops import virtual

async def work(): ...

def test_not_awaited():
    async def main():
        work()
    virtual(main())

class Broken:
    def __del__(self): raise ValueError("broken")

def test_unraisable():
    Broken()

def test_thread():
    import threading
    thread = threading.Thread(target=lambda: 1 // 0)
    thread.start()
    thread.join()

def test_unclosed():
    import socket
    socket.socket()

def test_open_transport():
    async def main():
        loop = asyncio.get_running_loop()
        await loop.create_datagram_endpoint(asyncio.DatagramProtocol, local_addr=("127.0.0.1", 0))
    virtual(main())

def test_careful():
    virtual(work())
"""


def test_what_python_only_warns_of_fails_too(tmp_path: Path) -> None:
    """By the configuration of this project."""
    file = tmp_path / "test_careless.py"
    file.write_text(CARELESS)
    command = [sys.executable, "-m", "pytest", "-c", str(ROOT / "pyproject.toml"), "-rfp", str(file)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    failed = {
        line.split("::")[1].split()[0] for line in done.stdout.splitlines() if line.startswith("FAILED")
    }
    assert "test_careful" not in failed
    assert len(failed) == CARELESS.count("def test_") - 1, done.stdout
