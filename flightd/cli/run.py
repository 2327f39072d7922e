"""`flightd run`: the daemon."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, asynccontextmanager, nullcontext
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flightd.core.errors import InputError, RunError, TransientError

if TYPE_CHECKING:
    from flightd.adapters.recorder.archive import FlightArchive
    from flightd.adapters.recorder.recorder import McapRecorder
    from flightd.app.daemon import FlightResult
    from flightd.config.schema import Config
    from flightd.core.types import Status
    from flightd.site.site import Site

EXAMPLES = """Examples:

  flightd run --config /etc/flightd/flightd.toml
  flightd run --config configs/ardupilot.toml
  flightd run --config configs/ardupilot.toml --resume     after a battery swap that cut its power
"""


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("run", epilog=EXAMPLES)(run)


def run(
    config: Annotated[Path, typer.Option(help="Configuration file.")],
    resume: Annotated[
        bool,
        typer.Option("--resume", help="Fly the stops that the last flight left over (mission.progress)."),
    ] = False,
) -> None:
    """Fly the configured mission on a real vehicle, or on any peer that speaks like one.

    SIGINT and SIGTERM hand the vehicle back at once (exit 130 and 143).  Started while its vehicle flies,
    it keeps it level, reports, and lands.  Started anew by systemd it never starts a flight by itself.
    """
    from flightd.app import service
    from flightd.app.counting.flight_count import going_on
    from flightd.app.resume import resumed
    from flightd.cli.flight_progress import FlightProgress
    from flightd.config.schema import load_config
    from flightd.core.types import Phase
    from flightd.site.site_file import load_site

    chosen = load_config(config)
    if not chosen.mission.autostart and not chosen.ground.listen:
        raise InputError(
            f"config {config}: nobody can start this flight: set ground.listen so that flightctl can, or"
            " mission.autostart = true"
        )
    site = load_site(chosen.mission.site)
    chosen = resumed(chosen, config, site, ordered=resume)
    again = service.was_started_before(os.environ)
    chosen = going_on(chosen, site, chosen.inventory.folder, in_air=again)
    journal = service.logs_to_journal(os.environ)
    if again:
        chosen = chosen.model_copy(update={"mission": chosen.mission.model_copy(update={"autostart": False})})
    service.note_start(os.environ)
    with FlightProgress(shown=not journal) as progress:
        result = asyncio.run(_until_signal(chosen, site, progress, journal=journal, again=again))
    if isinstance(result, signal.Signals):
        print(f"flightd: stopped by {result.name}; the vehicle was handed back", file=sys.stderr)
        raise typer.Exit(128 + result)
    print(f"{result.reason}; {len(result.visited)} of {result.planned} nodes visited", file=sys.stderr)
    if result.phase is not Phase.DONE:
        raise RunError(f"mission {result.phase}: {result.reason}")


async def _until_signal(
    config: Config, site: Site, observer: Callable[[Status], None], *, journal: bool, again: bool
) -> FlightResult | signal.Signals:
    """The flight's result, or the signal that ended it."""
    flight = asyncio.ensure_future(_fly(config, site, observer, journal=journal, again=again))
    loop = asyncio.get_running_loop()
    came: list[signal.Signals] = []

    def end(number: signal.Signals) -> None:
        came.append(number)
        flight.cancel()

    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, end, number)
    await asyncio.wait([flight])
    return came[0] if flight.cancelled() and came else flight.result()


async def _fly(
    config: Config, site: Site, observer: Callable[[Status], None], *, journal: bool, again: bool
) -> FlightResult:
    """`again`: the daemon was started before, and its vehicle may be in the air."""
    from flightd.adapters.store.progress import ProgressFile
    from flightd.app.build import detector_pool, ground_link
    from flightd.app.counting.flight_count import FlightCount
    from flightd.app.daemon import Daemon
    from flightd.app.service import monitors
    from flightd.runtime.clock import LoopClock

    clock = LoopClock()
    async with monitors(config.metrics, os.environ, journal=journal) as watchers, AsyncExitStack() as stack:
        count = FlightCount(config, site, config.inventory.folder, stack, in_air=again)
        pool = stack.enter_context(detector_pool(config, site, clock))
        recorder, archive = _black_box(config, site, clock.now_ns()) or (None, None)
        if recorder is not None:
            stack.enter_context(recorder)
        counting = await count.begun(clock)
        ground = stack.enter_context(ground_link(config, site, clock, counting) or nullcontext())
        await pool.ready()
        kept = config.mission.progress
        progress = None if kept is None else ProgressFile(kept, site.name)
        daemon = Daemon(
            config, site, clock, pool, recorder, [observer], ground, watchers, progress, counting, count.error
        )
        async with kept_room(archive, daemon.failed):
            return await daemon.fly()


@asynccontextmanager
async def kept_room(
    archive: FlightArchive | None, failed: Callable[[TransientError], None]
) -> AsyncIterator[None]:
    """Keep room for the flight's log meanwhile; whatever goes wrong with that is told to `failed` at once
    and never ends the flight."""
    from flightd.runtime.supervisor import restarted

    if archive is None:
        yield
        return

    def ended(task: asyncio.Future[None]) -> None:
        if not task.cancelled() and (err := task.exception()) is not None:
            failed(TransientError(f"the archive of flights is not looked after any more: {err!r}"))

    keeping = asyncio.ensure_future(restarted(archive.run, failed))
    keeping.add_done_callback(ended)
    try:
        yield
    finally:
        keeping.cancel()
        await asyncio.wait([keeping])


def _black_box(config: Config, site: Site, now_ns: int) -> tuple[McapRecorder, FlightArchive] | None:
    """The recorder of this flight and the archive of all, if the configuration wants them."""
    from flightd.adapters.recorder.archive import FlightArchive
    from flightd.adapters.recorder.recorder import McapRecorder
    from flightd.core.topics import Document, Topic
    from flightd.site.site_file import site_toml

    settings = config.recorder
    if settings.folder is None:
        return None
    archive = FlightArchive(settings.folder, round(settings.quota_gb * 1e9), round(settings.reserve_gb * 1e9))
    started = datetime.now(UTC)
    metadata = {"started": f"{started:%Y-%m-%d %H:%M:%S} UTC", "vehicle": config.vehicle.kind}
    recorder = McapRecorder(archive.begin(started), metadata=metadata)
    recorder.record(Topic.MAP, now_ns, Document(site_toml(site)))
    recorder.record(Topic.CONFIG, now_ns, Document(config.model_dump_json(indent=1)))
    return recorder, archive
