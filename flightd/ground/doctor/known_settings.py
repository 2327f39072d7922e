"""A drone's settings as it told them last, against which what a person types is judged before it is sent."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from pathlib import Path

from flightd.adapters.ground_link.messages.maintenance import SettingsAnswer, Value
from flightd.config.remote_change import checked
from flightd.core.errors import InputError, RunError

_KEPT = 32
_FILE = Path("flightd.toml")
_BEFORE = f"config {_FILE}: "


class KnownSettings:
    """The newest settings of each drone."""

    def __init__(self) -> None:
        self._told: OrderedDict[str, SettingsAnswer] = OrderedDict()

    def note(self, drone: str, told: SettingsAnswer) -> None:
        """What it told."""
        self._told[drone] = told
        self._told.move_to_end(drone)
        while len(self._told) > _KEPT:
            self._told.popitem(last=False)

    def complaint(self, drone: str, base: str, changes: Mapping[str, Value]) -> str:
        """What speaks against these changes, in the words of the configuration's own models; empty where
        nothing does.  RunError where the person saw other settings."""
        told = self._told.get(drone)
        if told is None or told.tag != base:
            raise RunError("the settings were changed meanwhile", remedy="look at them again")
        try:
            checked(told.table, changes, _FILE)
        except InputError as err:
            return str(err).removeprefix(_BEFORE)
        return ""
