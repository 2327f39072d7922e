"""What goes between the page Site and the station: a map under the editor's hands, as JSON."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, TypeVar

import msgspec
from msgspec import Meta

from flightd.adapters.ground_link.protocol import DECODE_ERRORS
from flightd.core.errors import InputError
from flightd.ground.decode_words import decode_words
from flightd.site.site_draft import Element, SiteDraft, as_measures, keeps_comments
from flightd.site.site_tables import LISTS

MOST_BYTES = 4_000_000
"""Of a draft: the text of the file, and its tables beside it."""
_T = TypeVar("_T")


class SentElement(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One table of a list; `at`: which of the text's tables it was, None for a new one."""

    values: dict[str, Any]
    at: Annotated[int, Meta(ge=0)] | None = None


class SentDraft(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The map as the editor has it, over the text of its file."""

    site: dict[str, Any]
    lists: dict[str, list[SentElement]]
    text: str = ""

    def draft(self) -> SiteDraft:
        lists = {
            name: tuple(Element(as_measures(one.values), one.at) for one in self.lists.get(name, ()))
            for name in LISTS
        }
        unknown = [name for name in self.lists if name not in LISTS]
        if unknown:
            raise InputError(f"there are no tables {unknown[0]!r}")
        return SiteDraft(as_measures(self.site), lists, self.text)


class CameraSetting(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The front camera and the labels against which the map is checked."""

    fov_deg: Annotated[float, Meta(ge=5, le=170)]
    width_px: Annotated[int, Meta(ge=16, le=100_000)]
    exposure_ms: Annotated[float, Meta(ge=0.001, le=1000)]
    module_mm: Annotated[float, Meta(ge=0.05, le=100)]
    speed_mps: Annotated[float, Meta(ge=0, le=100)]


class SentCheck(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """To be checked."""

    draft: SentDraft
    camera: CameraSetting | None = None


class SentSave(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """To be saved over the version with this stamp; empty: as a new file."""

    draft: SentDraft
    stamp: str = ""


def reader(kind: type[_T], what: str) -> Callable[[bytes], _T]:
    """Reads a message of this kind.  InputError for anything else."""
    decode: Callable[[bytes], _T] = msgspec.json.Decoder(kind).decode

    def read(body: bytes) -> _T:
        try:
            return decode(body)
        except DECODE_ERRORS as err:
            raise InputError(f"not {what}: {decode_words(err)}") from None

    return read


def document(draft: SiteDraft) -> dict[str, Any]:
    """The draft as the page takes it, and sends it again."""
    lists = {
        name: [{"values": element.values, "at": element.at} for element in draft.lists.get(name, ())]
        for name in LISTS
    }
    return {"site": draft.site, "lists": lists, "text": draft.text}


def opened_document(draft: SiteDraft) -> dict[str, Any]:
    """The draft of a file; `loses_comments` where they cannot be kept."""
    return {"draft": document(draft), "loses_comments": bool(draft.text) and not keeps_comments(draft)}
