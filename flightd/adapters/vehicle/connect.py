"""The adapter for the vehicle that the configuration names."""

from __future__ import annotations

from flightd.adapters.vehicle.ardrone.settings import settings_of
from flightd.adapters.vehicle.ardrone.vehicle import ArDroneVehicle
from flightd.adapters.vehicle.mavlink.ardupilot import ArduPilotVehicle
from flightd.adapters.vehicle.mavlink.px4 import Px4Vehicle
from flightd.adapters.vehicle.mavlink.vehicle import MavlinkOptions
from flightd.config.schema import VehicleConfig
from flightd.core.errors import InputError
from flightd.ports import Clock, Vehicle


def connect_vehicle(config: VehicleConfig, clock: Clock) -> Vehicle:
    """Make the adapter; nothing is opened until its `run`.  Raises InputError for a wrong address."""
    match config.kind:
        case "ardupilot":
            return ArduPilotVehicle(config.url, clock, MavlinkOptions(config.system_id))
        case "px4":
            return Px4Vehicle(config.url, clock, MavlinkOptions(config.system_id))
        case "ardrone":
            return ArDroneVehicle(settings_of(config.url), clock)
        case "mavsdk":
            return _mavsdk_vehicle(config, clock)
    raise InputError(f"vehicle.kind {config.kind}: no such adapter")


def _mavsdk_vehicle(config: VehicleConfig, clock: Clock) -> Vehicle:
    """The library is an extra, and 19 MB that nobody else has to load."""
    try:
        from flightd.adapters.vehicle.mavsdk.vehicle import MavsdkVehicle  # noqa: PLC0415
    except ImportError as err:
        text = f"vehicle.kind mavsdk: {err}; install the library: pip install 'flightd[mavsdk]'"
        raise InputError(text) from err
    return MavsdkVehicle(config.url, clock, config.system_id)
