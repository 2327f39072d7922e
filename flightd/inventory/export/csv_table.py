"""The inventory as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

from flightd.core.csv_text import inert
from flightd.core.inventory import LocationRecord
from flightd.core.label_values import LEAST_CONFIDENCE
from flightd.inventory.export.rows import COLUMNS, rows_of


def as_csv(records: Sequence[LocationRecord], least_confidence: float = LEAST_CONFIDENCE) -> bytes:
    """RFC 4180 with a heading line, UTF-8; texts are inert cells (`core.csv_text`)."""
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(COLUMNS)
    writer.writerows(
        [inert(value) if isinstance(value, str) else value for value in row]
        for row in rows_of(records, least_confidence)
    )
    return out.getvalue().encode()
