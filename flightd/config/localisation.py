"""The section of the configuration on finding the node that the drone is over."""

from __future__ import annotations

from pydantic import Field

from flightd.config.section import Section, unit


class LocalisationExpert(Section):
    """What the filter over the places starts from and how it doubts."""

    start_sigma_m: float = Field(0.15, gt=0, le=2, description="sigma of the position on the pad")
    carried: float = Field(
        0.1,
        ge=0,
        le=1,
        description="odds of standing on one certain other node nearby against standing on the start node: "
        "more than what is tolerated of a position that is told, so that only what is seen makes it sure",
        json_schema_extra=unit("odds"),
    )
    carried_m: float = Field(
        3.0, gt=0, le=100, description="at this distance from the start node those odds have halved"
    )
    by_features_m: float = Field(
        3.0,
        ge=0,
        le=20,
        description="way (a hover counts as 0.1 m/s) over which features of the floor, or a line that the "
        "map lacks, may carry the position on without a line across an axis",
    )
    most_places: int = Field(48, ge=4, le=1000, description="places that are told apart at once, at most")
    slip: float = Field(
        2e-4,
        ge=0,
        le=0.1,
        description="of being one cell off, to each neighbour, at each new node",
        json_schema_extra=unit("probability"),
    )
    slip_in_gap: float = Field(
        5e-3,
        ge=0,
        le=0.5,
        description="the same after a gap without lines",
        json_schema_extra=unit("probability"),
    )
    elsewhere: float = Field(
        1e-5,
        ge=0,
        le=0.1,
        description="of being at no place that is thought of",
        json_schema_extra=unit("probability"),
    )
    due_s: float = Field(
        0.5, gt=0, le=10, description="paint in sure view for so long is seen, or is not there"
    )
    max_sigma_m: float = Field(
        1.2, gt=0, le=10, description="a position less certain than this is none to fly by"
    )


class LocalisationConfig(Section):
    """How the drone's place on the grid is known and doubted."""

    expert: LocalisationExpert = LocalisationExpert()
