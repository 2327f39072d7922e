"""Odoo's stock as a file for the drop folder of `flightd store exchange`."""

from __future__ import annotations

import csv
import io
from contextlib import closing
from pathlib import Path

from flightd.core.csv_text import inert
from flightd.core.errors import InputError
from flightd.ground.shared_folder import SharedFolder
from flightd.inventory.stock_table import MOST_BYTES, MOST_ROWS
from tools.odoo.stock import OdooStock

NAME = "odoo-stock.csv"
"""Always this: one that was not taken yet is replaced by the newer one."""
COLUMNS = ("place", "code", "quantity")


def expected_csv(stock: OdooStock) -> bytes:
    """A line for each label, one without code for each place where nothing may be.  InputError where that is
    more than a station takes."""
    out = io.StringIO()
    writer = csv.writer(out, delimiter=";", lineterminator="\r\n")
    writer.writerow(COLUMNS)
    rows = [(one.place, one.code, _number(one.quantity)) for one in stock.lying]
    filled = {place for place, _, _ in rows} | stock.untold
    rows += [(place, "", "") for place in stock.places if place not in filled]
    writer.writerows([inert(cell) for cell in row] for row in sorted(rows))
    data = out.getvalue().encode()
    if len(rows) > MOST_ROWS or len(data) > MOST_BYTES:
        raise InputError(
            f"{len(rows)} rows, {len(data)} bytes; a station takes {MOST_ROWS} and {MOST_BYTES}",
            key="odoo.location",
            remedy="name a smaller part of the warehouse",
        )
    return data


def drop_expected(stock: OdooStock, inbox: str, file: Path) -> str:
    """Into the inbox, whole or not at all; what was dropped, in a line."""
    data = expected_csv(stock)
    with closing(SharedFolder(inbox, file, "expected.inbox", what="python -m tools.odoo expected")) as folder:
        folder.write(NAME, data)
    return f"{NAME}: {len(stock.lying)} labels at {len(stock.places)} places"


def _number(quantity: float | None) -> str:
    return "" if quantity is None else f"{quantity:.6f}".rstrip("0").rstrip(".")
