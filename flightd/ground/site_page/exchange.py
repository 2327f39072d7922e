"""Import and export of maps, in the working process: CSV of nodes, VDMA LIF, and the site file itself."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

from flightd.core.errors import InputError
from flightd.ground.site_page.drafts import opened_document
from flightd.inventory.stock_table import read_table
from flightd.site.exchange.map_files import EXPORTS, tables_of_lif_file, text_of
from flightd.site.exchange.node_table import COLUMNS, tables_of_rows
from flightd.site.site_draft import SiteDraft, draft_of, draft_text, read_draft
from flightd.site.site_tables import SiteTablesError, site_of

NAMED = {
    "toml": (".toml", "application/toml"),
    **{kind: (made.suffix, made.media_type) for kind, made in EXPORTS.items()},
}
"""Of each kind of file: how its name ends, and its media type."""


def exported(kind: str, draft: SiteDraft) -> bytes:
    """The map as a file.  InputError for an unknown kind, and for a map that is none yet (but as TOML)."""
    if kind not in NAMED:
        raise InputError(f"no format is called {kind!r}; choose one of {', '.join(NAMED)}")
    if kind == "toml":
        return draft_text(draft).encode()
    try:
        site = site_of(draft.tables())
    except SiteTablesError as err:
        raise InputError(f"not exported: {err}", remedy="put that right first") from None
    return EXPORTS[kind].write(site, datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")).encode()


def imported(kind: str, data: bytes) -> dict[str, Any]:
    """The page's document of a map that a file describes, with `notes`.  InputError saying what is wrong."""
    if kind == "toml":
        return {**opened_document(read_draft(text_of(data), "the file")), "notes": []}
    if kind == "csv":
        found = tables_of_rows(read_table(data, needed=f"a table of nodes has {', '.join(COLUMNS)}").rows)
    elif kind == "lif":
        found = tables_of_lif_file(data)
    else:
        raise InputError(f"no import is called {kind!r}; choose csv, lif or toml")
    return {**opened_document(draft_of(found.tables)), "notes": list(found.notes)}
