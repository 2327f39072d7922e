"""What the doctor finds while the daemon runs, which has the camera, the vehicle and the ports for itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flightd.adapters.vehicle.mavlink.parameter_rule import ParameterFinding
from flightd.config.schema import Config
from flightd.core.exposure import ExposureState
from flightd.core.types import VehicleState
from flightd.doctor.check import Check, CheckLevel, error, ok, unseen, warning
from flightd.doctor.exposure import Seen, check_exposure, check_front_exposure
from flightd.doctor.pose import check_pose

_OLD_S = 3.0
_SLOW = 0.85
_ALONE = "stop the daemon and run flightd doctor on the drone"


@dataclass(frozen=True, slots=True)
class Running:
    """What the running daemon knows: its vehicle (None: not heard), the age of its newest heartbeat, the
    down camera's pictures per second and how they are exposed, how the front camera was read back (None: not
    at all), the autopilot's findings (None: not read yet, or no such autopilot) and firmware, and the
    configuration's file."""

    file: str
    vehicle: VehicleState | None
    heartbeat_age_s: float
    pictures_hz: float
    findings: Sequence[ParameterFinding] | None
    firmware: str
    is_mavlink: bool
    exposure: Seen
    front_exposure: ExposureState | None = None


def judge_running(config: Config, found: Running) -> list[Check]:
    """Vehicle, parameters and camera as the daemon has them, then what only works without it."""
    return [
        ok("config", found.file),
        _vehicle(config, found),
        *(check_pose(config.vehicle, found.vehicle.pose_use) if found.vehicle is not None else []),
        *_parameters(found),
        _camera(config, found),
        *(check_exposure(config, found.exposure) if found.pictures_hz else []),
        *check_front_exposure(config, found.front_exposure),
        ok("ground", "this station was answered"),
        *_left_out(found),
    ]


def _vehicle(config: Config, found: Running) -> Check:
    state, url = found.vehicle, config.vehicle.url
    if state is None:
        remedy = "check vehicle.url, cable (TX to RX), baud rate and power"
        return error("vehicle", f"{config.vehicle.kind} is not heard at {url}", remedy)
    if found.heartbeat_age_s > _OLD_S:
        text = f"{config.vehicle.kind} at {url} has been silent for {found.heartbeat_age_s:.0f} s"
        return error("vehicle", text, "check its power and cable")
    if state.unfit is not None and not found.findings:  # those are told one by one
        return error("vehicle", str(state.unfit), "see the autopilot's own checks")
    text = f"{config.vehicle.kind} {found.firmware}".strip() + f" answers at {url}, mode {state.mode}"
    return ok("vehicle", text)


def _parameters(found: Running) -> list[Check]:
    if not found.is_mavlink:
        return []
    if found.findings is None:
        return [
            warning("parameter", "not all of the autopilot's parameters were read yet", "look again soon")
        ]
    if not found.findings:
        return [ok("parameter", "all that were read fit the job")]
    return [
        Check(
            "parameter",
            CheckLevel.WARNING if finding.advised else CheckLevel.ERROR,
            str(finding),
            "choose it yourself, in the autopilot's own ground station"
            if finding.better is None
            else f"set {finding.name} to {finding.better:g}",
            "" if finding.better is None else finding.name,
        )
        for finding in found.findings
    ]


def _camera(config: Config, found: Running) -> Check:
    camera, hz = config.camera, found.pictures_hz
    text = f"{camera.url}: {camera.width_px}x{camera.height_px} px, {hz:.1f} pictures a second"
    if hz == 0.0:
        remedy = "check camera.url, cable, rights (group video) and who else uses it"
        return error("camera", f"{camera.url}: no picture comes", remedy)
    if hz < _SLOW * camera.fps:
        remedy = f"camera.fps is {camera.fps:g}: more light, another size or format, or correct the key"
        return warning("camera", text, remedy)
    return ok("camera", text)


def _left_out(found: Running) -> list[Check]:
    """What nobody can look at while the daemon has it."""
    left = [
        unseen("camera", "opening the camera, and the detector's speed on its pictures", _ALONE),
        unseen("delay", "the camera's delay, measured by rocking the drone", f"{_ALONE} with --rock"),
        unseen("ground", "whether its ports are free: this link has them", _ALONE),
    ]
    if found.is_mavlink:
        text = "the rate of heartbeats when asked for, range finders that are not flown by, battery cells"
        left.append(unseen("vehicle", text, _ALONE))
    return left
