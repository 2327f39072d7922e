"""Mosquitto, on a free port of this machine, for as long as a test wants it."""

from __future__ import annotations

import asyncio
import contextlib
import os
import shutil
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from flightd.runtime.free_ports import free_port
from flightd.runtime.within import Within

_PROGRAM = shutil.which("mosquitto", path=os.environ.get("PATH", "") + os.pathsep + "/usr/sbin")
_BEGINS_S = 20.0
_LOOK_S = 0.02


class Mosquitto:
    """`kill` and `start` as often as it takes; what was retained is lost with it."""

    def __init__(self, folder: Path) -> None:
        if _PROGRAM is None:
            assert os.environ.get("CI", "") != "true", "CI has a broker: tools/test installs it"
            pytest.skip("mosquitto is not installed: sudo apt install mosquitto")
        self.port = free_port(socket.SOCK_STREAM)
        self._config = folder / "mosquitto.conf"
        self._config.write_text(f"listener {self.port} 127.0.0.1\nallow_anonymous true\npersistence false\n")
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def url(self) -> str:
        """For --mqtt."""
        return f"mqtt://127.0.0.1:{self.port}"

    def start(self) -> None:
        """Run; whoever connects tries until it listens, or waits by `listens`."""
        assert _PROGRAM is not None
        self._process = subprocess.Popen(
            [_PROGRAM, "-c", str(self._config)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )

    async def listens(self) -> None:
        """Wait until whoever connects is taken."""
        async with Within(_BEGINS_S):
            while True:
                with contextlib.suppress(OSError):
                    _, writer = await asyncio.open_connection("127.0.0.1", self.port)
                    writer.close()
                    with contextlib.suppress(ConnectionError):
                        await writer.wait_closed()
                    return
                await asyncio.sleep(_LOOK_S)

    def kill(self) -> None:
        """As a power cut would."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None


@contextlib.contextmanager
def mosquitto(folder: Path) -> Iterator[Mosquitto]:
    """A broker that runs meanwhile."""
    broker = Mosquitto(folder)
    broker.start()
    try:
        yield broker
    finally:
        broker.kill()
