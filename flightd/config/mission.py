"""The mission's section of the configuration: what to fly, how fast, and when to give up."""

from __future__ import annotations

import enum
import math
from pathlib import Path
from typing import Annotated, ClassVar, Self, TypeAlias

from pydantic import Field, model_validator

from flightd.config.section import Section, unit

_Charge: TypeAlias = Annotated[
    float, Field(ge=0, le=1, allow_inf_nan=False, json_schema_extra=unit("share of full"))
]

HEIGHT_ROOM_M = 0.4
"""Below and above the flying height, what a keep-out must leave free for a leg to pass it."""


class Heading(enum.StrEnum):
    """Nose in the direction of flight, or the front camera to the shelf of the aisle."""

    ALONG = "along"
    SHELF = "shelf"


class VisitOrder(enum.StrEnum):
    """As the configuration lists the nodes (all of them: aisle by aisle), or the quickest."""

    GIVEN = "given"
    BEST = "best"


class MissionExpert(Section):
    """How phases begin, end and time out, and how doubt about the position is settled."""

    climb_accel_mps2: float = Field(0.6, gt=0, le=5, description="acceleration of climbs and descents")
    turn_accel_degps2: float = Field(
        math.degrees(1.0), gt=0, le=720, description="angular acceleration of turns"
    )
    max_lead_m: float = Field(
        0.35, gt=0, le=2, description="the reference waits when the drone is so far behind"
    )
    arrive_mps: float = Field(0.10, gt=0, le=1, description="a node is reached below this speed only")
    arrive_yaw_deg: float = Field(4.0, gt=0, le=45, description="a turn is over this near to its heading")
    height_reached_m: float = Field(0.15, gt=0, le=1, description="a take-off ends this near to its height")
    view_height_m: float = Field(0.08, gt=0, le=1, description="a view is reached this near to its height")
    steer_above_m: float = Field(
        0.45,
        ge=0,
        le=5,
        description="from here a take-off steers, or brakes, by what it sees; none is judged below",
    )
    touch_below_m: float = Field(0.35, gt=0, le=5, description="the last stretch of a landing begins here")
    touch_mps: float = Field(0.20, gt=0, le=1, description="rate of the last stretch of a landing")
    blind_mps: float = Field(0.9, gt=0, le=3, description="fastest descent without a view of the floor")
    touch_blind_mps: float = Field(0.4, gt=0, le=1, description="slowest of it, near the floor")
    lines_found_s: float = Field(
        1.0, ge=0, le=30, description="lines seen for so long end the time for which they were lost"
    )
    followed_hold_s: float = Field(
        0.8, gt=0, le=10, description="the line followed not seen for so long: level and hold"
    )
    arm_timeout_s: float = Field(60.0, gt=0, le=3600, description="not armed for so long: give up")
    start_expires_s: float = Field(
        5.0, gt=0, le=5, description="a start command that has not armed so long after its count-down is void"
    )
    adopt_s: float = Field(
        1.5, ge=0, le=1.5, description="a drone found flying is given so long to show that it obeys"
    )
    phase_slack_s: float = Field(
        20.0, gt=0, le=600, description="a phase may take so long on top of the share of its way's own time"
    )
    phase_share: float = Field(
        2.0,
        ge=1,
        le=20,
        description="and so many times its way's own time",
        json_schema_extra=unit("times"),
    )
    doubt_s: float = Field(0.3, ge=0, le=10, description="position in doubt for so long: stop and relocate")
    first_look_s: float = Field(
        3.0, ge=0, le=60, description="the same for the first position after a take-off"
    )
    settled_s: float = Field(0.5, ge=0, le=10, description="position sure for so long: the doubt is over")
    relocate_look_s: float = Field(
        4.0, gt=0, le=60, description="so long it looks from one place before it moves on"
    )
    relocate_climb_m: float = Field(1.0, ge=0, le=10, description="how much it climbs to see more, at most")

    @property
    def turn_accel_radps2(self) -> float:
        return math.radians(self.turn_accel_degps2)

    @property
    def arrive_yaw_rad(self) -> float:
        return math.radians(self.arrive_yaw_deg)


class MissionConfig(Section):
    """What to fly and how fast."""

    files: ClassVar = ("site", "progress")

    site: Path = Field(description="site file, relative to this file")
    nodes: tuple[str, ...] = Field(
        (), description="nodes to visit in order; empty: every node, aisle by aisle"
    )
    order: VisitOrder = Field(
        VisitOrder.GIVEN, description="given: nodes as listed (all: aisle by aisle); best: the quickest order"
    )
    heading: Heading = Field(
        Heading.ALONG,
        description="along: nose in flight direction; shelf: nose to the shelf, as always where scan.mode is"
        ' "sweep" and the front camera looks ahead',
    )
    pad: str | None = Field(None, description="id of the pad that it stands on at first; none: the home pad")
    start_yaw_deg: float = Field(
        0.0, ge=-180, le=180, description="heading on the pad, clockwise from the aisles"
    )
    height_m: float = Field(1.6, ge=0.5, le=20, description="flying height above the floor")
    speed_mps: float = Field(0.8, gt=0, le=3, description="speed along the lines")
    accel_mps2: float = Field(0.5, gt=0, le=2, description="how that speed is gained and lost")
    climb_mps: float = Field(0.6, gt=0, le=2, description="rate of climbs, and of descents between views")
    land_mps: float = Field(0.35, gt=0, le=1, description="rate of a landing, slower near the floor")
    turn_rate_degps: float = Field(35.0, gt=0, le=120, description="rate of turns on the spot")
    dwell_s: float = Field(2.0, ge=0, le=600, description="hover at each node")
    settle_s: float = Field(0.4, ge=0, le=10, description="at a goal for so long: it is reached")
    arrive_m: float = Field(0.08, gt=0, le=0.5, description="a node is reached within this distance")
    lines_hold_s: float = Field(0.25, gt=0, le=2, description="lines older than this: level and hold")
    lines_land_s: float = Field(4.0, gt=0, le=60, description="held for so long: land")
    integrity_min: float = Field(
        0.95,
        ge=0.5,
        lt=1,
        description="probability of the node below which it stops and relocates",
        json_schema_extra=unit("probability"),
    )
    relocate_s: float = Field(30.0, gt=0, le=300, description="position not found again for so long: land")
    telemetry_hold_s: float = Field(0.3, gt=0, le=2, description="telemetry older than this: level and hold")
    telemetry_land_s: float = Field(3.0, gt=0, le=3, description="telemetry older than this: land")
    battery_start: _Charge = Field(0.30, description="least charge to start")
    battery_home: _Charge = Field(0.20, description="fly home below this charge")
    battery_land: _Charge = Field(0.10, description="land at once below this charge")
    progress: Path | None = Field(
        None, description="file that keeps the stops still to be made, relative to this file"
    )
    resume: bool = Field(False, description="fly what that file holds, if anything, instead of the nodes")
    autostart: bool = Field(False, description="start without waiting for the start command")
    start_countdown_s: float = Field(
        3.0,
        ge=0,
        le=60,
        description="from a start command to arming, told to everybody; pause takes the start back",
    )
    autostart_countdown_s: float = Field(
        3.0,
        ge=0,
        le=60,
        description="the same before a start by itself, once nothing keeps the drone on the ground any more",
    )
    recover_s: float = Field(
        2.0,
        ge=1.5,
        le=600,
        description="found flying at a restart: level for so long, for pilot or operator, then land",
    )
    expert: MissionExpert = MissionExpert()

    @property
    def turn_rate_radps(self) -> float:
        return math.radians(self.turn_rate_degps)

    @property
    def start_yaw_rad(self) -> float:
        return math.radians(self.start_yaw_deg)

    def flown_between_m(self) -> tuple[float, float]:
        """The heights that the legs of the flight are flown between, with room to spare."""
        return self.height_m - HEIGHT_ROOM_M, self.height_m + HEIGHT_ROOM_M

    @model_validator(mode="after")
    def _batteries_in_order(self) -> Self:
        if not self.battery_land < self.battery_home <= self.battery_start:
            raise ValueError("battery_land < battery_home <= battery_start is required")
        return self
