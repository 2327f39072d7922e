"""A live view of a flight in the terminal: phase, node, battery, frame rate, latency."""

from __future__ import annotations

import contextlib
import sys
import threading
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from flightd.core.snapshot import Snapshot

_PLAIN_NS = 10_000_000_000
_CLOSE_S = 1.0


class FlightProgress:
    """Shows the newest snapshot it was called with: a bar on a terminal, a line now and then elsewhere.

    A thread of its own does, for a terminal may stand still (Ctrl-S) and a pipe may be full: whoever flies
    does not wait for that.
    """

    def __init__(self, shown: bool) -> None:
        self._shown = shown
        self._live = shown and sys.stderr.isatty()
        self._progress = Progress(
            TextColumn("{task.description:<9}"),
            BarColumn(bar_width=24),
            TextColumn("{task.completed:.0f}/{task.total:.0f} nodes  {task.fields[detail]}"),
            TimeElapsedColumn(),
            console=Console(stderr=True),
            disable=not self._live,
            auto_refresh=False,  # its thread would hold a lock while it writes
        )
        self._task: TaskID | None = None
        self._plain_ns = 0
        self._waits_for = ""
        self._newest: Snapshot | None = None
        self._came = threading.Event()
        self._over = False
        self._thread = threading.Thread(target=self._run, name="flight progress", daemon=True)

    def __enter__(self) -> Self:
        if self._shown:
            self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        if not self._shown:
            return
        self._over = True
        self._came.set()
        self._thread.join(_CLOSE_S)

    def __call__(self, snapshot: Snapshot) -> None:
        self._newest = snapshot
        self._came.set()

    def _run(self) -> None:
        with contextlib.suppress(OSError, ValueError), self._progress:  # nobody reads it any more
            self._show_newest()

    def _show_newest(self) -> None:
        shown: Snapshot | None = None
        while True:
            self._came.wait()
            self._came.clear()
            over, snapshot = self._over, self._newest
            if snapshot is not None and snapshot is not shown:
                shown = snapshot
                self._show(snapshot)
            if over:
                return

    def _show(self, snapshot: Snapshot) -> None:
        detail = (
            snapshot.reason
            if snapshot.waits
            else (
                f"at {snapshot.node or '-':<4} to {snapshot.goal:<4} {snapshot.height_m:4.1f} m  "
                f"battery {snapshot.battery_text:>4}  {snapshot.fps:3.0f} fps  "
                f"latency {snapshot.latency_ms.get('total', 0.0):3.0f} ms"
            )
        )
        if not self._live:
            anew = snapshot.waits and snapshot.reason != self._waits_for
            self._waits_for = snapshot.reason
            if anew or snapshot.stamp_ns - self._plain_ns >= _PLAIN_NS:
                self._plain_ns = snapshot.stamp_ns
                print(
                    f"{snapshot.phase:<9} {snapshot.nodes_done}/{snapshot.nodes_planned} nodes  {detail}",
                    file=sys.stderr,
                )
            return
        if self._task is None:
            self._task = self._progress.add_task("", total=max(snapshot.nodes_planned, 1), detail="")
        self._progress.update(
            self._task, completed=snapshot.nodes_done, description=snapshot.phase.value, detail=detail
        )
        self._progress.refresh()
