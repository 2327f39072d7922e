"""The inventory as EPCIS 2.0 events, the GS1 standard for what was seen where."""

from __future__ import annotations

import json
import uuid
from collections.abc import Sequence
from typing import Any
from urllib.parse import quote

from flightd.core.errors import InputError
from flightd.core.inventory import LocationRecord, Observation
from flightd.core.label_values import LEAST_CONFIDENCE
from flightd.core.utc_time import utc_text
from flightd.inventory.export.gs1_uri import (
    item_uri,
    location_code_uri,
    location_uri,
    place_in,
)
from flightd.inventory.export.value_reports import place_reports, value_reports
from flightd.vision.shelf.digital_link import elements_of
from flightd.vision.shelf.gs1 import Gs1Error

BASE_URI = "urn:x-flightd:"
"""Before what has no URI of GS1."""


def as_epcis(
    records: Sequence[LocationRecord],
    gln: str = "",
    base_uri: str = BASE_URI,
    *,
    least_confidence: float = LEAST_CONFIDENCE,
) -> bytes:
    """EPCIS 2.0 JSON-LD: one ObjectEvent (OBSERVE, cycle_counting) for each location that was looked at.

    GS1 keys become canonical GS1 Digital Link URIs: SSCC, serialised GTIN, GRAI and the like as instances,
    GTIN (with batch) as classes without a quantity, for a label does not tell how much is behind it.  Other
    texts become URIs under `base_uri`.  A location is the GLN (414) and extension (254) that its code or a
    label there says, else its code as an extension of the site's `gln`, else a URI under `base_uri`.

    An event of an empty, unreadable or occluded location has no object: it tells the state as a sensor
    report of the read point (`location_state`), which is the standard's event of a place alone.  One that
    nobody looked at has none.  What is known of the goods and of the place besides is told by sensor reports,
    too (`value_reports`): the standard has ILMD only in events that add an object.  The creation date is that
    of the newest look: the same inventory gives the same document.  InputError for a `gln` that is none, or a
    location code that cannot extend it.
    """
    looked = [(record, record.observation) for record in records if record.observation]
    events = [_event(record, seen, gln, base_uri, least_confidence) for record, seen in looked]
    newest = max((seen.utc_ns for _, seen in looked), default=0)
    document = {
        "@context": ["https://ref.gs1.org/standards/epcis/2.0.0/epcis-context.jsonld"],
        "type": "EPCISDocument",
        "schemaVersion": "2.0",
        "creationDate": utc_text(newest),
        "epcisBody": {"eventList": events},
    }
    return (json.dumps(document, indent=1) + "\n").encode()


def _event(
    record: LocationRecord, seen: Observation, gln: str, base_uri: str, least_confidence: float
) -> dict[str, Any]:
    instances: set[str] = set()
    classes: set[str] = set()
    labels: set[str] = set()
    things: dict[str, str] = {}
    for read in seen.reads:
        item = item_uri(read)
        if item is None and (own := location_uri(elements_of(read))) is not None:
            labels.add(own)
            continue
        uri, is_class = item or (f"{base_uri}code:{quote(read.text, safe='-._~')}", False)
        (classes if is_class else instances).add(uri)
        things[read.text] = uri
    place = {"id": _place(record.code, labels, gln, base_uri)}
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
        event["epcList"] = sorted(instances)
    if classes:
        event["quantityList"] = [{"epcClass": uri} for uri in sorted(classes)]
    reports = value_reports(seen, things, base_uri, least_confidence)
    reports += place_reports(record, seen, base_uri)
    if not instances and not classes:
        reports.insert(0, {"type": f"{base_uri}location_state", "stringValue": seen.state.value})
    if reports:
        event["sensorElementList"] = [{"sensorReport": reports}]
    return event


def _place(code: str, labels: set[str], gln: str, base_uri: str) -> str:
    """The URI of a location; `labels` are what labels there call it, believed where they agree."""
    own = location_code_uri(code)
    if own is not None:
        return own
    if len(labels) == 1:
        return next(iter(labels))
    if not gln:
        return f"{base_uri}location:{quote(code, safe='-._~')}"
    try:
        return place_in(gln, code)
    except Gs1Error as err:
        raise InputError(
            f"location {code} cannot be a place of GLN {gln}: {err}",
            key="--gln",
            remedy="give the 13 digits of the site; codes have at most 20 characters then",
        ) from None
