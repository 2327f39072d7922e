"""The inventory's section of the configuration."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from pydantic import Field

from flightd.config.section import Section


class InventoryConfig(Section):
    """Where the count is kept."""

    files: ClassVar = ("folder",)

    folder: Path | None = Field(
        None,
        description="folder of the inventory (`flightd inventory`), relative to this file; none: not kept",
    )
    run: str = Field(
        "",
        max_length=80,
        description="name of the count; a flight of the same name goes on where the last one ended; "
        "empty: each flight is a count of its own",
    )
