"""The lamp beside the front camera: lit while shelves are looked at, and out whenever nobody says so."""

from __future__ import annotations

import asyncio
import contextlib
import select
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from flightd.core.errors import TransientError
from flightd.ports import Clock
from flightd.runtime.child_process import LinkedProcess
from flightd.runtime.message_channel import ChildEnd

LEDS = Path("/sys/class/leds")
_PERIOD_S = 0.1
_SILENT_NS = 500_000_000
"""A lamp that nobody wanted lit for so long goes out."""
_SILENT_S = 1.0
"""And so it does in its process, whatever became of the daemon."""
_AGAIN_S = 5.0
"""After a failure it is tried anew."""


class Switch(Protocol):
    """What a lamp hangs on."""

    async def switch(self, on: bool) -> None:
        """Raises TransientError where that fails."""
        ...

    def release(self) -> None:
        """Out, as the last thing; never blocks."""
        ...


class SwitchedLamp:
    """`ports.Lamp`.  A switch that fails is told to `on_trouble` once, and tried again every five seconds."""

    def __init__(
        self,
        clock: Clock,
        switch: Switch,
        on_trouble: Callable[[str], None],
        *,
        repeats: bool = False,
    ) -> None:
        """With `repeats` the switch is told ten times a second, else at changes."""
        self._clock = clock
        self._switch = switch
        self._on_trouble = on_trouble
        self._repeats = repeats
        self._wanted_ns: int | None = None
        self._told = False
        self._is_lit: bool | None = False
        """What it was switched to last; None: not known."""

    def shine(self, on: bool) -> None:
        """Light it, or not, for half a second."""
        self._wanted_ns = self._clock.now_ns() if on else None

    async def run(self) -> None:
        try:
            while True:
                wanted_ns, now_ns = self._wanted_ns, self._clock.now_ns()
                on = wanted_ns is not None and now_ns - wanted_ns <= _SILENT_NS
                changes = on is not self._is_lit
                await asyncio.sleep(await self._switched(on) if changes or self._repeats else _PERIOD_S)
        finally:
            self._switch.release()

    async def _switched(self, on: bool) -> float:
        """How long to wait after switching it."""
        try:
            await self._switch.switch(on)
        except TransientError as err:
            self._is_lit = None
            if not self._told:
                self._told = True
                self._on_trouble(f"front_camera.lamp: {err}")
            return _AGAIN_S
        self._is_lit = on
        return _PERIOD_S


class LedLamp:
    """Switches a LED of the kernel from a process of its own, which puts it out when the daemon dies."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._process: LinkedProcess | None = None
        self._problem = ""

    async def switch(self, on: bool) -> None:
        """Raises TransientError when it cannot be written."""
        if self._problem:
            self._process, problem, self._problem = None, self._problem, ""
            raise TransientError(problem)
        if self._process is None:
            self._process = LinkedProcess(keep_led, (LEDS / self._name,), self._fail, self._fail)
        self._process.send(on)

    def release(self) -> None:
        """Its process puts it out."""
        if self._process is not None:
            self._process.hang_up()

    def _fail(self, why: str) -> None:
        self._problem = self._problem or why


def keep_led(parent: ChildEnd, led: Path) -> None:
    """The process's life: the LED is as `parent` says, and out when that is silent or gone."""
    try:
        most = (led / "max_brightness").read_text(encoding="ascii").strip()
        try:
            while True:
                heard = parent.has_news() or select.select([parent], [], [], _SILENT_S)[0]
                _write(led, most if heard and parent.receive() else "0")
        finally:
            with contextlib.suppress(OSError):
                _write(led, "0")
    except OSError as err:
        with contextlib.suppress(OSError):
            parent.send(f"{led}: {err.strerror}")


def _write(led: Path, level: str) -> None:
    (led / "brightness").write_text(level, encoding="ascii")
