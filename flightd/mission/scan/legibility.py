"""Whether labels are read at all: where the drone stops before them and looks from nearby.  Pure."""

from __future__ import annotations

from collections.abc import Iterable

from flightd.config.scan import ScanConfig
from flightd.config.schema import Config
from flightd.core.planned_flight import UnreadLabels
from flightd.site.coverage import FrontView, Legibility, too_small
from flightd.site.site import Site

LEGIBILITY_WORDS = {
    Legibility.SURE: "labels are read",
    Legibility.UNSURE: "labels are not surely read",
    Legibility.NONE: "labels cannot be read",
}


def nearest_look_m(distance_m: float, params: ScanConfig) -> float:
    """How near to a shelf at that distance from the aisle's line a re-take looks from."""
    room_m = max(0.0, distance_m - params.clearance_m)
    return distance_m - min(params.step_m, room_m) if params.retakes else distance_m


def unread_labels(site: Site, config: Config, locations: Iterable[str]) -> UnreadLabels | None:
    """Those of some locations whose labels are not surely read by stopping either; None: there are none."""
    view = FrontView.of(config.front_camera, config.scan.sweep.module_m)
    places = (site.locations[code] for code in locations)
    distances_m = [abs(place.y_m - site.nodes[place.node].y_m) for place in places]
    looks = [(view.legibility(nearest_look_m(one, config.scan)), one) for one in distances_m]
    unread_m = [distance_m for legibility, distance_m in looks if legibility is not Legibility.SURE]
    if not unread_m:
        return None
    farthest_m = max(unread_m)
    legibility = view.legibility(nearest_look_m(farthest_m, config.scan))
    return UnreadLabels(
        places=len(unread_m),
        px_per_module=round(view.px_per_module(farthest_m), 3),
        within_m=round(view.reading_distance_m(), 3),
        what=f"{len(unread_m)} places: {LEGIBILITY_WORDS[legibility]}",
        remedy=too_small(view.px_per_module(farthest_m), view.reading_distance_m()),
    )
