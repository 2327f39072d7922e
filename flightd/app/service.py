"""What surrounds `flightd run` as a service: who watches it, and whether it was started anew by itself."""

from __future__ import annotations

import atexit
import logging
import sys
from collections.abc import AsyncIterator, Mapping
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path

from flightd.adapters.journal import JournalFormatter, JournalMonitor, goes_to_journal
from flightd.adapters.metrics.metrics import MetricsBook
from flightd.adapters.metrics.server import MetricsServer
from flightd.adapters.recent_log import RecentLog
from flightd.adapters.systemd import SystemdMonitor
from flightd.app.armed_mark import ArmedMark
from flightd.app.startup_faults import ON_GROUND, StartupFaults
from flightd.config.metrics import MetricsConfig
from flightd.ports import Monitor
from flightd.runtime.line_writer import LineWriter

_MARK = "started"


def set_up_log(environment: Mapping[str, str]) -> bool:
    """Send the program's own log lines to stderr without ever waiting for it; whether that is the journal,
    whose form they take then."""
    journal = goes_to_journal(sys.stderr, environment.get("JOURNAL_STREAM", ""))
    lines = LineWriter(sys.stderr)
    atexit.register(lines.close)
    handler = logging.StreamHandler(lines)
    if journal:
        handler.setFormatter(JournalFormatter())
    logging.basicConfig(level=logging.INFO if journal else logging.WARNING, handlers=[handler], force=True)
    return journal


def was_started_before(environment: Mapping[str, str]) -> bool:
    """Whether the service manager has started this service anew by itself.

    The mark lies in the service's run-time folder, which systemd keeps through its own restarts only
    (RuntimeDirectoryPreserve=restart) and removes when a person stops the service or the machine starts.
    """
    mark = _mark(environment)
    return mark is not None and mark.exists()


def note_start(environment: Mapping[str, str]) -> None:
    """Leave the mark for a restart to find.  A run-time folder that cannot be written leaves none."""
    mark = _mark(environment)
    if mark is not None:
        try:
            mark.touch()
        except OSError as err:
            logging.getLogger(__name__).warning(
                "%s: %s; a restart cannot be told from a start", mark, err.strerror
            )


def is_restarted(environment: Mapping[str, str]) -> bool:
    """Whether a service manager waits for this daemon, to start it anew when it ends."""
    return bool(environment.get("NOTIFY_SOCKET")) and _mark(environment) is not None


@asynccontextmanager
async def monitors(
    settings: MetricsConfig,
    environment: Mapping[str, str],
    *,
    journal: bool,
    recent: RecentLog | None = None,
    faults: StartupFaults = ON_GROUND,
) -> AsyncIterator[list[Monitor]]:
    """Who watches the daemon from this machine; `recent` hears of everything that is logged, too.  Where the
    metrics' port is taken, the `faults` do without them, or not."""
    found: list[Monitor] = []
    async with AsyncExitStack() as stack:
        if recent is not None:
            logging.getLogger().addHandler(recent)
            stack.callback(logging.getLogger().removeHandler, recent)
            found.append(recent)
        if journal:
            lines = LineWriter(sys.stderr)
            stack.callback(lines.close)
            found.append(JournalMonitor(lines))
        if (systemd := SystemdMonitor.of_environment(environment)) is not None:
            stack.callback(systemd.close)
            found.append(systemd)
        if (mark := ArmedMark.of_environment(environment)) is not None:
            found.append(mark)
        if settings.listen:
            book = MetricsBook()
            server = MetricsServer(settings.address, book.registry)
            with faults.tolerated():
                await server.open()
                stack.push_async_callback(server.close)
                found.append(book)
        yield found


def _mark(environment: Mapping[str, str]) -> Path | None:
    folder = environment.get("RUNTIME_DIRECTORY", "").split(":")[0]
    return Path(folder) / _MARK if folder else None
