"""The inventory as CSV, XLSX, JSON and EPCIS 2.0."""

from __future__ import annotations

import csv
import io
import json
import uuid
from collections.abc import Callable, Sequence
from datetime import UTC, datetime, timedelta
from typing import Any, Final
from urllib.parse import quote

from flightd.core.csv_text import inert
from flightd.core.errors import UnavailableError
from flightd.core.inventory import LocationRecord, Observation, StoredRead

_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
_GTIN = {"EAN-13": 13, "EAN-8": 8, "UPC-A": 12, "UPC-E": 12, "ITF-14": 14}
_COLUMNS = (
    "location", "state", "text", "symbology", "gs1", "confidence", "utc", "run", "node", "x_m", "y_m",
    "height_m", "evidence",
)  # fmt: skip


def utc_text(utc_ns: int) -> str:
    """ISO 8601 with milliseconds and Z."""
    at = _EPOCH + timedelta(microseconds=utc_ns // 1000)
    return at.isoformat(timespec="milliseconds").replace("+00:00", "Z")


def _rows(records: Sequence[LocationRecord]) -> list[list[str | float]]:
    """One row for each code at a location, one without code for the others."""
    rows: list[list[str | float]] = []
    for record in records:
        seen = record.observation
        reads: Sequence[StoredRead | None] = (seen.reads if seen else ()) or (None,)
        pose = seen.pose if seen else None
        told = {read.text if read else "": read for read in reads}
        for text, read in told.items():
            gs1 = "".join(f"({ai}){value}" for ai, value in read.gs1) if read else ""
            rows.append(
                [
                    record.code, record.state.value, text, read.symbology if read else "", gs1,
                    seen.confidence if seen else "", utc_text(seen.utc_ns) if seen else "",
                    seen.run if seen else "", record.node, pose.x_m if pose else "",
                    pose.y_m if pose else "", pose.height_m if pose else "", seen.evidence if seen else "",
                ]
            )  # fmt: skip
    return rows


def as_csv(records: Sequence[LocationRecord]) -> bytes:
    """RFC 4180 with a heading line, UTF-8; texts are inert cells (`core.cells`)."""
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(_COLUMNS)
    writer.writerows(
        [inert(value) if isinstance(value, str) else value for value in row] for row in _rows(records)
    )
    return out.getvalue().encode()


def as_xlsx(records: Sequence[LocationRecord]) -> bytes:
    """One sheet with a filter; what labels say is exact text, never a formula, nor when the cell is edited.
    Needs the extra `xlsx`."""
    try:
        import xlsxwriter
    except ImportError:
        raise UnavailableError("XLSX needs XlsxWriter: pip install 'flightd[xlsx]'") from None
    out = io.BytesIO()
    book = xlsxwriter.Workbook(out, {"in_memory": True})
    sheet = book.add_worksheet("inventory")
    rows = _rows(records)
    bold = book.add_format({"bold": True})
    text = book.add_format({"num_format": "@", "quote_prefix": True})
    for column, name in enumerate(_COLUMNS):
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
    sheet.autofilter(0, 0, max(1, len(rows)), len(_COLUMNS) - 1)
    book.close()
    return out.getvalue()


def location_json(record: LocationRecord) -> dict[str, object]:
    """One location with all that is known of it."""
    seen = record.observation
    return {
        "location": record.code,
        "state": record.state.value,
        "node": record.node,
        "texts": list(record.texts),
        "observation": observation_json(seen) if seen else None,
    }


def observation_json(seen: Observation) -> dict[str, object]:
    """One look at a location."""
    pose = seen.pose
    return {
        "utc": utc_text(seen.utc_ns),
        "run": seen.run,
        "state": seen.state.value,
        "confidence": seen.confidence,
        "evidence": seen.evidence,
        "pose": pose
        and {
            "node": pose.node,
            "x_m": pose.x_m,
            "y_m": pose.y_m,
            "height_m": pose.height_m,
            "yaw_rad": pose.yaw_rad,
        },
        "reads": [
            {
                "symbology": read.symbology,
                "text": read.text,
                "checksum": read.sure,
                "agreeing": read.agreeing,
                "quality": read.quality,
                "gs1": dict(read.gs1),
            }
            for read in seen.reads
        ],
    }


def as_json(records: Sequence[LocationRecord]) -> bytes:
    """Every location with its newest look."""
    document = {"locations": [location_json(record) for record in records]}
    return (json.dumps(document, indent=1, ensure_ascii=False) + "\n").encode()


def as_epcis(records: Sequence[LocationRecord], base_uri: str = "urn:x-flightd:") -> bytes:
    """EPCIS 2.0 JSON-LD: one ObjectEvent (OBSERVE, cycle_counting) for each location with codes.

    GS1 keys become GS1 Digital Link URIs: SSCC and serialised GTIN as instances, GTIN (with batch) as
    classes without a quantity, for a label does not tell how much is behind it.  Other texts and the
    locations become URIs under `base_uri`.  EPCIS has no event for an empty or unread location.
    The creation date is that of the newest look: the same inventory gives the same document.
    """
    looked = [(record, record.observation) for record in records if record.observation]
    events = [_event(record, seen, base_uri) for record, seen in looked if seen.reads]
    newest = max((seen.utc_ns for _, seen in looked), default=0)
    document = {
        "@context": ["https://ref.gs1.org/standards/epcis/2.0.0/epcis-context.jsonld"],
        "type": "EPCISDocument",
        "schemaVersion": "2.0",
        "creationDate": utc_text(newest),
        "epcisBody": {"eventList": events},
    }
    return (json.dumps(document, indent=1) + "\n").encode()


def _event(record: LocationRecord, seen: Observation, base_uri: str) -> dict[str, Any]:
    instances: list[str] = []
    classes: list[str] = []
    for read in {read.text: read for read in seen.reads}.values():
        uri, is_class = _epc(read, base_uri)
        (classes if is_class else instances).append(uri)
    place = {"id": f"{base_uri}location:{quote(record.code, safe='-._~')}"}
    event: dict[str, Any] = {
        "type": "ObjectEvent",
        "eventID": f"urn:uuid:{uuid.UUID(seen.id[:32], version=5)}",
        "eventTime": utc_text(seen.utc_ns),
        "eventTimeZoneOffset": "+00:00",
        "action": "OBSERVE",
        "bizStep": "cycle_counting",
        "readPoint": place,
        "bizLocation": place,
    }
    if instances:
        event["epcList"] = sorted(set(instances))
    if classes:
        event["quantityList"] = [{"epcClass": uri} for uri in sorted(set(classes))]
    return event


def _epc(read: StoredRead, base_uri: str) -> tuple[str, bool]:
    """The URI of what a code names, and whether it names a class rather than one thing."""
    elements = dict(read.gs1)
    if "00" in elements:
        return f"https://id.gs1.org/00/{elements['00']}", False
    if "01" in elements:
        uri = f"https://id.gs1.org/01/{elements['01']}"
        if "21" in elements:
            return f"{uri}/21/{quote(elements['21'], safe='')}", False
        return (f"{uri}/10/{quote(elements['10'], safe='')}" if "10" in elements else uri), True
    if len(read.text) == _GTIN.get(read.symbology) and read.text.isdecimal():
        return f"https://id.gs1.org/01/{read.text.zfill(14)}", True
    return f"{base_uri}code:{quote(read.text, safe='-._~')}", False


FORMATS: Final[dict[str, Callable[[Sequence[LocationRecord]], bytes]]] = {
    "csv": as_csv,
    "xlsx": as_xlsx,
    "json": as_json,
    "epcis": as_epcis,
}
"""By the name that `--format` takes."""
