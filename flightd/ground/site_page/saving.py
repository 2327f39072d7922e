"""The text of a map that may be saved: one that the daemon will read."""

from __future__ import annotations

from flightd.core.errors import InputError
from flightd.site.site_draft import SiteDraft, draft_text
from flightd.site.site_file import parse_site
from flightd.site.site_tables import SiteTablesError, site_of


def saved_text(draft: SiteDraft) -> str:
    """The file's new text.  InputError for a map that no drone could fly by."""
    try:
        site_of(draft.tables())
    except SiteTablesError as err:
        more = len(err.mistakes) - 1
        rest = f" (and {more} more)" if more else ""
        raise InputError(
            f"not saved: {err}{rest}", remedy="put that right first, or keep it by Export, TOML"
        ) from None
    text = draft_text(draft)
    parse_site(text, "the saved file")  # what the daemon will do
    return text
