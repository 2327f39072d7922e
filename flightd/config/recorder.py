"""The flight recorder's section of the configuration."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from flightd.config.section import Section


class RecorderConfig(Section):
    """The black box."""

    folder: Path | None = Field(None, description="where flights are recorded; none: not at all")
    quota_gb: float = Field(20.0, gt=0, le=100_000, description="most that all flights may take; oldest go")
    reserve_gb: float = Field(1.0, ge=0, le=100_000, description="least that stays free on the disk")
    picture_fps: float = Field(2.0, ge=0, le=60, description="pictures recorded per second")
