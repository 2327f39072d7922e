"""The daemon's configuration: one frozen, typed tree; unknown keys are refused, every key says its unit
and range.  Angles are degrees in the file (`_deg`) and radians wherever the tree is used."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from flightd.config.battery import BatteryConfig
from flightd.config.camera import CameraConfig
from flightd.config.control import ControlConfig
from flightd.config.front_camera import FrontCameraConfig
from flightd.config.ground import GroundConfig
from flightd.config.hazards import HazardConfig
from flightd.config.interlock import InterlockConfig
from flightd.config.inventory import InventoryConfig
from flightd.config.localisation import LocalisationConfig
from flightd.config.metrics import MetricsConfig
from flightd.config.migration import migrated, moved_keys
from flightd.config.mission import MissionConfig
from flightd.config.mistakes import complaint
from flightd.config.recorder import RecorderConfig
from flightd.config.scan import ScanConfig
from flightd.config.section import Section
from flightd.config.tracking import TrackingConfig
from flightd.config.vehicle import VehicleConfig
from flightd.config.vision import VisionConfig
from flightd.core.errors import InputError


class Config(Section):
    """The whole file."""

    mission: MissionConfig
    camera: CameraConfig = CameraConfig()
    front_camera: FrontCameraConfig = FrontCameraConfig()
    scan: ScanConfig = ScanConfig()
    inventory: InventoryConfig = InventoryConfig()
    vision: VisionConfig = VisionConfig()
    vehicle: VehicleConfig = VehicleConfig()
    control: ControlConfig = ControlConfig()
    battery: BatteryConfig = BatteryConfig()
    recorder: RecorderConfig = RecorderConfig()
    ground: GroundConfig = GroundConfig()
    metrics: MetricsConfig = MetricsConfig()
    interlock: InterlockConfig = InterlockConfig()
    hazards: HazardConfig = HazardConfig()
    tracking: TrackingConfig = TrackingConfig()
    localisation: LocalisationConfig = LocalisationConfig()

    def beside(self, folder: Path) -> Config:
        """The same with the relative paths of its sections taken from `folder`."""
        sections = {key: getattr(self, key).beside(folder) for key in type(self).model_fields}
        return self.model_copy(update=sections)


def load_config(path: Path) -> Config:
    """Read and check a configuration file.  Raises InputError naming the file, the key and the remedy."""
    return parse_config(load_table(path), path)


def load_table(path: Path) -> dict[str, Any]:
    """The file as it is, unchecked."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as err:
        raise InputError(f"config {path}: {err.strerror}; give the path of a TOML file") from err
    except UnicodeDecodeError as err:
        raise InputError(f"config {path}: not UTF-8 text") from err
    except tomllib.TOMLDecodeError as err:
        raise InputError(f"config {path}: not TOML: {err}") from err


def parse_config(table: dict[str, Any], path: Path) -> Config:
    """Check a table that was read from `path`; relative paths in it are taken from there."""
    if key := _key_with_null(table):
        raise InputError(f"config {path}: {key}: holds a null character; take it out")
    for old, new in moved_keys(table):
        raise InputError(f"config {path}: {old}: moved to {new}; rename it")
    try:
        config = Config.model_validate(table)
    except ValidationError as err:
        first = err.errors()[0]
        more = f" (and {len(err.errors()) - 1} more)" if len(err.errors()) > 1 else ""
        raise InputError(f"config {path}: {complaint(first, Config)}{more}") from err
    return config.beside(path.parent)


def recorded_config(document: dict[str, Any], log: Path) -> Config:
    """The configuration that a flight `log` keeps, written by this version or an older one."""
    return parse_config(migrated(document), log)


def _key_with_null(value: object, key: str = "") -> str:
    """The first key whose text no file system takes, or an empty text."""
    if isinstance(value, str):
        return key if "\0" in value else ""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return next(filter(None, (_key_with_null(item, f"{key}.{name}".strip(".")) for name, item in inner)), "")
