"""The files that maps are exchanged as with other programs: their kinds, and what they hold."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from flightd.core.errors import InputError
from flightd.site.exchange.graph import Imported
from flightd.site.exchange.lif import lif_document, tables_of_lif
from flightd.site.exchange.lif_onto import lif_onto
from flightd.site.exchange.node_table import locations_csv, nodes_csv
from flightd.site.floor_plan_svg import draw_site
from flightd.site.site import Site

MOST_BYTES: Final = 8_000_000
"""Of a file that is imported."""


@dataclass(frozen=True, slots=True)
class MapFormat:
    """A kind of file that a map is given out as.  `write` is given the site and when it is written, UTC, as
    ISO 8601 has it."""

    suffix: str
    media_type: str
    write: Callable[[Site, str], str]


def _lif_text(site: Site, now: str) -> str:
    return json.dumps(lif_document(site, now), indent=2) + "\n"


EXPORTS: Final[Mapping[str, MapFormat]] = {
    "lif": MapFormat(".lif.json", "application/json", _lif_text),
    "csv": MapFormat("-nodes.csv", "text/csv; charset=utf-8", lambda site, _now: nodes_csv(site)),
    "locations": MapFormat(
        "-locations.csv", "text/csv; charset=utf-8", lambda site, _now: locations_csv(site)
    ),
    "svg": MapFormat(".svg", "image/svg+xml", lambda site, _now: draw_site(site)),
}


def tables_of_lif_file(data: bytes, vehicle: str = "") -> Imported:
    """The map in a VDMA LIF file, for one type of `vehicle` or for all.  InputError saying what is wrong with
    it."""
    return tables_of_lif(_document(data), vehicle)


def lif_text_onto(base: bytes, site: Site, now: str, vehicle: str = "") -> str:
    """The LIF file that a site came from, with what has changed since.  InputError where it did not."""
    return json.dumps(lif_onto(_document(base), site, now, vehicle), indent=2) + "\n"


def _document(data: bytes) -> Any:
    try:
        return json.loads(text_of(data))
    except (ValueError, RecursionError):  # ValueError: also a whole number of thousands of digits
        raise InputError("this is no JSON, and so no LIF") from None


def text_of(data: bytes) -> str:
    """A file's text.  InputError for one that is not UTF-8."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("this is no UTF-8 text") from None
