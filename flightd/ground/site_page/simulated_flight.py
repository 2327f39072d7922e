"""Flies a site of the station in the simulator: a child process with a ground link of its own, and meanwhile
a drone more of the station."""

from __future__ import annotations

import asyncio
import contextlib
import os
import re
import signal
import socket
import sys
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Protocol

import msgspec

from flightd.adapters.ground_link.client import Address
from flightd.core.errors import RunError, UnavailableError
from flightd.ground.shown_text import shown
from flightd.runtime.free_ports import free_ports
from flightd.runtime.within import Within

SIMULATOR: tuple[str, ...] = (sys.executable, "-m", "flightd", "sim", "--speed", "1")
"""What is started: by the clock, since in lockstep a drone has no ground link."""
FOLDER = "simulated"
"""Below the station's folder: a folder for each flight, with its log and its stock."""
TOPIC = "simulation"
_NAME = "simulation"
_LOG = "simulation.log"
_AT = "%Y-%m-%dT%H-%M-%SZ"
_LOOK_S = 1.0
_END_S = 10.0
"""So long it has to write what was flown, once it is told to end."""
_KILLED_S = 2.0
_TAIL_BYTES, _LINE_CHARS = 2048, 300


class Drones(Protocol):
    """The hub, as far as a simulated drone needs it."""

    def free_name(self, name: str) -> str:
        """The name, or one like it where a drone has it already."""
        ...

    def joined(self, name: str, address: Address) -> AbstractAsyncContextManager[None]:
        """A drone more, meanwhile."""
        ...

    def tell(self, drone: str, topic: str, value: Any) -> None:
        """Tell every page a topic's newest value."""
        ...


class SimulationTold(msgspec.Struct, frozen=True):
    """What the pages are told of it: `drone` is empty when none flies, `site` before the first.  `last` is
    the newest line that it said; `good` is None until it has ended."""

    admins_only: bool
    site: str = ""
    drone: str = ""
    folder: str = ""
    last: str = ""
    good: bool | None = None


@dataclass(frozen=True, slots=True)
class _Wanted:
    site: str
    file: Path
    out: Path
    log: Path


class _Summary(msgspec.Struct, frozen=True):
    mission: str
    reason: str


class SimulatedFlight:
    """One at a time.  `run` flies what `start` asks for until cancelled, which ends what flies then."""

    def __init__(self, drones: Drones, folder: Path, admins_only: bool) -> None:
        self.admins_only = admins_only
        self._drones = drones
        self._folder = folder.absolute()
        self._asked: asyncio.Queue[_Wanted] = asyncio.Queue(maxsize=1)
        self._process: asyncio.subprocess.Process | None = None
        self._told = SimulationTold(admins_only)
        self._busy = self._ends = False
        self._tell()

    def start(self, site: str, file: Path) -> str:
        """Fly the site file under that name soon; the folder of its log and stock, below the station's.
        RunError while one flies, UnavailableError where the folder cannot be made."""
        if self._busy:
            raise RunError(f"{self._told.site} is flown already", remedy="end that flight first")
        name = re.sub(r"[^\w.-]+", "-", file.stem)[:60] or "site"
        out = self._folder / FOLDER / f"{datetime.now(UTC).strftime(_AT)}-{name}"
        try:
            out.mkdir(parents=True)
            log = out / _LOG
            log.touch()
        except OSError as err:
            raise UnavailableError(
                f"{out.name} cannot be made: {err.strerror or err}",
                remedy="give the station the right to its folder",
            ) from None
        self._busy = True
        below = f"{FOLDER}/{out.name}"
        self._told = SimulationTold(self.admins_only, site, self._drones.free_name(_NAME), below)
        self._asked.put_nowait(_Wanted(site, file.absolute(), out, log))
        self._tell()
        return below

    def end(self) -> None:
        """End the one that flies, in order; asked again, at once.  RunError where none does."""
        if self._process is None or self._process.returncode is not None:
            raise RunError("no simulated flight is under way")
        if self._ends:
            self._process.terminate()
        else:
            self._end_in_order(self._process)

    def _end_in_order(self, process: asyncio.subprocess.Process) -> None:
        """Once: a second signal would end it at once."""
        if not self._ends and process.returncode is None:
            self._ends = True
            process.terminate()

    async def run(self) -> None:
        """Serve until cancelled."""
        while True:
            wanted = await self._asked.get()
            good, last = False, ""
            try:
                good = await self._flown(wanted)
                last = await asyncio.to_thread(_outcome if good else _last_line, wanted.log)
            except OSError as err:
                last = f"it cannot be started: {err.strerror or err}"
            finally:
                self._busy, self._ends, self._process = False, False, None
            self._told = msgspec.structs.replace(self._told, drone="", last=last, good=good)
            self._tell()

    async def _flown(self, wanted: _Wanted) -> bool:
        """Whether the simulator calls it good, once it has ended."""
        status, command = free_ports(2, socket.SOCK_STREAM)
        settings = (
            "ground.listen=127.0.0.1", f"ground.status_port={status}", f"ground.command_port={command}",
        )  # fmt: skip
        words = [*SIMULATOR, "--warehouse", str(wanted.file), "--out", str(wanted.out)]
        words += [word for setting in settings for word in ("--set", setting)]
        with wanted.log.open("wb") as log:
            self._process = process = await asyncio.create_subprocess_exec(
                *words,
                cwd=wanted.out,
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.DEVNULL,  # a table for a terminal
                stderr=log,
                start_new_session=True,  # Ctrl-C at the station's terminal comes by the station
            )
        try:
            async with self._drones.joined(self._told.drone, Address("127.0.0.1", status, command)):
                while not await _is_over(process, _LOOK_S):
                    last = await asyncio.to_thread(_last_line, wanted.log)
                    if last != self._told.last:
                        self._told = msgspec.structs.replace(self._told, last=last)
                        self._tell()
        finally:
            self._end_in_order(process)
            await _ended(process)
        return process.returncode == 0

    def _tell(self) -> None:
        self._drones.tell("", TOPIC, self._told)


async def _is_over(process: asyncio.subprocess.Process, within_s: float) -> bool:
    with contextlib.suppress(TimeoutError):
        async with Within(within_s):
            await process.wait()
    return process.returncode is not None


async def _ended(process: asyncio.subprocess.Process) -> None:
    """Let it end, and kill it with all that it started where it does not."""
    try:
        await _is_over(process, _END_S)
    finally:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)  # its world and detectors, should it have left them
    await _is_over(process, _KILLED_S)


def _outcome(log: Path) -> str:
    """How a flight that the simulator calls good ended."""
    try:
        summary = msgspec.json.decode(log.with_name("summary.json").read_bytes(), type=_Summary)
    except (OSError, msgspec.MsgspecError):
        return _last_line(log)
    return shown(f"{summary.mission}: {summary.reason}"[:_LINE_CHARS])


def _last_line(log: Path) -> str:
    """The newest line that is not empty, for people."""
    try:
        with log.open("rb") as file:
            file.seek(max(file.seek(0, os.SEEK_END) - _TAIL_BYTES, 0))
            lines = file.read(_TAIL_BYTES).decode(errors="replace").splitlines()
    except OSError:
        return ""
    said = [line.strip() for line in lines if line.strip()]
    return shown(said[-1][:_LINE_CHARS]).removeprefix("flightd: ") if said else ""
