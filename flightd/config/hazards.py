"""The hazards' section of the configuration: when something counts as wrong."""

from __future__ import annotations

import math

from pydantic import Field

from flightd.config.section import Section
from flightd.mission.guidance import HazardParams, LossAction


class HazardConfig(Section):
    """Thresholds and times of the hazards that have no place elsewhere.  Lengths in m, times in s."""

    heartbeat_land_s: float = Field(5.0, ge=2, le=60, description="no heartbeat for so long: land")
    height_share: float = Field(
        0.35,
        gt=0.1,
        le=1,
        description="lines' width against the map's: height is wrong",
    )
    heading_deg: float = Field(5.0, ge=2, le=40, description="lines against the vehicle's heading")
    disagree_s: float = Field(0.4, gt=0, le=10, description="height or heading disagree for so long")
    push_mps2: float = Field(0.8, gt=0.1, le=5, description="steady push (wind, trim) that can be borne")
    off_m: float = Field(0.5, gt=0.1, le=5, description="distance from the reference that can be borne")
    push_s: float = Field(2.0, gt=0, le=60, description="push or distance borne for so long")
    headroom_m: float = Field(0.5, ge=0.1, le=5, description="kept below the site's ceiling")
    corridor_m: float = Field(
        0.45, ge=0.3, le=5, description="free way to both sides of every painted line of the map"
    )
    latency_s: float = Field(
        0.25, ge=0.05, le=2, description="p99 from exposure to the wire that can be flown by"
    )
    overload_s: float = Field(3.0, ge=0.5, le=60, description="latency or late ticks borne for so long")
    brake_s: float = Field(2.4, ge=0, le=2.4, description="velocity is reckoned on for so long without lines")
    search_s: float = Field(0.0, ge=0, le=60, description="lines lost for so long: climb to see more")
    search_climb_m: float = Field(0.3, ge=0, le=0.5, description="by how much, below the ceiling")
    search_land_s: float = Field(1.4, ge=0.3, le=60, description="pictures without lines for so long: land")
    blind_land_s: float = Field(2.2, ge=0.3, le=60, description="nothing seen at all for so long: land")
    blind_m: float = Field(0.5, ge=0.2, le=20, description="with nothing seen sink at once, down to here")
    record_lost: LossAction = Field(
        LossAction.HOME, description="when the flight log cannot be written: continue, hold, home or land"
    )

    def params(self) -> HazardParams:
        same = self.model_dump(exclude={"heading_deg"})
        return HazardParams(heading_rad=math.radians(self.heading_deg), **same)
