"""The configuration's sections on scanning shelves and on the inventory that it makes."""

from __future__ import annotations

from pathlib import Path
from typing import Self

from pydantic import Field, model_validator

from flightd.config.section import Section
from flightd.mission.scan.views import ScanParams


class ScanConfig(Section):
    """How the front camera counts the locations of a shelf.  Lengths in m, times in s."""

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
        0.97, ge=0.5, lt=1, description="a picture counts where the place is at least so sure"
    )
    confirm_stops: int = Field(
        2, ge=1, le=20, description="nodes reached without a doubt until a node's count is booked"
    )
    workers: int = Field(1, ge=1, le=16, description="code reader processes")
    timeout_s: float = Field(3.0, gt=0.05, le=30, description="a reader that takes longer is replaced")

    @model_validator(mode="after")
    def _heights_in_order(self) -> Self:
        if self.max_height_m is not None and self.max_height_m < self.min_height_m:
            raise ValueError("min_height_m <= max_height_m is required")
        return self

    def params(self, highest_m: float, aside_per_height: float) -> ScanParams:
        """`highest_m` is what the ceiling allows, `aside_per_height` how far from its node the drone still
        sees the node's lines, for each metre of height."""
        return ScanParams(
            min_height_m=self.min_height_m,
            max_height_m=highest_m if self.max_height_m is None else min(self.max_height_m, highest_m),
            pictures=self.pictures,
            view_s=self.view_s,
            retakes=self.retakes,
            step_m=self.step_m,
            aside_m=self.aside_m,
            aside_per_height=aside_per_height,
            clearance_m=self.clearance_m,
            least_integrity=self.least_integrity,
            confirm_stops=self.confirm_stops,
        )


class InventoryConfig(Section):
    """Where the count is kept."""

    folder: Path | None = Field(
        None,
        description="folder of the inventory (`flightd inventory`), relative to this file; none: not kept",
    )
    run: str = Field(
        "",
        max_length=80,
        description="name of the count; a flight of the same name goes on where the last one ended; "
        "empty: each flight is a count of its own",
    )

    def beside(self, folder: Path) -> Self:
        """The same with paths taken from `folder`."""
        if self.folder is None:
            return self
        return self.model_copy(update={"folder": (folder / self.folder).resolve()})
