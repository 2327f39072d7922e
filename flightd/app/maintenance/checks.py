"""Doctor's report beside the running daemon, and the parameters that it sets right."""

from __future__ import annotations

from flightd.adapters.ground_link.messages.maintenance import CheckReport, DoctorAnswer, ExposureReport
from flightd.adapters.recent_log import RecentLog
from flightd.adapters.vehicle.mavlink.vehicle import MavlinkVehicle
from flightd.app.flight import Flight
from flightd.config.camera import CameraConfig
from flightd.config.exposure_keys import can_be_told, cannot_be_told
from flightd.config.front_camera import FrontCameraConfig
from flightd.config.schema import Config
from flightd.core.errors import InputError, RunError
from flightd.core.exposure import ExposureState
from flightd.core.preview import CameraName
from flightd.core.versions import versions_of
from flightd.doctor.beside_daemon import Running, judge_running
from flightd.doctor.check import Check, CheckLevel
from flightd.doctor.computer import check_computer
from flightd.doctor.exposure import Seen, blur_px
from flightd.ports import Camera, TellsExposure
from flightd.runtime.disk_threads import on_disk
from flightd.site.site import Site

_WATCH_S = 1.0
_LIBRARIES = (
    "numpy", "opencv-python-headless", "opencv-python", "pymavlink", "pyzmq", "pydantic", "msgspec", "mcap",
    "zxing-cpp",
)  # fmt: skip


class DroneChecks:
    """What the drone finds of itself; `file` is where its configuration stands, in words."""

    def __init__(self, config: Config, site: Site, file: str, log: RecentLog) -> None:
        self._config = config
        self._site = site
        self._file = file
        self._log = log
        self.newest_ns = 0
        """UTC of the newest look that the inventory had before this flight; 0 without one."""

    async def report(self, request_id: str, flight: Flight, outcome: str = "") -> DoctorAnswer:
        """Look at everything: about a second."""
        here = await on_disk(check_computer, self._config, self._site, self.newest_ns)
        found = await self._running(flight)
        checks = [*here, *judge_running(self._config, found)]
        return DoctorAnswer(
            request=request_id,
            fit=not any(check.level is CheckLevel.ERROR for check in checks),
            checks=tuple(_reported(check) for check in checks),
            versions=await on_disk(self._versions, found.firmware),
            log=self._log.lines,
            outcome=outcome,
            exposures=exposure_reports(self._config, found.exposure.state, found.front_exposure),
        )

    async def fix(self, name: str, flight: Flight) -> str:
        """Write the better value of a parameter and read it back; what was done.  InputError where there is
        nothing to set right, RunError where it did not stay as written."""
        vehicle = flight.vehicle
        if not isinstance(vehicle, MavlinkVehicle):
            raise InputError(f"a vehicle of kind {self._config.vehicle.kind} has no parameters to set right")
        finding = next((one for one in vehicle.findings() if one.name == name), None)
        if finding is None or finding.better is None:
            raise InputError(f"there is nothing to set right at {name}")
        if not await vehicle.set_right(finding):
            raise RunError(
                f"{name} did not stay as set",
                remedy="is it armed?  Else set it in the autopilot's own ground station",
            )
        return f"{name} was {finding.value:g}, now reads {finding.better:g}"

    async def _running(self, flight: Flight) -> Running:
        clock, vehicle = flight.clock, flight.vehicle
        began_ns, before = clock.now_ns(), flight.camera.frames
        series = await flight.down_frames.brightness(_WATCH_S)
        now_ns, state = clock.now_ns(), vehicle.state()
        autopilot = vehicle if isinstance(vehicle, MavlinkVehicle) else None
        pictures_hz = (flight.camera.frames - before) * 1e9 / max(now_ns - began_ns, 1)
        return Running(
            file=self._file,
            vehicle=state,
            heartbeat_age_s=0.0 if state is None else (now_ns - state.heartbeat_ns) * 1e-9,
            pictures_hz=pictures_hz,
            findings=autopilot.findings() if autopilot is not None and autopilot.is_examined else None,
            firmware="" if autopilot is None else await autopilot.version(),
            is_mavlink=autopilot is not None,
            exposure=Seen(_read_back(flight.camera), series, pictures_hz),
            front_exposure=_read_back(flight.front_camera),
        )

    def _versions(self, firmware: str) -> dict[str, str]:
        """Those that a person is asked for when something does not work."""
        program, *rest = versions_of(_LIBRARIES).items()
        kind = f"firmware ({self._config.vehicle.kind})"
        return dict([program, *([(kind, firmware)] if firmware else []), *rest])


def exposure_reports(
    config: Config, down: ExposureState | None, front: ExposureState | None
) -> tuple[ExposureReport, ...]:
    """How the cameras that are fitted were set, and read back."""
    reports = [_exposure(CameraName.DOWN, "camera", config.camera, down, config)]
    if config.front_camera.is_fitted:
        reports.append(_exposure(CameraName.FRONT, "front_camera", config.front_camera, front, config))
    return tuple(reports)


def _exposure(
    name: CameraName,
    section: str,
    camera: CameraConfig | FrontCameraConfig,
    told: ExposureState | None,
    config: Config,
) -> ExposureReport:
    order, state = camera.exposure_order(), told or ExposureState()
    moves = name is CameraName.DOWN and state.exposure_s is not None
    return ExposureReport(
        camera=name,
        section=section,
        refused="" if can_be_told(camera.url) else cannot_be_told(camera.url),
        set_exposure_s=order.exposure_s,
        set_gain=order.gain,
        set_anti_flicker_hz=order.anti_flicker_hz,
        manual=state.is_manual,
        exposure_s=state.exposure_s,
        gain=state.gain,
        anti_flicker_hz=state.anti_flicker_hz,
        blur_px=round(blur_px(config, state.exposure_s or 0.0), 2) if moves else None,
    )


def _read_back(camera: Camera) -> ExposureState | None:
    return camera.exposure_state if isinstance(camera, TellsExposure) else None


def _reported(check: Check) -> CheckReport:
    return CheckReport(check.name, check.level.value, check.text, check.remedy, check.fix)
