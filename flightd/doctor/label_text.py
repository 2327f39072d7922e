"""Is there what reads the printed text on labels?"""

from __future__ import annotations

from flightd.config.schema import Config
from flightd.doctor.check import Check, warning
from flightd.vision.shelf.text_reader import needs_extra


def check_text(config: Config) -> list[Check]:
    """Whether printed text can be read; nothing where it can, or none is wanted."""
    missing = needs_extra() if config.scan.text else None
    return [warning("text", missing.what, missing.remedy)] if missing is not None else []
