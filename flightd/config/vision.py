"""The section of the configuration on finding lines in the down camera's frames."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from flightd.config.section import Section


class VisionConfig(Section):
    """How lines are found, and by how many processes."""

    method: Literal["combined", "centroid", "skeleton", "naive"] = Field(
        "combined", description="line detector"
    )
    profile: str | None = Field(
        None, description="colour profile: a shipped name or a file; none: the site's line colour"
    )
    workers: int = Field(2, ge=1, le=16, description="detector processes")
    timeout_s: float = Field(
        0.5, gt=0.01, le=5, description="a detector that takes longer is killed and replaced"
    )
