"""The section of the configuration on finding lines in the down camera's frames."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Literal, Self

from pydantic import Field

from flightd.config.section import Section


class VisionConfig(Section):
    """How lines are found, and by how many processes."""

    method: Literal["combined", "centroid", "skeleton", "naive"] = Field(
        "combined", description="line detector"
    )
    profile: str | None = Field(
        None,
        description="colour profile: a shipped name, or a file beside this one; none: of the site's paint",
    )
    workers: int = Field(2, ge=1, le=16, description="detector processes")
    timeout_s: float = Field(
        0.5, gt=0.01, le=5, description="a detector that takes longer is killed and replaced"
    )

    def beside(self, folder: Path) -> Self:
        """The profile's file taken from `folder` where it lies there; a shipped name stays one."""
        with contextlib.suppress(OSError):  # a text that can be no file's name
            if self.profile is not None and (folder / self.profile).is_file():
                return self.model_copy(update={"profile": str((folder / self.profile).resolve())})
        return self
