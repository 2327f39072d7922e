"""The inventory as rows of a table, for the formats that are tables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from flightd.core.inventory import LocationRecord, Observation
from flightd.core.label_values import LEAST_CONFIDENCE
from flightd.core.types import CodeRead
from flightd.core.utc_time import utc_text
from flightd.inventory.export.value_columns import UNKNOWN, VALUE_COLUMNS, value_cells
from flightd.inventory.place_values import code_values, place_values

FILL_COLUMNS: Final = ("fill", "overhang_m", "lean_m", "cases", "case_columns", "case_rows")
DEPTH_COLUMNS: Final = ("pallets_deep", "pallets_seen")
UNDECIDED_COLUMNS: Final = ("undecided", "undecided_looks")
COLUMNS: Final = (
    "location", "state", "text", "symbology", "gs1", "confidence", "utc", "run", "node", "x_m", "y_m",
    "height_m", "evidence", *VALUE_COLUMNS, *FILL_COLUMNS, *DEPTH_COLUMNS,
    *UNDECIDED_COLUMNS,
)  # fmt: skip


def rows_of(
    records: Sequence[LocationRecord], least_confidence: float = LEAST_CONFIDENCE
) -> list[list[str | float]]:
    """One row for each code at a location, one without code for the others.

    Where there are several codes each has its own values, else what is known of the place."""
    rows: list[list[str | float]] = []
    for record in records:
        seen = record.observation
        reads: Sequence[CodeRead | None] = (seen.reads if seen else ()) or (None,)
        pose = seen.pose if seen else None
        told = {read.text if read else "": read for read in reads}
        for text, read in told.items():
            if seen and read and len(told) > 1:
                values = code_values(read, seen, least_confidence)
            else:
                values = place_values(seen, least_confidence)
            gs1 = "".join(f"({ai}){value}" for ai, value in read.gs1) if read else ""
            rows.append(
                [
                    record.code, record.state.value, text, read.symbology if read else "", gs1,
                    seen.confidence if seen else "", utc_text(seen.utc_ns) if seen else "",
                    seen.run if seen else "", record.node, pose.x_m if pose else "",
                    pose.y_m if pose else "", pose.height_m if pose else "", seen.evidence if seen else "",
                    *value_cells(values), *fill_cells(seen), record.pallets_deep,
                    record.pallets_seen, *undecided_cells(seen),
                ]
            )  # fmt: skip
    return rows


def undecided_cells(seen: Observation | None) -> list[str | float]:
    """A cell for each of `UNDECIDED_COLUMNS`: what stayed in doubt beside the codes, several behind one
    another with " | " between, and in how many pictures each was seen."""
    codes = seen.undecided if seen else ()
    return [" | ".join(code.text for code in codes), " | ".join(str(code.looks) for code in codes)]


def fill_cells(seen: Observation | None) -> list[str | float]:
    """A cell for each of `FILL_COLUMNS`: how full the place is, 0 to 1, the overhang, how much goods lean,
    the cases in the front; empty where it was not asked, and nothing leans where nothing stands."""
    if seen is None or seen.fill is None:
        return [""] * len(FILL_COLUMNS)
    share, overhang_m, lean_m = seen.fill.share, seen.fill.overhang_m, seen.fill.lean_m
    unknown, cases = "" if share == 0.0 else UNKNOWN, seen.fill.cases
    return [
        UNKNOWN if share is None else share,
        "" if overhang_m is None else overhang_m,
        unknown if lean_m is None else lean_m,
        *((cases.count, cases.columns, cases.rows) if cases else (unknown, "", "")),
    ]
