"""A flight of a real vehicle, as `flightd run` flies it: everything opened, built, flown and closed again."""

from __future__ import annotations

import asyncio
import gc
import logging
import os
import platform
import signal
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from flightd.adapters.ground_link.camera_optics import camera_optics
from flightd.adapters.ground_link.link import ZmqGround
from flightd.adapters.recent_log import RecentLog
from flightd.adapters.recorder.archive import FlightArchive
from flightd.adapters.recorder.recorder import McapRecorder
from flightd.adapters.store.learnt_sensors import load_learnt
from flightd.adapters.store.settings_file import SettingsFile
from flightd.app import service
from flightd.app.absent_parts import NO_GROUND, NO_RECORDER
from flightd.app.build import build, detector_pool, ground_link
from flightd.app.computer_check import ComputerCheck
from flightd.app.counting.count import Counting
from flightd.app.counting.flight_count import FlightCount
from flightd.app.daemon import Daemon, FlightResult
from flightd.app.flight_identity import FlightIdentity
from flightd.app.flight_orders import configured_order, going_on, resumed
from flightd.app.maintenance.checks import DroneChecks
from flightd.app.maintenance.maintainer import DroneMaintainer
from flightd.app.maintenance.settings import DroneSettings
from flightd.app.recording import FlightSetting, record_setting
from flightd.app.startup_faults import StartupFaults
from flightd.config.ground import GroundConfig
from flightd.config.schema import Config
from flightd.core.errors import InputError, TransientError
from flightd.core.learnt import LearntSensors
from flightd.core.snapshot import Snapshot
from flightd.doctor.check import CheckLevel
from flightd.doctor.computer import check_fitness, check_machine
from flightd.ports import Ground, Recorder
from flightd.runtime.clock import LoopClock
from flightd.runtime.datagrams import open_paced_datagrams
from flightd.runtime.disk_threads import on_disk
from flightd.runtime.ending_signals import end_on_signals
from flightd.runtime.supervisor import restarted
from flightd.site.site_file import load_site

_LOG = logging.getLogger(__name__)
_COME_UP_S = 15.0
"""A daemon that has run for so long has come up: nothing of its settings ends it."""


@dataclass(frozen=True, slots=True)
class Run:
    """What is to be flown.  `started_anew`: the service manager started the daemon again by itself, so that
    its vehicle may be in the air; `journal`: stderr goes to the journal; `file` is the configuration's, with
    the text that it was started by."""

    setting: FlightSetting
    file: SettingsFile
    text: str
    started_anew: bool = False
    journal: bool = False
    taken_back: str = ""
    """Which newer settings were given up before this start; empty: none."""


def prepare(config: Config, path: Path, *, resume: bool, taken_back: str = "") -> Run:
    """What to fly by the configuration of the file `path`; `resume`: what the last flight left over;
    `taken_back` says that newer settings were given up.
    InputError where nobody could start the flight, or where there is nothing left to fly."""
    if not config.mission.autostart and not config.ground.listen:
        raise InputError(
            f"config {path}: nobody can start this flight: set ground.listen so that flightctl can, or"
            " mission.autostart = true"
        )
    site = load_site(config.mission.site)
    anew = service.was_started_before(os.environ)
    order = resumed(configured_order(config), config, path, site, wanted=resume, in_air=anew)
    order = going_on(order, config.inventory.run, site, config.inventory.folder, in_air=anew)
    if anew:  # it looks after what flies, and never starts a flight by itself
        order = replace(order, autostart=False)
    journal = service.set_up_log(os.environ)
    service.note_start(os.environ)
    file = SettingsFile(path)
    setting = FlightSetting(config, site, order, _learnt(config, in_air=anew))
    return Run(setting, file, file.read(), anew, journal, taken_back)


def _learnt(config: Config, *, in_air: bool) -> LearntSensors | None:
    """What earlier flights have learnt of the sensors.  InputError for a file that is none, but not where
    the vehicle may be `in_air`."""
    kept = config.tracking.learnt
    if kept is None:
        return None
    try:
        return load_learnt(kept, config)
    except InputError as err:
        if not in_air:
            raise
        _LOG.warning("%s", err)
        return None


@dataclass(frozen=True, slots=True)
class RestartAsked:
    """The ground asked for the daemon to be started anew."""


async def run_until_signal(
    run: Run, observer: Callable[[Snapshot], None]
) -> FlightResult | RestartAsked | signal.Signals:
    """The flight's result, what ended it before it began, or the signal that ended it."""
    flight = asyncio.ensure_future(_fly(run, observer))
    came: list[signal.Signals] = []
    end_on_signals(flight, came)
    await asyncio.wait([flight])
    return came[0] if flight.cancelled() and came else flight.result()


async def _fly(run: Run, observer: Callable[[Snapshot], None]) -> FlightResult | RestartAsked:
    config, site, clock = run.setting.config, run.setting.site, LoopClock()
    recent, restarts = RecentLog(), service.is_restarted(os.environ)
    faults = StartupFaults(in_air=run.started_anew)
    watchers = service.monitors(config.metrics, os.environ, journal=run.journal, recent=recent, faults=faults)
    checks = DroneChecks(config, site, f"{run.file.path}, site {site.name}", recent)
    maintainer = DroneMaintainer(
        checks,
        DroneSettings(run.file, run.text, restarts=restarts, unfit=partial(_failing, config)),
        restarts=restarts,
    )
    identity = FlightIdentity.of(run.setting, platform.node(), clock.now_ns())
    async with watchers as monitors, AsyncExitStack() as stack:
        count = FlightCount(config, site, config.inventory.folder, stack, run=identity.run, faults=faults)
        checks.newest_ns = count.newest_ns
        pool = stack.enter_context(detector_pool(config, site, clock))
        archive = _archive(config)
        recorder: Recorder = NO_RECORDER
        counting: Counting | None = None
        if archive is not None:
            with faults.tolerated():
                recorder = stack.enter_context(_recorder(run.setting, archive, identity))
        with faults.tolerated():
            counting = await count.begun(clock)
        link = partial(
            ground_link,
            site=site,
            clock=clock,
            counting=counting,
            maintainer=maintainer,
            optics=camera_optics(config),
        )
        ground = _ground(config.ground, link, stack, faults)
        with faults.tolerated():  # it levels and lands without seeing, and new detectors are tried
            await pool.ready()
        flight = build(
            config,
            site,
            run.setting.order,
            clock=clock,
            detectors=pool,
            recorder=recorder,
            ground=ground,
            counting=counting,
            monitors=monitors,
            observers=[observer],
            learnt=run.setting.learnt,
            keep_files=True,
            opener=open_paced_datagrams,
            startup_fault=faults.first,
            fitness=ComputerCheck(partial(check_fitness, config, site, count.newest_ns)),
        )
        daemon, maintainer.flight = Daemon(flight), flight
        if run.taken_back:
            daemon.failed(TransientError(run.taken_back))
        async with room_kept(archive, daemon.failed):
            return await flown(daemon, maintainer, run.file)


async def flown(
    daemon: Daemon, maintainer: DroneMaintainer, file: SettingsFile
) -> FlightResult | RestartAsked:
    """The flight, unless the ground has the daemon started anew before it begins."""
    # What start-up made stays to the end: a full collection that walked it again in flight held the control
    # tick up for 60 to 90 ms.
    gc.collect()
    gc.freeze()
    settled = asyncio.ensure_future(_settled(file))
    flying = asyncio.ensure_future(daemon.fly())
    leaving = asyncio.ensure_future(maintainer.restart_asked())
    came_up = False
    try:
        await asyncio.wait([flying, leaving], return_when=asyncio.FIRST_COMPLETED)
    except asyncio.CancelledError:  # a signal: it ends as it should
        came_up = True
        raise
    else:
        result = flying.result() if flying.done() else RestartAsked()
        came_up = True
        return result
    finally:
        for task in (settled, leaving, flying):
            task.cancel()
        await asyncio.wait([flying, leaving, settled])
        if came_up:  # only now: the vehicle was handed back, and the disk may take its time
            await _confirmed(file)


async def _settled(file: SettingsFile) -> None:
    """Once the daemon has run for a while its settings are no trial any more."""
    await asyncio.sleep(_COME_UP_S)
    await _confirmed(file)


async def _confirmed(file: SettingsFile) -> None:
    """Where the disk does not answer its settings stay on trial."""
    with suppress(TransientError):
        await on_disk(file.confirm)


def _failing(config: Config) -> set[str]:
    """The names of the checks of this computer that fail now.  Blocks for the disk."""
    return {check.name for check in check_machine(config) if check.level is CheckLevel.ERROR}


@asynccontextmanager
async def room_kept(
    archive: FlightArchive | None, failed: Callable[[TransientError], None]
) -> AsyncIterator[None]:
    """Keep room for the flight's log meanwhile; whatever goes wrong with that is told to `failed` at once
    and never ends the flight."""
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


def _archive(config: Config) -> FlightArchive | None:
    """All recorded flights, where they are recorded."""
    settings = config.recorder
    if settings.folder is None:
        return None
    return FlightArchive(settings.folder, round(settings.quota_gb * 1e9), round(settings.reserve_gb * 1e9))


def _ground(
    settings: GroundConfig,
    link_of: Callable[[GroundConfig], ZmqGround | None],
    stack: AsyncExitStack,
    faults: StartupFaults,
) -> Ground:
    """The link to ground stations, listening.  In the air one that nobody writes down is better than none."""
    tried = [settings]
    if settings.audit is not None:
        tried.append(settings.model_copy(update={"audit": None}))
    for one in tried:
        with faults.tolerated():
            link = link_of(one)
            return NO_GROUND if link is None else stack.enter_context(link)
    return NO_GROUND


def _recorder(setting: FlightSetting, archive: FlightArchive, identity: FlightIdentity) -> McapRecorder:
    """The recorder of this flight, with what it is flown by."""
    recorder = McapRecorder(archive.begin(identity.started), metadata=identity.metadata())
    record_setting(recorder, identity.clock_ns, setting)
    return recorder
