"""Everything that can be delivered of folders: inventories, flights, and what a station's people decided.

What cannot be delivered is told, and costs the others nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from flightd.adapters.store.unavailable import InventoryUnavailableError
from flightd.core.errors import FlightdError, InputError, UnavailableError
from flightd.ground.decision_book import FILE as DECISIONS
from flightd.ground.decision_book import Decision, DecisionBook
from flightd.ground.flights.log_folder import CUT, find_logs
from flightd.ground.ground_store.sender import (
    Delivered,
    Target,
    deliver_decisions,
    deliver_flights,
    deliver_inventory,
)
from flightd.ground.stores import Stores

_NO_STORES_FAULT = InputError, InventoryUnavailableError


def deliver_paths(paths: Sequence[Path], site: str, source: str, target: Target, done: Delivered) -> None:
    """Each a folder with all below it, an `inventory.db`, or a flight log.

    An inventory is of the site that it says itself, else of that of the flight log beside it, unless `site`
    says another.  What fails, and a path with nothing to deliver, is among the `failures`.  Raises what the
    store cannot do: it would fail with the next one, too."""
    for path in paths:
        with _going_on(path, done):
            _deliver_path(path, site, source, target, done)


def _deliver_path(path: Path, site: str, source: str, target: Target, done: Delivered) -> None:
    root, only = (path, None) if path.is_dir() else (path.parent, path.name)
    stores = Stores(root, all_of_them=only is None)
    inventories = [name for name, _ in reversed(stores.names())] if only in {None, "inventory.db"} else []
    if only is not None:
        inventories = [name for name in inventories if name == "."]
    found = find_logs(root)
    logs = [log for log in found.logs if only in {None, log.relative}]
    if not inventories and not logs:
        raise InputError("holds neither an inventory.db nor a flight log", file=path)
    sites: dict[str, str] = {}
    for name in inventories:
        with _going_on(path, done):
            folder = stores.folder(name)
            sites[name] = site or stores.site_name(name)
            deliver_inventory(folder, sites[name], source, target, done)
    with _going_on(path, done):
        deliver_flights(logs, site, source, target, done, all_expected=only is not None)
    if found.cut and only is None:
        done.failures.append(f"{path}: {CUT}; deliver the folders in it one by one")
    if only is None and (root / DECISIONS).is_file():
        decided: dict[str, list[Decision]] = {}
        with _going_on(path, done, (InputError, UnavailableError)):  # no store is asked
            book = DecisionBook(root)
            decided = {name: book.decisions(name) for name, of_site in sites.items() if of_site}
        for name, decisions in decided.items():
            with _going_on(path, done):
                deliver_decisions(decisions, sites[name], source, target, done)


@contextmanager
def _going_on(
    path: Path, done: Delivered, ours: tuple[type[FlightdError], ...] = _NO_STORES_FAULT
) -> Iterator[None]:
    """What goes wrong with one is told, and the next one's turn comes."""
    try:
        yield
    except OSError as err:
        done.failures.append(f"{err.filename or path}: {err.strerror or err}")
    except ours as err:
        done.failures.append(str(err))
