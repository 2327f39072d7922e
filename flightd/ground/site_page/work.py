"""What is done with a message of the page, in the working process: read there too, for it may be long."""

from __future__ import annotations

from typing import Any

from flightd.ground.site_page.checking import checked
from flightd.ground.site_page.drafts import SentCheck, SentDraft, SentSave, opened_document, reader
from flightd.ground.site_page.exchange import exported
from flightd.ground.site_page.new_site import NewSite, new_draft
from flightd.ground.site_page.saving import saved_text
from flightd.site.site_draft import read_draft

_check = reader(SentCheck, "a map to be checked")
_save = reader(SentSave, "a map to be saved")
_draft = reader(SentDraft, "a map")
_new = reader(NewSite, "a new site")


def opened_text(text: str, name: str) -> dict[str, Any]:
    """The page's document of a site file's text.  InputError where it cannot be edited."""
    return opened_document(read_draft(text, name))


def check_sent(body: bytes) -> bytes:
    """A map laid out and checked, as JSON."""
    sent = _check(body)
    return checked(sent.draft.draft(), sent.camera)


def text_sent(body: bytes) -> tuple[str, str]:
    """The text to be saved, and the stamp of the version in whose place it goes."""
    sent = _save(body)
    return saved_text(sent.draft.draft()), sent.stamp


def new_sent(body: bytes) -> dict[str, Any]:
    """The page's document of a new site."""
    return new_draft(_new(body))


def export_sent(kind: str, body: bytes) -> bytes:
    """A map as a file of another kind."""
    return exported(kind, _draft(body).draft())
