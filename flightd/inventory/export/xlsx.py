"""The inventory as an Excel workbook."""

from __future__ import annotations

import io
from collections.abc import Sequence

from flightd.core.csv_text import inert
from flightd.core.extras import missing_extra
from flightd.core.inventory import LocationRecord
from flightd.core.label_values import LEAST_CONFIDENCE
from flightd.inventory.export.rows import COLUMNS, rows_of


def as_xlsx(records: Sequence[LocationRecord], least_confidence: float = LEAST_CONFIDENCE) -> bytes:
    """One sheet with a filter; what labels say is exact text, never a formula, nor when the cell is edited.
    Needs the extra `xlsx`."""
    try:
        import xlsxwriter
    except ImportError:
        raise missing_extra("xlsx", "the XLSX export") from None
    out = io.BytesIO()
    book = xlsxwriter.Workbook(out, {"in_memory": True})
    sheet = book.add_worksheet("inventory")
    rows = rows_of(records, least_confidence)
    bold = book.add_format({"bold": True})
    text = book.add_format({"num_format": "@", "quote_prefix": True})
    for column, name in enumerate(COLUMNS):
        sheet.write_string(0, column, name, bold)
        width = max([len(name), *(len(str(row[column])) for row in rows)])
        sheet.set_column(column, column, min(60, width + 2))
    for number, row in enumerate(rows, start=1):
        for column, value in enumerate(row):
            if isinstance(value, str):
                sheet.write_string(number, column, value, text if inert(value) != value else None)
            else:
                sheet.write_number(number, column, value)
    sheet.freeze_panes(1, 1)
    sheet.autofilter(0, 0, max(1, len(rows)), len(COLUMNS) - 1)
    book.close()
    return out.getvalue()
