"""The hazards' section of the configuration: when something counts as wrong."""

from __future__ import annotations

import math

from pydantic import Field

from flightd.config.section import Section
from flightd.mission.guidance import HazardParams, LossAction

_PARAMS = HazardParams()


class HazardConfig(Section):
    """Thresholds and times of the hazards that have no place elsewhere.  Lengths in m, times in s."""

    heartbeat_land_s: float = Field(
        _PARAMS.heartbeat_land_s, ge=2, le=60, description="no heartbeat for so long: land"
    )
    height_share: float = Field(
        _PARAMS.height_share,
        gt=0.1,
        le=1,
        description="lines' width against the map's: height is wrong",
    )
    heading_deg: float = Field(
        math.degrees(_PARAMS.heading_rad), ge=2, le=40, description="lines against the vehicle's heading"
    )
    disagree_s: float = Field(
        _PARAMS.disagree_s, gt=0, le=10, description="height or heading disagree for so long"
    )
    push_mps2: float = Field(
        _PARAMS.push_mps2, gt=0.1, le=5, description="steady push (wind, trim) that can be borne"
    )
    off_m: float = Field(
        _PARAMS.off_m, gt=0.1, le=5, description="distance from the reference that can be borne"
    )
    push_s: float = Field(_PARAMS.push_s, gt=0, le=60, description="push or distance borne for so long")
    headroom_m: float = Field(_PARAMS.headroom_m, ge=0.1, le=5, description="kept below the site's ceiling")
    corridor_m: float = Field(
        _PARAMS.corridor_m,
        ge=0.3,
        le=5,
        description="free way to both sides of every painted line of the map",
    )
    latency_s: float = Field(
        _PARAMS.latency_s, ge=0.05, le=2, description="p99 from exposure to the wire that can be flown by"
    )
    overload_s: float = Field(
        _PARAMS.overload_s, ge=0.5, le=60, description="latency or late ticks borne for so long"
    )
    brake_s: float = Field(
        _PARAMS.brake_s, ge=0, le=2.4, description="velocity is reckoned on for so long without lines"
    )
    search_s: float = Field(
        _PARAMS.search_s, ge=0, le=60, description="lines lost for so long: climb to see more"
    )
    search_climb_m: float = Field(
        _PARAMS.search_climb_m, ge=0, le=0.5, description="by how much, below the ceiling"
    )
    search_land_s: float = Field(
        _PARAMS.search_land_s, ge=0.3, le=60, description="pictures without lines for so long: land"
    )
    blind_land_s: float = Field(
        _PARAMS.blind_land_s, ge=0.3, le=60, description="nothing seen at all for so long: land"
    )
    blind_m: float = Field(
        _PARAMS.blind_m, ge=0.2, le=20, description="with nothing seen sink at once, down to here"
    )
    record_lost: LossAction = Field(
        _PARAMS.record_lost, description="when the flight log cannot be written: continue, hold, home or land"
    )

    def params(self) -> HazardParams:
        same = self.model_dump(exclude={"heading_deg"})
        return HazardParams(heading_rad=math.radians(self.heading_deg), **same)
