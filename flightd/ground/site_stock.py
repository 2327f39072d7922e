"""All places of a site as the ground store has them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from flightd.ground.ground_store.pages import MOST_ROWS
from flightd.ground.ground_store.store import GroundStore


def site_stock(store: GroundStore, site: str) -> Iterator[dict[str, Any]]:
    """Every place of the site, as `GroundStore.stock` has it; none where the store does not know it yet."""
    if site not in {one["site"] for one in store.sites()}:
        return
    after = ""
    while rows := store.stock(site, after):
        yield from rows
        if len(rows) < MOST_ROWS:
            return
        after = rows[-1]["location"]
