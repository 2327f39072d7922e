"""Structured log lines: key=value with systemd's priority prefix, as the journal takes them from stderr.

Own code: structlog 26.1's logfmt lines cannot be read back (a line feed and the two characters `\\n` look the
same, an empty value has no quotes) and know no priority, for 0.6 MB and 0.1 s of import against ten lines.
"""

from __future__ import annotations

import json
import logging
import math
import os
import re
from typing import Protocol, TextIO

from flightd.core.snapshot import Snapshot
from flightd.core.types import Event, EventLevel

_PRIORITY = {EventLevel.INFO: 6, EventLevel.WARNING: 4, EventLevel.ERROR: 3}
_PLAIN = re.compile(r"[\w.,:/@%+-]+")
_STATUS_NS = 10_000_000_000


def goes_to_journal(stream: TextIO, journal_stream: str) -> bool:
    """Whether `stream` is the one that systemd tied to the journal; JOURNAL_STREAM holds device:inode."""
    try:
        found = os.fstat(stream.fileno())
    except (OSError, ValueError):
        return False
    return journal_stream == f"{found.st_dev}:{found.st_ino}"


def line(priority: int, **fields: object) -> str:
    """`<6>event=phase text="hover -> turn: dwelled"`: values in quotes where a reader could mistake them."""
    return f"<{priority}>" + " ".join(f"{key}={_value(value)}" for key, value in fields.items())


class Lines(Protocol):
    """What lines are written to; the control tick writes: it must not wait (`runtime.line_writer`)."""

    def write(self, text: str, /) -> int: ...

    def flush(self) -> None: ...


class JournalMonitor:
    """`ports.Monitor`: every event as a line, the status every ten seconds and at each change of phase."""

    def __init__(self, out: Lines) -> None:
        self._out = out
        self._said_ns = -(10**18)
        self._phase = ""

    def tell(self, snapshot: Snapshot) -> None:
        if snapshot.phase == self._phase and snapshot.stamp_ns - self._said_ns < _STATUS_NS:
            return
        self._phase, self._said_ns = snapshot.phase, snapshot.stamp_ns
        fields = {
            "status": snapshot.phase.value,
            "reason": snapshot.reason,
            "node": snapshot.node,
            "goal": snapshot.goal,
            "nodes": f"{snapshot.nodes_done}/{snapshot.nodes_planned}",
            "height_m": f"{snapshot.height_m:.2f}",
            "battery": "" if math.isnan(snapshot.battery_frac) else f"{snapshot.battery_frac:.2f}",
            "fps": f"{snapshot.fps:.0f}",
            "latency_ms": f"{snapshot.latency_ms.get('total', 0.0):.0f}",
            "dropped": sum(snapshot.dropped.values()),
        }
        self._write(line(6, **fields))

    def event(self, event: Event) -> None:
        self._write(line(_PRIORITY[event.level], event=event.name, text=event.text))

    def over(self) -> None:
        """The last change of phase has said so."""

    def _write(self, text: str) -> None:
        self._out.write(text + "\n")
        self._out.flush()


class JournalFormatter(logging.Formatter):
    """A logging record as such a line."""

    def format(self, record: logging.LogRecord) -> str:
        priority = 3 if record.levelno >= logging.ERROR else 4 if record.levelno >= logging.WARNING else 6
        text = record.getMessage()
        if record.exc_info:
            text = f"{text}\n{self.formatException(record.exc_info)}"
        return line(priority, logger=record.name.removeprefix("flightd."), text=text)


def _value(value: object) -> str:
    text = str(value)
    return text if _PLAIN.fullmatch(text) else json.dumps(text, ensure_ascii=False)
