"""Import and export of maps, in the working process: CSV of nodes, VDMA LIF, and the site file itself."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Final

from flightd.core.errors import InputError
from flightd.ground.site_page.drafts import opened_document
from flightd.inventory.stock_table import read_table
from flightd.site.exchange.graph import Imported
from flightd.site.exchange.lif import lif_document, tables_of_lif
from flightd.site.exchange.node_table import locations_csv, nodes_csv, tables_of_rows
from flightd.site.floor_plan_svg import draw_site
from flightd.site.site import Site
from flightd.site.site_draft import SiteDraft, draft_of, draft_text, read_draft
from flightd.site.site_tables import SiteTablesError, site_of

MOST_BYTES: Final = 8_000_000


@dataclass(frozen=True, slots=True)
class Format:
    """A kind of file that a map is given out as."""

    suffix: str
    media_type: str
    write: Callable[[Site], str]


def _lif(site: Site) -> str:
    return json.dumps(lif_document(site, datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")), indent=2)


_NO_SITE: Final[Callable[[Site], str]] = str
FORMATS: Final = {
    "toml": Format(".toml", "application/toml", _NO_SITE),
    "lif": Format(".lif.json", "application/json", _lif),
    "csv": Format("-nodes.csv", "text/csv; charset=utf-8", nodes_csv),
    "locations": Format("-locations.csv", "text/csv; charset=utf-8", locations_csv),
    "svg": Format(".svg", "image/svg+xml", draw_site),
}


def exported(kind: str, draft: SiteDraft) -> bytes:
    """The map as a file.  InputError for an unknown kind, and for a map that is none yet (but as TOML)."""
    if kind not in FORMATS:
        raise InputError(f"no format is called {kind!r}; choose one of {', '.join(FORMATS)}")
    if kind == "toml":
        return draft_text(draft).encode()
    try:
        site = site_of(draft.tables())
    except SiteTablesError as err:
        raise InputError(f"not exported: {err}", remedy="put that right first") from None
    return FORMATS[kind].write(site).encode()


def imported(kind: str, data: bytes) -> dict[str, Any]:
    """The page's document of a map that a file describes, with `notes`.  InputError saying what is wrong."""
    if kind == "toml":
        return {**opened_document(read_draft(_text(data), "the file")), "notes": []}
    if kind == "csv":
        found = tables_of_rows(read_table(data).rows)
    elif kind == "lif":
        found = _of_lif(data)
    else:
        raise InputError(f"no import is called {kind!r}; choose csv, lif or toml")
    return {**opened_document(draft_of(found.tables)), "notes": list(found.notes)}


def _of_lif(data: bytes) -> Imported:
    try:
        document = json.loads(_text(data))
    except (json.JSONDecodeError, RecursionError):
        raise InputError("this is no JSON, and so no LIF") from None
    return tables_of_lif(document)


def _text(data: bytes) -> str:
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("this is no UTF-8 text") from None
