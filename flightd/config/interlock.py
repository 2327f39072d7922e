"""The interlock's section of the configuration: what tells that the aisles are closed to people."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from pydantic import Field

from flightd.config.section import Section


class InterlockConfig(Section):
    """What says that the aisles are closed to people: a GPIO's value, or what a door's controller writes.
    Nothing arms without it where it is named here; a site may demand it (`interlock`).  A file that cannot
    be read says that they are open."""

    files: ClassVar = ("file",)

    file: Path | None = Field(
        None,
        description="read ten times a second, relative to this file; none: there is no interlock",
    )
    closed: str = Field(
        "1", min_length=1, max_length=40, description="its content while the aisles are closed"
    )
    max_age_s: float | None = Field(
        None,
        gt=0,
        description="it was written within so long, else the aisles are open; none: whenever.  For a "
        "file that a controller writes again and again, not for a GPIO's value",
    )
