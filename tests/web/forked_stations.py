"""Starts `flightd ground` for the tests of the page: each a process of its own, forked from one that has read
the code.  Reading it costs more than all that most tests ask of their station.

As a person starts it, it is started in `test_ground_command.py`."""

from __future__ import annotations

import atexit
import gc
import json
import os
import signal
import socket
import subprocess
import sys
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TextIO

_ROOT = Path(__file__).parents[2]
_READ_BEFORE = (
    "flightd.cli.main",
    "flightd.ground.server",
    "flightd.ground.access.access",
    "flightd.ground.drone_names",
    "flightd.ground.tls",
)
_MOST_BYTES = 1 << 16


class ForkedStation:
    """One that runs; it writes to `stderr`."""

    def __init__(self, forge: socket.socket, words: list[str]) -> None:
        ours, theirs = os.pipe()
        self.stderr: TextIO = os.fdopen(ours, encoding="utf-8")
        self._forge = forge
        try:
            asked = json.dumps({"words": words, "environment": dict(os.environ)}).encode()
            socket.send_fds(forge, [asked], [theirs])
        finally:
            os.close(theirs)
        self.pid: int = json.loads(forge.recv(_MOST_BYTES))

    def terminate(self) -> None:
        """As its service manager does."""
        os.kill(self.pid, signal.SIGTERM)

    def wait(self, within_s: float) -> int:
        """Its exit code once it has ended."""
        self._forge.settimeout(within_s)
        self._forge.send(json.dumps({"ended": self.pid}).encode())
        code: int = json.loads(self._forge.recv(_MOST_BYTES))
        self._forge.settimeout(None)
        return code


def forked_station(words: list[str]) -> ForkedStation:
    """`flightd ground` with these words."""
    return ForkedStation(_forge(), words)


@cache
def _forge() -> socket.socket:
    """The way to the process that all stations of this one are forked from."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with theirs:
        command = [sys.executable, "-m", "tests.web.forked_stations", str(theirs.fileno())]
        null = subprocess.DEVNULL
        process = subprocess.Popen(command, cwd=_ROOT, pass_fds=[theirs.fileno()], stdin=null, stdout=null)

    def end() -> None:
        ours.close()
        process.wait(20)

    atexit.register(end)
    return ours


def _fork_stations(tests: socket.socket) -> list[str] | None:
    """Until the tests end: None.  In a station that was forked: its words."""
    for module in _READ_BEFORE:
        import_module(module)
    gc.freeze()
    while True:
        asked, descriptors, _, _ = socket.recv_fds(tests, _MOST_BYTES, 1)
        if not asked:
            return None
        said = json.loads(asked)
        if "ended" in said:
            code = os.waitstatus_to_exitcode(os.waitpid(said["ended"], 0)[1])
            tests.send(json.dumps(code).encode())
        elif pid := os.fork():
            os.close(descriptors[0])
            tests.send(json.dumps(pid).encode())
        else:
            tests.close()
            os.dup2(descriptors[0], 2)
            os.close(descriptors[0])
            os.environ.clear()
            os.environ.update(said["environment"])
            return [str(word) for word in said["words"]]


if __name__ == "__main__":
    given = _fork_stations(socket.socket(fileno=int(sys.argv[1])))
    if given is not None:
        from flightd.cli.main import main

        sys.argv = ["flightd", "ground", *given]
        main()
