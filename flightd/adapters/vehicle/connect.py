"""The adapter for the vehicle that the configuration names."""

from __future__ import annotations

import math
import time

from flightd.adapters.vehicle.ardrone.settings import settings_of
from flightd.adapters.vehicle.ardrone.vehicle import ArDroneVehicle
from flightd.adapters.vehicle.mavlink.ardupilot import ArduPilotVehicle
from flightd.adapters.vehicle.mavlink.link.signing import Signing, read_key
from flightd.adapters.vehicle.mavlink.pose_output import PoseForm
from flightd.adapters.vehicle.mavlink.px4 import Px4Vehicle
from flightd.adapters.vehicle.mavlink.required_parameters import UNKNOWN_BATTERY, Job
from flightd.adapters.vehicle.mavlink.vehicle import MavlinkOptions
from flightd.config.battery import BatteryConfig
from flightd.config.control import ControlConfig
from flightd.config.vehicle import VehicleConfig
from flightd.core.errors import InputError
from flightd.core.extras import missing_extra
from flightd.ports import Clock, Vehicle
from flightd.runtime.datagrams import OpenDatagrams, open_datagrams


def connect_vehicle(
    config: VehicleConfig,
    clock: Clock,
    limits: ControlConfig | None = None,
    *,
    battery: BatteryConfig = UNKNOWN_BATTERY,
    highest_m: float = math.inf,
    url: str | None = None,
    opener: OpenDatagrams = open_datagrams,
) -> Vehicle:
    """Make the adapter; nothing is opened until its `run`.  Raises InputError for a wrong address or a
    signing key that cannot be used.

    `limits` are those of the setpoints: an AR.Drone's own are set to them, for it takes shares of its own.
    `battery` is what is known of its own, by which its failsafes are judged; `highest_m` is the greatest
    height that may be flown, for the one that keeps it itself.
    `url` is where the vehicle is reached, unless that is the configuration's; `opener` opens the
    sockets of a MAVLink one.
    """
    url = config.url if url is None else url
    match config.kind:
        case "ardupilot":
            return ArduPilotVehicle(url, clock, _options(config, clock, opener, battery))
        case "px4":
            return Px4Vehicle(url, clock, _options(config, clock, opener, battery))
        case "ardrone":
            return ArDroneVehicle(settings_of(url, limits, highest_m), clock)
        case "mavsdk":
            return _mavsdk_vehicle(url, config, clock, opener, battery)
    raise InputError(f"vehicle.kind {config.kind}: no such adapter")


def _mavsdk_vehicle(
    url: str, config: VehicleConfig, clock: Clock, opener: OpenDatagrams, battery: BatteryConfig
) -> Vehicle:
    """The library is an extra, and 19 MB that nobody else has to load."""
    try:
        from flightd.adapters.vehicle.mavsdk.vehicle import MavsdkVehicle  # noqa: PLC0415
    except ImportError as err:
        raise missing_extra("mavsdk", "vehicle.kind mavsdk") from err
    return MavsdkVehicle(url, clock, config.system_id, opener, cells=battery.cells)


def signing_of(config: VehicleConfig, clock: Clock) -> Signing | None:
    """The configured key of a signed link.  InputError when the key or its time stamp cannot be read."""
    if config.signing_key is None:
        return None
    return Signing(read_key(config.signing_key), clock, time.time(), config.stamp_file)


def _options(
    config: VehicleConfig, clock: Clock, opener: OpenDatagrams, battery: BatteryConfig
) -> MavlinkOptions:
    return MavlinkOptions(
        system_id=config.system_id,
        job=Job.of(config, battery),
        signing=signing_of(config, clock),
        pose_form=_form(config),
        origin_deg=config.origin_deg,
        opener=opener,
    )


def _form(config: VehicleConfig) -> PoseForm | None:
    if not config.shares_pose:
        return None
    return PoseForm.ODOMETRY if config.pose_output == "auto" else PoseForm(config.pose_output)
