"""The count of a simulated flight: `inventory.csv`, and how good it was against the truth."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

from flightd.adapters.store.for_reading import opened_for_reading
from flightd.app.simulation.meant_flight import MeantFlight
from flightd.app.simulation.simulation import Simulation, truth_of
from flightd.core.csv_text import inert
from flightd.core.inventory import LocationRecord
from flightd.core.utc_time import utc_text
from flightd.inventory.export.rows import (
    DEPTH_COLUMNS,
    FILL_COLUMNS,
    UNDECIDED_COLUMNS,
    fill_cells,
    undecided_cells,
)
from flightd.sim.racks.stock_truth import score_stock

_COLUMNS = (
    "location", "node", "state", "texts", "symbology", "confidence", "utc", "x_m", "y_m", "height_m", "run",
    "evidence", *FILL_COLUMNS, *DEPTH_COLUMNS, *UNDECIDED_COLUMNS,
)  # fmt: skip


def inventory_csv(folder: Path) -> bytes | None:
    """One line for each location of the inventory in `folder`, several texts behind one another with
    " | " between, all of it inert (`core.csv_text`); None where there is no inventory."""
    records = _records(folder)
    if records is None:
        return None
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(_COLUMNS)
    writer.writerows(
        [inert(value) if isinstance(value, str) else value for value in _row(record)] for record in records
    )
    return out.getvalue().encode()


def stock_summary(simulation: Simulation, meant: MeantFlight, flight_time_s: float) -> dict[str, Any]:
    """The summary's part on codes and places, over the locations that were to be counted."""
    truth, records = truth_of(simulation), _records(simulation.folder)
    if not truth or records is None:
        return {"codes_expected": 0, "codes_read": 0, "codes_wrong": 0, "locations_per_hour": 0.0}
    at = simulation.site.locations
    planned = {
        code
        for code, place in truth.items()
        if place.node in meant.plan.to_visit and meant.choice.takes(place.node, at[code].side, at[code].level)
    }
    scored = score_stock(truth, records, planned).as_summary()
    hours = flight_time_s / 3600
    return scored | {"locations_per_hour": round(scored["locations_visited"] / hours, 1) if hours else 0.0}


def _records(folder: Path) -> list[LocationRecord] | None:
    if not (folder / "inventory.db").exists():
        return None
    with opened_for_reading(folder, untouched=True) as store:
        return store.locations()


def _row(record: LocationRecord) -> list[str | float]:
    seen = record.observation
    last = record.pallets_deep, record.pallets_seen, *undecided_cells(seen)
    if seen is None:
        empty = [""] * (len(_COLUMNS) - 3 - len(last))
        return [record.code, record.node, record.state.value, *empty, *last]
    pose = seen.pose
    symbologies = dict.fromkeys(read.symbology for read in seen.reads)
    where = (pose.x_m, pose.y_m, pose.height_m) if pose else ("", "", "")
    return [
        record.code,
        record.node,
        record.state.value,
        " | ".join(record.texts),
        " | ".join(symbologies),
        seen.confidence,
        utc_text(seen.utc_ns),
        *(round(value, 3) if isinstance(value, float) else value for value in where),
        seen.run,
        seen.evidence,
        *fill_cells(seen),
        *last,
    ]
