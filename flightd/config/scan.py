"""The section of the configuration on scanning shelves."""

from __future__ import annotations

from typing import Final, Self

from pydantic import Field, field_validator, model_validator

from flightd.config.label_text import LabelTextConfig
from flightd.config.section import Section, unit
from flightd.config.sweep import ScanMode, SweepConfig
from flightd.core.processors import usable_cores

_MOST_WORKERS: Final = 16
_OTHER_CORES: Final = 2
"""What the control loop and the detectors take."""


class ScanExpert(Section):
    """What is left alone unless the shelves or their labels are unlike others."""

    darker: float = Field(
        0.4,
        ge=0.05,
        le=1,
        description="exposure of a second look where labels are burnt out, against the usual one",
        json_schema_extra=unit("share"),
    )
    brighter: float = Field(
        2.5,
        ge=1,
        le=10,
        description="exposure of a second look where labels are too dark, against the usual one",
        json_schema_extra=unit("share"),
    )
    label_reach_m: float = Field(
        0.3, ge=0, le=2, description="room above and below a label that must be in the picture with it"
    )
    least_probability: float = Field(
        0.99,
        ge=0.5,
        lt=1,
        description="least probability that a code belongs to a location for it to count there",
        json_schema_extra=unit("probability"),
    )
    revisits: int = Field(
        2,
        ge=0,
        le=10,
        description="most times that a node is flown to again, its findings withdrawn or no picture come",
    )


class ScanConfig(Section):
    """How the front camera counts the locations of a shelf.

    A view ends when every location in it is decided, at the latest after `view_s`; what is undecided then
    is looked at again from `retakes` other places, up to `step_m` nearer and `aside_m` along the aisle.
    Before that, where the light is the trouble, it is looked at again from the same place, `expert.darker`
    or `expert.brighter`."""

    mode: ScanMode = Field(
        ScanMode.SWEEP,
        description="sweep: in passing where labels and lines allow, then before what is left; stop: before "
        "each place",
    )
    min_height_m: float = Field(0.8, ge=0.5, le=20, description="lowest flight along a shelf")
    max_height_m: float | None = Field(
        None, ge=0.5, le=20, description="highest; none: as high as the site's ceiling lets it"
    )
    pictures: int = Field(3, ge=2, le=50, description="pictures that must agree on a location")
    view_s: float = Field(2.5, gt=0.1, le=60, description="longest look from one place")
    retakes: int = Field(2, ge=0, le=6, description="other places from which the undecided is looked at")
    step_m: float = Field(0.25, ge=0, le=1, description="how much nearer to the shelf that may be")
    aside_m: float = Field(0.4, ge=0, le=1, description="and how far along the aisle")
    clearance_m: float = Field(0.8, ge=0.2, le=5, description="never nearer to the shelf than this")
    least_integrity: float = Field(
        0.97,
        ge=0.5,
        lt=1,
        description="a picture counts where the place is at least so sure",
        json_schema_extra=unit("probability"),
    )
    confirm_stops: int = Field(
        2, ge=1, le=20, description="nodes reached without a doubt until a node's count is booked"
    )
    workers: int = Field(
        1,
        ge=0,
        le=_MOST_WORKERS,
        description="code reader processes; 0: one for each of the computer's cores but two, at least one",
    )
    timeout_s: float = Field(3.0, gt=0.05, le=30, description="a reader that takes longer is replaced")
    sweep: SweepConfig = SweepConfig()
    expert: ScanExpert = ScanExpert()
    text: tuple[LabelTextConfig, ...] = ()

    @field_validator("workers")
    @classmethod
    def _as_cores_allow(cls, workers: int) -> int:
        return workers or min(max(usable_cores() - _OTHER_CORES, 1), _MOST_WORKERS)

    @model_validator(mode="after")
    def _heights_in_order(self) -> Self:
        if self.max_height_m is not None and self.max_height_m < self.min_height_m:
            raise ValueError("min_height_m <= max_height_m is required")
        return self

    def highest_m(self, ceiling_m: float) -> float:
        """The highest view where nothing may be flown above `ceiling_m`."""
        return ceiling_m if self.max_height_m is None else min(self.max_height_m, ceiling_m)
