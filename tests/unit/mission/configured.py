"""The configuration of a flight, for tests of parts of the mission."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from flightd.config.battery import BatteryConfig
from flightd.config.mission import MissionConfig
from flightd.config.schema import Config


def configured(battery: BatteryConfig | None = None, **mission: Any) -> Config:
    """What is shipped, started without a command, with other keys of the mission where they are given."""
    keys = {"site": Path("site.toml"), "autostart": True, "autostart_countdown_s": 0.0, **mission}
    return Config(mission=MissionConfig(**keys), battery=battery or BatteryConfig())
