"""Are the labels on the shelves large enough in the front camera's picture?"""

from __future__ import annotations

from flightd.config.schema import Config
from flightd.doctor.check import Check, warning
from flightd.mission.plan.flight_plan import counts_shelves
from flightd.mission.scan.legibility import unread_labels
from flightd.site.site import Site


def check_labels(config: Config, site: Site) -> list[Check]:
    """Whether they are read from as near as a stop looks from; nothing where all are, or none is counted."""
    unread = unread_labels(site, config, site.locations) if counts_shelves(config, site) else None
    return [warning("labels", unread.what, unread.remedy)] if unread is not None else []
