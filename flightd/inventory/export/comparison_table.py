"""The comparison with the books as a table and as a document, for other programs."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from dataclasses import asdict

from flightd.core.csv_text import inert
from flightd.inventory.comparison import Difference, comparison_document
from flightd.inventory.uploaded_stock import UploadedStock

_COLUMNS = ("outcome", "location", "code", "quantity", "found", "found_at", "confidence")


def comparison_csv(lines: Sequence[Difference], stock: UploadedStock) -> bytes:
    """RFC 4180 with a heading line, UTF-8; a row for each line, texts as inert cells."""
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(_COLUMNS)
    for line in lines:
        quantity = stock.quantity(line.location, line.text)
        texts = (line.outcome.value, line.location, line.text, quantity, line.found, line.found_at)
        writer.writerow([*map(inert, texts), line.confidence])
    return out.getvalue().encode()


def comparison_json(lines: Sequence[Difference], stock: UploadedStock) -> bytes:
    """As `flightd inventory compare --json` has it, with the quantities of the books and what of them could
    not be used."""
    document = comparison_document(lines, {}, ())
    told = [{**asdict(line), "quantity": stock.quantity(line.location, line.text)} for line in lines]
    whole = {"outcomes": document["outcomes"], "lines": told, "left_out": stock.problems}
    return (json.dumps(whole, indent=1, ensure_ascii=False) + "\n").encode()
