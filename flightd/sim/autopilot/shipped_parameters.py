"""The parameter files that ship with flightd, as the simulated autopilots load them: what ships is flown."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from flightd.config.paths import shipped

_ARDUPILOT = "arducopter-nogps.parm"
_PX4 = "px4-nogps.params"


def shipped_parameters(
    vehicle: Literal["ardupilot", "px4"], known: Mapping[str, float | int]
) -> dict[str, float | int]:
    """The shipped file's values of those parameters that are `known`, whole numbers where those are: a real
    autopilot passes over the others with a warning, too."""
    name, column = (_PX4, 2) if vehicle == "px4" else (_ARDUPILOT, 0)
    lines = shipped(name).read_text(encoding="utf-8").splitlines()
    rows = (line.split() for line in lines if line.strip() and not line.startswith("#"))
    values = {row[column]: float(row[column + 1]) for row in rows}
    return {key: type(known[key])(value) for key, value in values.items() if key in known}
