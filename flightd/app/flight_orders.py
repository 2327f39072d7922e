"""What the next flight is ordered to do: what its configuration says, or what an earlier one left over."""

from __future__ import annotations

import logging
from collections.abc import Collection, Iterable
from dataclasses import replace
from pathlib import Path

from flightd.adapters.store.progress import NothingLeftError, load_left_over
from flightd.adapters.store.sqlite import SqliteStore
from flightd.config.mission import VisitOrder
from flightd.config.schema import Config
from flightd.core.errors import InputError, UnavailableError
from flightd.core.flight_order import FlightOrder
from flightd.core.geometry import wrap_pi
from flightd.site.site import Site

_LOG = logging.getLogger(__name__)


def configured_order(config: Config) -> FlightOrder:
    """The order that the configuration gives to every flight."""
    mission = config.mission
    return FlightOrder(
        nodes=mission.nodes,
        best_order=mission.order is VisitOrder.BEST,
        pad=mission.pad,
        start_yaw_rad=mission.start_yaw_rad,
        autostart=mission.autostart,
    )


def resumed(
    order: FlightOrder, config: Config, path: Path, site: Site, *, wanted: bool, in_air: bool = False
) -> FlightOrder:
    """The order with the stops left over by the last flight in place of its own, if `wanted` or configured
    in the file `path`.  InputError when nothing can be resumed that is wanted, or the file is none; not where
    the flight may be `in_air` already (the daemon was started anew): then the order stays as it is."""
    kept = config.mission.progress
    if wanted and kept is None and not in_air:
        raise InputError(f"config {path}: mission.progress names no file, so that nothing can be resumed")
    if kept is None or not (wanted or config.mission.resume):
        return order
    try:
        left = load_left_over(kept, site)
    except InputError as err:
        if in_air:
            _LOG.warning("%s", err)
            return order
        if isinstance(err, NothingLeftError) and not wanted:
            return order  # the last flight was finished: a new one begins
        raise
    return replace(
        order,
        nodes=left.remaining,
        best_order=False,
        pad=next((pad.id for pad in site.pads if pad.node == left.stand), None),
        start_yaw_rad=wrap_pi(left.yaw_rad),
    )


def going_on(
    order: FlightOrder, run: str, site: Site, folder: Path | None, *, in_air: bool = False
) -> FlightOrder:
    """The order of a flight that goes on with the count `run` (empty: none) in `folder`: it visits only nodes
    with locations that are not booked yet.  InputError when there are none left, and what the store raises;
    neither where the flight may be `in_air` already (the daemon was started anew)."""
    if not run or folder is None or not (folder / "inventory.db").exists():
        return order
    try:
        with SqliteStore(folder, create=False) as store:
            counted = {place.location for place in store.counted(run)}
    except (InputError, UnavailableError):
        if not in_air:
            raise
        return order
    if not counted:
        return order
    nodes = nodes_to_count(site, order.nodes or site.serpentine_route(), counted)
    if nodes:
        return replace(order, nodes=nodes)
    if in_air:
        return order
    raise InputError(f"inventory.run {run!r}: every location is counted; give the next count another name")


def nodes_to_count(site: Site, nodes: Iterable[str], counted: Collection[str]) -> tuple[str, ...]:
    """Those of some nodes that a flight which goes on with a count must still visit, in their order: the
    ones with a location that is not `counted`."""
    left = {location.node for location in site.locations.values() if location.code not in counted}
    return tuple(node for node in nodes if node in left)
