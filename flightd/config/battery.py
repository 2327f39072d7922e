"""The battery's section of the configuration."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from flightd.config.section import Section, unit


class BatteryConfig(Section):
    """How long a battery flies, and what happens when it does not last."""

    flight_s: float = Field(
        600.0,
        ge=30,
        le=36_000,
        description="hovering time of a full battery; measured in flight from then on",
    )
    capacity_wh: float | None = Field(
        None, gt=0, le=10_000, description="energy of a full battery; with hover_w, in place of flight_s"
    )
    hover_w: float | None = Field(None, gt=0, le=100_000, description="power that hovering takes")
    reserve: float = Field(
        0.10,
        ge=0,
        le=0.5,
        description="charge that stays when it is back on the pad",
        json_schema_extra=unit("share of full"),
    )
    full: float = Field(
        0.90,
        gt=0,
        le=1,
        description="least charge of a battery put in to go on",
        json_schema_extra=unit("share of full"),
    )
    cells: int | None = Field(
        None,
        ge=1,
        le=14,
        description="cells in series; left out: as the vehicle tells; where neither does, nothing starts",
    )
    cell_start_v: float = Field(
        3.6, ge=2.5, le=4.3, description="least voltage of a cell to start", json_schema_extra=unit("V")
    )
    cell_home_v: float = Field(
        3.45,
        ge=2.5,
        le=4.3,
        description="fly home when a cell has less in flight",
        json_schema_extra=unit("V"),
    )
    cell_land_v: float = Field(
        3.3,
        ge=2.5,
        le=4.3,
        description="land at once when a cell has less in flight",
        json_schema_extra=unit("V"),
    )
    silent_s: float = Field(
        10.0, ge=3, le=120, description="charge and voltage older than this are not known"
    )
    frozen: float = Field(
        0.10,
        ge=0.03,
        le=1,
        description="a charge that stands still in flight is believed till so much should be gone; 1: always",
        json_schema_extra=unit("share of full"),
    )
    swap: bool = Field(
        False,
        description="wait on the charge pad for a fresh battery and go on; false: the mission ends there",
    )
    swap_wait_s: float = Field(1800.0, gt=0, le=86_400, description="give up waiting after this")

    @property
    def hover_s(self) -> float:
        """The time that a full battery is believed to hover, until flights have shown better."""
        if self.capacity_wh is not None and self.hover_w is not None:
            return 3600.0 * self.capacity_wh / self.hover_w
        return self.flight_s

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if (self.capacity_wh is None) != (self.hover_w is None):
            raise ValueError("capacity_wh and hover_w belong together: give both or neither")
        if not self.cell_land_v < self.cell_home_v <= self.cell_start_v:
            raise ValueError("cell_land_v < cell_home_v <= cell_start_v is required")
        return self
