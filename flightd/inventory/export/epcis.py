"""The inventory as EPCIS 2.0 events, the GS1 standard for what was seen where."""

from __future__ import annotations

import json
import uuid
from collections.abc import Sequence
from typing import Any, Final
from urllib.parse import quote

from flightd.core.inventory import LocationRecord, Observation
from flightd.core.types import CodeRead
from flightd.core.utc_time import utc_text

_GTIN: Final = {"EAN-13": 13, "EAN-8": 8, "UPC-A": 12, "UPC-E": 12, "ITF-14": 14}


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


def _epc(read: CodeRead, base_uri: str) -> tuple[str, bool]:
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
