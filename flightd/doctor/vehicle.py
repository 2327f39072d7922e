"""The vehicle: does it answer, is it what the configuration says, is it set up for this job?"""

from __future__ import annotations

import asyncio
from collections.abc import Collection
from dataclasses import dataclass

from flightd.adapters.vehicle.ardrone.configurator import COM_WATCHDOG_S
from flightd.adapters.vehicle.ardrone.refusal import KeepsValue, NotConfigured
from flightd.adapters.vehicle.ardrone.vehicle import ArDroneVehicle
from flightd.adapters.vehicle.connect import signing_of
from flightd.adapters.vehicle.mavlink.examination import Examination, ExaminationReport
from flightd.adapters.vehicle.mavlink.link.connection import Firmware
from flightd.adapters.vehicle.mavlink.required_parameters import FIRMWARES, Job
from flightd.adapters.vehicle.mavlink.services.heartbeat_rate import too_slow
from flightd.config.battery import BatteryConfig
from flightd.config.schema import Config
from flightd.config.vehicle import VehicleConfig
from flightd.core.errors import UnavailableError
from flightd.doctor.check import Check, error, ok, warning
from flightd.doctor.pose import check_pose
from flightd.ports import Clock

_NAMES = {Firmware.ARDUPILOT: "ArduCopter", Firmware.PX4: "PX4"}
_CABLE = "check vehicle.url, cable (TX to RX), baud rate and power; is another flightd running?"
_KEY = "; does the autopilot have the same signing key?"
_BEATS = "grant SET_MESSAGE_INTERVAL of HEARTBEAT (newer firmware), or a faster line; else warn the pilot"
_LEAST_MAX_M = 0.35
"""A take-off by a height that does not follow is ended after 0.4 m of climb."""
_POLL_S = 0.1
_PATIENCE_S = 8.0
_SETTINGS_S = 30.0
"""An AR.Drone takes one value after the other, and a change of profiles takes seconds."""


@dataclass(frozen=True, slots=True)
class Autopilot:
    """What was read of an autopilot; None when it could not be read.  `fixed` are the parameters that
    were written and read back."""

    checks: tuple[Check, ...]
    report: ExaminationReport | None = None
    fixed: tuple[str, ...] = ()


async def examine(
    config: VehicleConfig, battery: BatteryConfig, clock: Clock, agreed: Collection[str] = ()
) -> Autopilot:
    """Read and judge the parameters, after writing the better values of those `agreed` on by name.

    InputError for a wrong address or signing key."""
    signing = signing_of(config, clock)
    job = Job.of(config, battery)
    examination = Examination(config.url, clock, config.system_id, signing, job)
    try:
        async with examination.connected():
            report = await examination.report()
            wanted = [found for found in report.findings if found.name in agreed]
            if not wanted:
                return Autopilot(tuple(judge(config, report, battery.cells)), report)
            left = {found.name for found in await examination.fix(wanted)}
            fixed = tuple(found.name for found in wanted if found.name not in left)
            report = await examination.report()
            return Autopilot(
                (*judge(config, report, battery.cells), *_after_fix(fixed, sorted(left))), report, fixed
            )
    except UnavailableError as err:
        return Autopilot((error("vehicle", str(err), _CABLE + (_KEY if signing else "")),))


def judge(config: VehicleConfig, report: ExaminationReport, cells: int | None = None) -> list[Check]:
    """Kind and state of the autopilot and its sensors, then a line for each parameter that is wrong."""
    name = _NAMES[report.firmware]
    text = f"{name} {report.version}".strip() + f" answers at {config.url}"
    checks = []
    if FIRMWARES[config.kind] is not report.firmware:
        remedy = f'set vehicle.kind = "{report.firmware.name.lower()}"'
        if report.firmware is Firmware.ARDUPILOT:
            remedy = 'set vehicle.kind = "ardupilot"'
        checks.append(error("vehicle", f"{text}; the configuration says {config.kind}", remedy))
    elif report.armed:
        checks.append(error("vehicle", f"{text}; it is armed", "disarm it: nothing is changed while it is"))
    else:
        checks.append(ok("vehicle", text))
    slow = too_slow(report.heartbeat_hz)
    if slow is not None:
        checks.append(warning("heartbeat", str(slow), _BEATS))
    else:
        checks.append(ok("heartbeat", f"{report.heartbeat_hz:.0f} heartbeats a second"))
    checks += [
        _judge_range(config, report),
        _judge_cells(cells, report),
        *check_pose(config, report.pose_use),
    ]
    for found in report.findings:
        remedy = (
            "choose it yourself, in a ground station"
            if found.better is None
            else f"--fix sets {found.better:g}"
        )
        level = warning if found.advised else error
        checks.append(level("parameter", str(found), remedy))
    return checks


def _judge_range(config: VehicleConfig, report: ExaminationReport) -> Check:
    """The range finder that is flown by, as the vehicle stands."""
    name, heard = "range finder", {sample.sensor: sample for sample in report.range_finders}
    wanted = config.range_finder
    if not heard or (wanted is not None and wanted not in heard):
        text = "none that looks down is heard" if wanted is None else f"{wanted} is not heard"
        return warning(name, text, "see its wiring, type and orientation; nothing flies without a height")
    chosen = max(heard.values(), key=lambda sample: (sample.measures, sample.quality_pc or 0))
    chosen = chosen if wanted is None else heard[wanted]
    if chosen.is_below and chosen.least_m > _LEAST_MAX_M:
        text = f"it stands lower than its range finder's minimum of {chosen.least_m:g} m"
        return error(name, text, f"mount it higher, or take one that measures from {_LEAST_MAX_M:g} m on")
    if len(heard) > 1 and wanted is None:
        ids = ", ".join(str(sensor) for sensor in heard)
        text = f"{len(heard)} look down (ids {ids}); by what they measure now {chosen.sensor} is flown by"
        return warning(name, text, "name one as vehicle.range_finder")
    if chosen.is_below:
        return ok(name, f"on the floor, lower than {chosen.least_m:g} m: it measures from there on")
    return ok(name, f"{chosen.distance_m:.2f} m as it stands")


def _judge_cells(cells: int | None, report: ExaminationReport) -> Check:
    told = report.cells
    if cells is None and not told:
        return error("battery", "how many cells it has is not known: nothing starts", "give battery.cells")
    if cells is not None and told and cells != told:
        text = f"battery.cells = {cells}, the autopilot tells of {told}"
        return error("battery", text, "one of them is wrong, and with it every low voltage")
    return ok("battery", f"{cells or told} cells")


def _after_fix(fixed: tuple[str, ...], left: list[str]) -> list[Check]:
    checks = []
    if fixed:
        text = f"{', '.join(fixed)} set and read back"
        checks.append(warning("fix", text, "reboot the autopilot, some act only then; run doctor again"))
    if left:
        checks.append(error("fix", f"{', '.join(left)} did not stay as set", "set it in a ground station"))
    return checks


async def examine_ardrone(vehicle: ArDroneVehicle, config: Config) -> list[Check]:
    """Wait until the running adapter hears the drone; its battery and whether it refuses to fly."""
    url = config.vehicle.url
    for _ in range(round(_PATIENCE_S / _POLL_S)):
        state = vehicle.state()
        if state is not None:
            break
        await asyncio.sleep(_POLL_S)
    else:
        remedy = "join its wireless network; only one client at a time can fly it"
        return [error("vehicle", f"{url}: no navdata in {_PATIENCE_S:g} s", remedy)]
    checks = []
    if state.mode == "emergency":
        text = f"{url}: {state.refusal or 'emergency'}"
        checks.append(error("vehicle", text, "look at propellers and attitude, then press its reset button"))
    elif state.armed:
        checks.append(error("vehicle", f"{url}: the drone is flying", "land it"))
    else:
        checks.append(ok("vehicle", f"AR.Drone answers at {url}, {state.mode}"))
    checks.append(await _judge_settings(vehicle))
    least = config.mission.battery_start
    text = f"{state.battery_frac:.0%} charged, {least:.0%} are needed to start (mission.battery_start)"
    if state.battery_frac < least:
        checks.append(error("battery", text, "charge it"))
    else:
        checks.append(ok("battery", text))
    return checks


async def _judge_settings(vehicle: ArDroneVehicle) -> Check:
    """Whether the drone took what it must not be flown without: its way down when nobody is heard is among
    it."""
    name = "settings"
    for _ in range(round(_SETTINGS_S / _POLL_S)):
        state = vehicle.state()
        unfit = None if state is None else state.unfit
        if state is not None and not isinstance(unfit, NotConfigured):
            break
        await asyncio.sleep(_POLL_S)
    else:
        return error(name, f"not taken within {_SETTINGS_S:g} s", "switch the drone off and on")
    if isinstance(unfit, KeepsValue):
        return error(name, str(unfit), "close any other app that flies it, switch it off and on")
    return ok(name, f"taken; it lands by itself {COM_WATCHDOG_S} s after this computer falls silent")
