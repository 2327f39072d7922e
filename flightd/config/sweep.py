"""The section of the configuration on counting shelves in passing."""

from __future__ import annotations

import enum

from pydantic import Field

from flightd.config.section import Section, unit


class ScanMode(enum.StrEnum):
    """Stopping before each place, or flying past and stopping only before what that left open."""

    STOP = "stop"
    SWEEP = "sweep"


class SweepConfig(Section):
    """How shelves are counted in passing, where `scan.mode` is "sweep".

    The speed is the highest that keeps the blur within 0.75 module, gives `views` whole views of each place
    and does not exceed `mission.speed_mps`. An aisle whose labels get less than 2.5 pixels for each module,
    or whose lines are not open both ways, is counted by stopping."""

    module_m: float = Field(
        0.003, ge=0.0001, le=0.1, description="size of a module (the narrowest bar) of the smallest label"
    )
    label_m: float = Field(0.10, ge=0.005, le=1, description="longer side of the largest label")
    views: int = Field(3, ge=2, le=20, description="whole views that the speed gives each place, at least")
    speed_mps: float | None = Field(
        None, gt=0, le=3, description="fastest flight past a shelf; none: as fast as the rest lets it"
    )
    least_exposure: float = Field(
        1.0,
        ge=0.05,
        le=1,
        description="exposure that the light allows against the usual one; shorter ones let it fly faster",
        json_schema_extra=unit("share"),
    )
    most_gain: float = Field(
        2.5,
        ge=1,
        le=16,
        description="gain of a dark rack front against the usual one, at most; what it cannot make up for is "
        "flown past more slowly",
        json_schema_extra=unit("factor"),
    )
    read_s: float = Field(
        0.25,
        gt=0.005,
        le=10,
        description="what a code reader takes for a picture; faster frames are left out",
    )
    unread_views: int = Field(
        4, ge=2, le=50, description="whole, well-lit views without a code that make a place unreadable"
    )
    unread_spread_deg: float = Field(
        10.0, ge=0, le=90, description="and the angle along the shelf that these must differ by"
    )
