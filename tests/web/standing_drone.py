"""A drone that stands on its pad and waits: `flightd run` as its service manager runs it, beside a simulated
vehicle, in a thread of its own beside the browser."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.rigs.event_loops import real
from tests.rigs.service import SITE_FILE, ServiceRig

_READY_S = 90.0


class StandingDrone:
    """Its configuration's file and its ports; a parameter of its autopilot is wrong."""

    def __init__(self, folder: Path) -> None:
        self.rig = ServiceRig(folder, ("A2",), fps=5.0)
        self.config = self.rig.config
        (folder / SITE_FILE.name).write_text(SITE_FILE.read_text())
        text = self.config.read_text().replace("autostart = true", "autostart = false  # by a person")
        text = text.replace(str(SITE_FILE), SITE_FILE.name)
        self.config.write_text(text.replace("[ground]", f'[ground]\naudit = "{folder / "audit.jsonl"}"'))
        self._ready, self._ending, self._over = threading.Event(), threading.Event(), threading.Event()
        self._code: int | None = None
        self._thread = threading.Thread(target=lambda: real(self._stand()), name="drone", daemon=True)

    @property
    def at(self) -> str:
        """As `flightd ground --drone` takes it."""
        address = self.rig.address
        return f"demo=127.0.0.1:{address.status_port}/{address.command_port}"

    @contextmanager
    def standing(self) -> Iterator[StandingDrone]:
        """It stands there meanwhile."""
        self._thread.start()
        try:
            assert self._ready.wait(_READY_S), (self.rig.folder / "stderr").read_text()
            yield self
        finally:
            self._ending.set()
            self._thread.join(60)
            assert not self._thread.is_alive()

    def ended(self) -> int | None:
        """How its daemon ended, once it has; None: not in time."""
        self._over.wait(_READY_S)
        return self._code

    async def _stand(self) -> None:
        async with self.rig.world(GUID_TIMEOUT=3.0):
            process = await self.rig.start()
            await self.rig.until(lambda status: status.vehicle is not None)
            self._ready.set()
            while not self._ending.is_set():
                await asyncio.sleep(0.05)
                if process.returncode is not None:
                    self._code = process.returncode
                    self._over.set()
            if process.returncode is None:
                process.terminate()
                await process.wait()
