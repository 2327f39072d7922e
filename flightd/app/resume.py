"""Going on with what the last flight left over."""

from __future__ import annotations

import math
from pathlib import Path

from flightd.adapters.store.progress import NothingLeftError, load_left_over
from flightd.config.mission import VisitOrder
from flightd.config.schema import Config
from flightd.core.errors import InputError
from flightd.core.geometry import wrap_pi
from flightd.site.site import Site


def resumed(config: Config, path: Path, site: Site, *, ordered: bool) -> Config:
    """The configuration of the file `path` with the stops left over in place of its own, if wanted."""
    kept = config.mission.progress
    if ordered and kept is None:
        raise InputError(f"config {path}: mission.progress names no file, so that nothing can be resumed")
    if kept is None or not (ordered or config.mission.resume):
        return config
    try:
        left = load_left_over(kept, site)
    except NothingLeftError:
        if ordered:
            raise
        return config  # the last flight was finished: a new one begins
    update = {
        "nodes": left.remaining,
        "order": VisitOrder.GIVEN,
        "pad": next((pad.id for pad in site.pads if pad.node == left.stand), None),
        "start_yaw_deg": math.degrees(wrap_pi(left.yaw_rad)),
    }
    return config.model_copy(update={"mission": config.mission.model_copy(update=update)})
