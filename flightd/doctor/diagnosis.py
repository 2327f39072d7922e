"""Everything that is looked at before a flight, in one go.  Nothing moves."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from flightd.adapters.vehicle.ardrone.vehicle import ArDroneVehicle
from flightd.adapters.vehicle.connect import connect_vehicle
from flightd.adapters.vehicle.mavlink.examination import ExaminationReport
from flightd.adapters.vehicle.mavlink.parameter_rule import ParameterFinding
from flightd.config.schema import Config
from flightd.doctor import camera, vehicle
from flightd.doctor.check import Check, CheckLevel, ok, warning
from flightd.doctor.computer import check_computer, check_set_up
from flightd.doctor.delay import check_delay
from flightd.doctor.exposure import Seen, check_exposure, check_front_exposure
from flightd.doctor.ground import GroundListener, check_ground
from flightd.doctor.latency import (
    Stages,
    delay_as_measured,
    delay_before_a_flight,
    judge_latency,
    measure_stages,
    with_latency,
)
from flightd.doctor.vehicle import Autopilot
from flightd.ports import Clock
from flightd.site.site import Site
from flightd.vision.line_detector import Detector


@dataclass(frozen=True, slots=True)
class Subject:
    """What is examined, composed as for a flight: `path` is the configuration's file, `nodes` so many are
    planned, `ground` the link that would listen (None: none is configured).  Whoever composes it has found
    configuration and site sound."""

    config: Config
    site: Site
    path: Path
    nodes: int
    detector: Detector
    ground: GroundListener | None
    clock: Clock


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """Everything that was looked at; `report` and `fixed` are those of a MAVLink autopilot, `stages` what was
    measured of the way from exposure to setpoint."""

    checks: Sequence[Check]
    report: ExaminationReport | None = None
    fixed: tuple[str, ...] = ()
    stages: Stages | None = None

    @property
    def errors(self) -> int:
        """How many checks say that it is not fit to fly."""
        return sum(check.level is CheckLevel.ERROR for check in self.checks)

    @property
    def mendable(self) -> list[ParameterFinding]:
        """The wrong parameters for which a better value is known; none while the vehicle is armed."""
        if self.report is None or self.report.armed:
            return []
        return [found for found in self.report.findings if found.better is not None]

    def document(self, path: Path) -> dict[str, Any]:
        """As JSON has it; `path` is the configuration's file."""
        report = self.report
        return {
            "config": str(path),
            "fit": self.errors == 0,
            "checks": [asdict(check) for check in self.checks],
            "autopilot": report
            and {
                "firmware": report.firmware.name.lower(),
                "version": report.version,
                "armed": report.armed,
                "unread": report.unread,
            },
            "parameters": [asdict(finding) for finding in report.findings] if report else [],
            "fixed": self.fixed,
        }


async def examine(subject: Subject) -> Diagnosis:
    """Computer, cameras, ground link and vehicle: some ten seconds.  InputError for wrong addresses, keys."""
    config = subject.config
    checks = [_configured(subject), *check_computer(config, subject.site)]
    autopilot = Autopilot(())
    watching_front = camera.watch_front(config, subject.clock)  # beside the other, as in flight
    if config.vehicle.kind == "ardrone":
        (found, pictures), front = await asyncio.gather(
            _examine_ardrone(config, subject.clock), watching_front
        )
        checks += found
    else:
        pictures, front = await asyncio.gather(camera.watch(config.camera, subject.clock), watching_front)
        autopilot = await vehicle.examine(config.vehicle, config.battery, subject.clock)
    checks += check_ground(config.ground, subject.ground)
    checks += camera.judge_camera(config, pictures)
    if pictures.rate_hz:
        checks += check_exposure(config, Seen(pictures.exposure, pictures.series, pictures.rate_hz))
    checks += camera.check_vision(config, subject.detector, pictures.picture)
    stages = measure_stages(config, subject.detector, pictures)
    if stages is not None:
        checks.append(judge_latency(config, stages, delay_before_a_flight(config)))
    if front is not None:
        checks.append(camera.judge_front_camera(config, subject.site, front))
        checks += check_front_exposure(config, front.exposure) if front.rate_hz else []
    return Diagnosis([*checks, *autopilot.checks], autopilot.report, stages=stages)


async def examine_quickly(subject: Subject) -> Diagnosis:
    """What can be known without waiting for anything."""
    config = subject.config
    here = check_set_up(config, subject.site)
    return Diagnosis([_configured(subject), *here, *check_ground(config.ground, subject.ground)])


async def measure_delay(
    found: Diagnosis, subject: Subject, seconds: float, say: Callable[[str], None]
) -> Diagnosis:
    """The diagnosis with the camera's delay as a person's rocking tells it; `say` hears what he is to do.
    Nothing is measured of a vehicle that is armed, or does not answer."""
    about = [check for check in found.checks if check.name in {"vehicle", "camera"}]
    if any(check.level is CheckLevel.ERROR for check in about):
        skipped = warning("delay", "not measured: see the lines of camera and vehicle", "mend those first")
        return replace(found, checks=[*found.checks, skipped])
    config = subject.config
    check, told = await check_delay(config, subject.clock, subject.detector, seconds, say)
    checks = list(found.checks)
    if told is not None and found.stages is not None:
        latency = judge_latency(config, found.stages, delay_as_measured(config, told))
        checks = with_latency(checks, latency)
    return replace(found, checks=[*checks, check])


async def fix_parameters(found: Diagnosis, config: Config, agreed: Sequence[str], clock: Clock) -> Diagnosis:
    """Write the better values of the parameters `agreed` on by name; the diagnosis with what is known now."""
    autopilot = await vehicle.examine(config.vehicle, config.battery, clock, agreed)
    anew = {"parameter", *(check.name for check in autopilot.checks)}
    rest = [check for check in found.checks if check.name not in anew]
    return Diagnosis([*rest, *autopilot.checks], autopilot.report, autopilot.fixed)


def _configured(subject: Subject) -> Check:
    height_m = subject.config.mission.height_m
    text = f"{subject.path}: site {subject.site.name}, {subject.nodes} nodes to visit at {height_m:g} m"
    return ok("config", text)


async def _examine_ardrone(config: Config, clock: Clock) -> tuple[list[Check], camera.Pictures]:
    """An AR.Drone is asked while its adapter runs: its camera comes over the same link."""
    drone = connect_vehicle(config.vehicle, clock, config.control)
    assert isinstance(drone, ArDroneVehicle)
    flying = asyncio.ensure_future(drone.run())
    try:
        checks = await vehicle.examine_ardrone(drone, config)
        return checks, await camera.watch(config.camera, clock, drone)
    finally:
        flying.cancel()
        await asyncio.wait([flying])
