"""Everything that can be delivered of a folder: inventories, flights, and what a station's people decided."""

from __future__ import annotations

from pathlib import Path

from flightd.core.errors import InputError
from flightd.ground.decision_book import FILE as DECISIONS
from flightd.ground.decision_book import DecisionBook
from flightd.ground.flights.log_folder import find_logs
from flightd.ground.ground_store.sender import (
    Delivered,
    Target,
    deliver_decisions,
    deliver_flights,
    deliver_inventory,
)
from flightd.ground.stores import Stores


def deliver_path(path: Path, site: str, source: str, target: Target, done: Delivered) -> None:
    """A folder with all below it, an `inventory.db`, or a flight log.

    Each inventory is of the site of the flight log beside it, unless `site` says another.  InputError where
    neither is known, and for a path with nothing to deliver."""
    root, only = (path, None) if path.is_dir() else (path.parent, path.name)
    stores = Stores(root)
    inventories = [name for name, _ in reversed(stores.names())] if only in {None, "inventory.db"} else []
    if only is not None:
        inventories = [name for name in inventories if name == "."]
    logs = [log for log in find_logs(root).logs if only in {None, log.relative}]
    if not inventories and not logs:
        raise InputError("holds neither an inventory.db nor a flight log", file=path)
    for name in inventories:
        folder = stores.folder(name)
        deliver_inventory(folder, _site_of(stores, name, site), source, target, done)
    deliver_flights(logs, site, source, target, done)
    if only is None and (root / DECISIONS).is_file():
        book = DecisionBook(root)
        for name in inventories:
            deliver_decisions(book.decisions(name), _site_of(stores, name, site), source, target, done)


def _site_of(stores: Stores, name: str, given: str) -> str:
    site = given or stores.site_name(name)
    if not site:
        raise InputError(
            "no flight log beside the inventory says of which site it is",
            file=stores.folder(name),
            remedy="add --site NAME",
        )
    return site
