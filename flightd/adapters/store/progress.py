"""Which stops of a plan are still to be made, in a small file that survives a power cut.

A companion computer that is fed by the flight battery loses its power when that is changed; what the file
says is flown on the next start when it is asked to.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import threading
from dataclasses import asdict, dataclass
from pathlib import Path

from flightd.core.errors import InputError, TransientError
from flightd.runtime.durable_files import replace_file
from flightd.runtime.latest_slot import Latest
from flightd.site.site import Site


@dataclass(frozen=True, slots=True)
class LeftOver:
    """The stops still to be made, in order, and the node and heading on which the drone stands for them."""

    remaining: tuple[str, ...]
    stand: str
    yaw_rad: float


class NothingLeftError(InputError):
    """No stop was left over."""


def load_left_over(path: Path, site: Site) -> LeftOver:
    """What is left over on `site`.  InputError when the file is another's, NothingLeftError without stops."""
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
        name = told["site"]
        left = LeftOver(tuple(map(str, told["remaining"])), str(told["stand"]), float(told["yaw_rad"]))
    except OSError as err:
        raise NothingLeftError(f"{path}: {err.strerror}; there is nothing to resume") from None
    except (ValueError, KeyError, TypeError):
        raise InputError(f"{path}: not a progress file; delete it and start without --resume") from None
    if name != site.name or not {*left.remaining, left.stand} <= site.nodes.keys():
        raise InputError(f"{path}: progress on site {name}, not on {site.name}; start without --resume")
    if not left.remaining:
        raise NothingLeftError(f"{path}: every stop was made; start without --resume")
    return left


class ProgressFile:
    """Keeps the file: `put` from the tick, `run` beside it.  What is put last is what is written."""

    def __init__(self, path: Path, site: str) -> None:
        self._path = path
        self._site = site
        self._changed: Latest[bool] = Latest()
        self._writing = threading.Lock()
        self._put: LeftOver | None = None
        self._written: LeftOver | None = None

    def put(self, left: LeftOver) -> None:
        """What is left now; cheap when nothing has changed."""
        if left != self._put:
            self._put = left
            self._changed.put(True)

    async def run(self) -> None:
        """Write each change until cancelled, the last one too.  TransientError when the disk refuses."""
        try:
            while True:
                await self._changed.get()
                await asyncio.to_thread(self._write)
        except asyncio.CancelledError:
            with contextlib.suppress(TransientError):  # ending comes before saving what a disk refuses
                self._write()
            raise

    def _write(self) -> None:
        """Bring the file up to what was put last, whoever comes last."""
        with self._writing:
            left = self._put
            if left is not None and left != self._written:
                self._replace(left)
                self._written = left

    def _replace(self, left: LeftOver) -> None:
        text = json.dumps({"site": self._site, **asdict(left)}, ensure_ascii=False)
        beside = self._path.with_suffix(self._path.suffix + ".new")
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            replace_file(self._path, beside, f"{text}\n".encode())
        except OSError as err:
            raise TransientError(f"progress {self._path}: {err.strerror or err}") from err
