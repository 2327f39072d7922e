"""All that the page Stock needs of the station."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from starlette.routing import BaseRoute

from flightd.ground.decision_routes import decision_routes
from flightd.ground.expected_stock_routes import expected_stock_routes
from flightd.ground.read_folders import ReadFolder
from flightd.ground.reading_process import ReadingProcess
from flightd.ground.stock_routes import CountingDrone, StockAnswers, stock_routes
from flightd.ground.stores import Stores


def stock_page(
    folder: Path | None,
    drones: Mapping[str, CountingDrone],
    reading: ReadingProcess,
    others: Sequence[ReadFolder] = (),
) -> list[BaseRoute]:
    """Its routes, over the inventories under `folder` and the `others`, and what the drones tell that they
    have counted; uploads are read in `reading`."""
    asked = StockAnswers(Stores(folder, others), drones)
    return [
        *stock_routes(asked),
        *expected_stock_routes(asked, reading, folder),
        *decision_routes(asked, folder),
    ]
