"""The map that a flight was flown by, as its log has it."""

from __future__ import annotations

from collections.abc import Sequence

from flightd.core.errors import InputError
from flightd.core.topics import Document
from flightd.site.site import Site
from flightd.site.site_file import parse_site


def recorded_map(maps: Sequence[Document]) -> tuple[Site | None, str]:
    """The last of the recorded maps, or None and why it cannot be drawn, empty where none was recorded: a
    report or a playback without it is worth having."""
    if not maps:
        return None, ""
    try:
        return parse_site(maps[-1].text, "the recorded map"), ""
    except InputError as err:
        return None, str(err)
