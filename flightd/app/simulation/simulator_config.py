"""The simulator's configuration: its file, with settings laid over it before it is checked."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path
from types import UnionType
from typing import Any, Union, get_args, get_origin

from pydantic import BaseModel

from flightd.config.camera import OpticsSection
from flightd.config.paths import shipped
from flightd.config.schema import Config, load_table, parse_config
from flightd.core.errors import InputError
from flightd.sim.random_sites import random_site
from flightd.sim.scenario.scenario import CameraScenario, FrontCameraScenario, Scenario
from flightd.sim.sensors.camera_path import CameraPath
from flightd.site.site import Site
from flightd.site.site_file import load_site

_FRONT_CAMERA_URL = "udp://127.0.0.1:5601"
"""That there is a front camera; where it is reached is each simulation's own."""
_LAMPS = {"ardupilot": "relay:0", "px4": "actuator:1"}


def simulator_config(
    path: Path | None,
    warehouse: str | None,
    scenario: Scenario,
    settings: Sequence[str] = (),
    vehicle: str | None = None,
    vehicle_url: str = "",
    camera: CameraPath = CameraPath.SHARED,
) -> tuple[Config, Site]:
    """Configuration and site: the file (None: the shipped one) with the simulated cameras' keys, which hold
    unless one of the `settings` (KEY=VALUE) says otherwise, and with a front camera where there are racks.
    InputError names the file, the key or the option, and the remedy."""
    path = path or shipped("sim.toml")
    table = load_table(path)
    for key, value in _camera_keys(scenario, camera).items():
        _lay(table, key, value)
    if vehicle is not None:
        _lay(table, "vehicle.kind", vehicle)
    if vehicle_url:
        _lay(table, "vehicle.url", vehicle_url)
    for setting in settings:
        key, equals, text = setting.partition("=")
        if not equals:
            raise InputError(f"--set {setting}: expected KEY=VALUE, for example mission.heading=shelf")
        _lay(table, key, _value(key, text))
    _hang_lamp(table)
    config = parse_config(table, path)
    site = _site(config, warehouse)
    # an AR.Drone carries no second computer to see the racks with
    if site.locations and config.vehicle.kind != "ardrone" and not config.front_camera.is_fitted:
        _lay(table, "front_camera.url", _FRONT_CAMERA_URL)
        config = parse_config(table, path)
    _demand_size("camera", config.camera, scenario.camera)
    if config.front_camera.is_fitted:
        _demand_size("front_camera", config.front_camera, scenario.front_camera)
    return config, site


def _hang_lamp(table: dict[str, Any]) -> None:
    """The simulated lamp hangs on the simulated autopilot, whatever switches the real one."""
    front, vehicle = table.get("front_camera"), table.get("vehicle", {})
    if isinstance(front, dict) and front.get("lamp") and isinstance(vehicle, dict):
        front["lamp"] = _LAMPS.get(vehicle.get("kind", "ardupilot"), "")


def _demand_size(
    section: str, expected: OpticsSection, simulated: CameraScenario | FrontCameraScenario
) -> None:
    """InputError where the daemon would wait for pictures of another size than the simulated camera takes."""
    for key in ("width_px", "height_px"):
        wanted, taken = getattr(expected, key), getattr(simulated, key)
        if wanted != taken:
            raise InputError(
                f"{wanted}, but the simulated camera takes pictures of {taken}",
                key=f"{section}.{key}",
                remedy=f"give {key} = {wanted} in [{section}] of a scenario (--scenario FILE) instead",
            )


def _site(config: Config, warehouse: str | None) -> Site:
    """The wanted site: a file, random:SEED, or the configuration's own."""
    if warehouse and warehouse.startswith("random:"):
        number = warehouse.removeprefix("random:")
        if not number.isdigit():
            raise InputError(f"--warehouse {warehouse}: expected random:SEED, for example random:7")
        return random_site(int(number))
    return load_site(Path(warehouse) if warehouse else config.mission.site)


def _lay(table: dict[str, Any], key: str, value: object) -> None:
    *sections, name = key.split(".")
    for section in sections:
        table = table.setdefault(section, {})
        if not isinstance(table, dict):
            raise InputError(f"--set {key}: {section} is not a section")
    table[name] = value


def _value(key: str, text: str) -> object:
    """A TOML value; a bare word is text, and words between commas are a list where the key holds a list of
    texts."""
    try:
        return tomllib.loads(f"v = {text}")["v"]
    except tomllib.TOMLDecodeError:
        return [word.strip() for word in text.split(",")] if _is_list_of_texts(key) else text


def _is_list_of_texts(key: str) -> bool:
    """Whether the key of the configuration holds a list of any number of texts."""
    section: Any = Config
    for name in key.split("."):
        fields = section.model_fields if _is_section(section) else {}
        if name not in fields:
            return False
        section = fields[name].annotation
    kinds = get_args(section) if get_origin(section) in {Union, UnionType} else (section,)
    return any(get_origin(kind) is tuple and get_args(kind) == (str, ...) for kind in kinds)


def _is_section(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def _camera_keys(scenario: Scenario, path: CameraPath) -> dict[str, Any]:
    """The calibration of the simulated cameras, as a configuration has it."""
    down, front = scenario.camera.camera(), scenario.front_camera.camera()
    return {
        **_calibration("camera", down),
        "camera.latency_s": path.latency_s(down),
        "camera.readout_s": down.readout_s,
        **_calibration("front_camera", front),
        "front_camera.exposure_s": front.exposure_s,
        "front_camera.fps": front.fps,
    }


def _calibration(section: str, camera: Any) -> dict[str, Any]:
    lens = camera.lens
    keys = {
        "width_px": lens.width_px,
        "height_px": lens.height_px,
        "fx_px": lens.fx_px,
        "fy_px": lens.fy_px,
        "cx_px": lens.cx_px,
        "cy_px": lens.cy_px,
        "distortion": lens.distortion,
        "latency_s": camera.capture_delay_s,
    }
    return {f"{section}.{key}": value for key, value in keys.items()}
