"""What a scenario expects of a flight: the `[expect]` of its file."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, field_validator

from flightd.config.section import Section
from flightd.mission.safety.hazard_table import HAZARDS
from flightd.sim.judge.verdict import KINDS, SAFETY_KINDS

_HAZARDS = frozenset(row.name for row in HAZARDS)
_CUT_OFF = frozenset({"companion_dead", "uplink_lost", "telemetry_lost", "heartbeat_lost"})
"""What takes the computer, the way to the autopilot or the way from it away."""


class Expectation(Section):
    """How a flight of this scenario should go: which hazard is found, how soon, and how it ends."""

    hazard: str = Field(min_length=1, max_length=40)
    found_s: float = Field(1.0, gt=0, le=600)
    ends: Literal["completed", "home", "landed", "down", "handed over"]
    tolerates: tuple[str, ...] = ()

    @property
    def cut_off(self) -> bool:
        """Autopilot and computer do not hear each other."""
        return self.hazard in _CUT_OFF

    @field_validator("hazard")
    @classmethod
    def _in_the_table(cls, name: str) -> str:
        if name not in _HAZARDS:
            raise ValueError(f"no such hazard: {name!r}; `flightd guide hazards` lists them")
        return name

    @field_validator("tolerates")
    @classmethod
    def _known(cls, kinds: tuple[str, ...]) -> tuple[str, ...]:
        for kind in kinds:
            if kind not in KINDS:
                raise ValueError(f"no such fault: {kind!r}; one of {', '.join(KINDS)}")
            if kind in SAFETY_KINDS:
                raise ValueError(f"{kind!r} must never be, whatever goes wrong")
        return kinds
