"""The hazards' section of the configuration: when something counts as wrong."""

from __future__ import annotations

import enum
import math
from typing import Literal

from pydantic import Field

from flightd.config.section import Section


class LossAction(enum.StrEnum):
    """What to do when something is lost that flying itself does not need: ground station, flight log."""

    CONTINUE = "continue"
    HOLD = "hold"
    HOME = "home"
    LAND = "land"


class HazardExpert(Section):
    """Times of flying without lines, and what is tolerated of wind."""

    push_mps2: float = Field(0.8, gt=0.1, le=5, description="steady push (wind, trim) that is tolerated")
    off_m: float = Field(0.5, gt=0.1, le=5, description="distance from the reference that is tolerated")
    push_s: float = Field(2.0, gt=0, le=60, description="push or distance tolerated for so long")
    outside_s: float = Field(
        0.2, ge=0, le=10, description="above the ceiling or beside the corridor tolerated for so long"
    )
    brake_s: float = Field(
        2.4, ge=0, le=2.4, description="without lines the velocity is dead-reckoned for so long"
    )
    search_s: float = Field(0.0, ge=0, le=60, description="lines lost for so long: climb to see more")
    search_climb_m: float = Field(0.3, ge=0, le=0.5, description="by how much, below the ceiling")
    search_land_s: float = Field(1.4, ge=0.3, le=60, description="pictures without lines for so long: land")
    blind_land_s: float = Field(1.7, ge=0.3, le=60, description="nothing seen at all for so long: land")
    blind_m: float = Field(0.5, ge=0.2, le=20, description="with nothing seen sink at once, down to here")


class HazardConfig(Section):
    """Thresholds and times of the hazards that have no place elsewhere."""

    heartbeat_land_s: float = Field(5.0, ge=2, le=60, description="no heartbeat for so long: land")
    # In flight the two agree to 0.02, and the tracker goes by the lines from 0.2 on.  A drone that climbs by
    # a range finder which reads 0.7 m too little is told wrong by 0.30 when it comes to rest at 1.6 m.
    height_share: float = Field(
        0.25, gt=0.1, le=1, description="lines' width against the map's by more: the height is wrong"
    )
    heading_deg: float = Field(
        5.0,
        ge=2,
        le=40,
        description="lines against the vehicle's heading by more: it is wrong",
    )
    disagree_s: float = Field(0.4, gt=0, le=10, description="height or heading disagree for so long")
    headroom_m: float = Field(0.5, ge=0.1, le=5, description="kept below the site's ceiling")
    corridor_m: float = Field(
        0.45,
        ge=0.3,
        le=5,
        description="free way to both sides of every painted line of the map; less beside a shelf",
    )
    clock_error_s: float = Field(
        0.02,
        ge=0.005,
        le=0.2,
        description="times of the vehicle's clock that are less certain (1 sigma) are not flown by",
    )
    latency_s: float = Field(
        0.25, ge=0.05, le=2, description="p99 from exposure to the wire that can be flown by"
    )
    overload_s: float = Field(3.0, ge=0.5, le=60, description="latency or late ticks tolerated for so long")
    battery_unknown: Literal[LossAction.HOME, LossAction.LAND] = Field(
        LossAction.HOME, description="what to do when the battery's charge is not known any more in flight"
    )
    record_lost: LossAction = Field(
        LossAction.HOME, description="what to do when the flight log cannot be written"
    )
    aisle_open: LossAction = Field(
        LossAction.LAND, description="what to do in flight when the interlock says that an aisle is open"
    )
    expert: HazardExpert = HazardExpert()

    @property
    def heading_rad(self) -> float:
        return math.radians(self.heading_deg)
