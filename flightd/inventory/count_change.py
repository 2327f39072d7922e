"""What one count found otherwise than the count before it."""

from __future__ import annotations

import enum
from collections.abc import Collection

from flightd.core.inventory import LocationState
from flightd.vision.shelf.code_equality import code_key


class CountChange(enum.StrEnum):
    """At one place, against the newest earlier run that counted it."""

    APPEARED = "appeared"
    """Codes where it was empty."""
    GONE = "gone"
    """Empty where codes were."""
    REPLACED = "replaced"
    """Other codes, or more, or fewer."""
    UNSEEN = "unseen"
    """Counted before, and now nobody can say."""


def change_between(
    before: Collection[str], state: LocationState, texts: Collection[str]
) -> CountChange | None:
    """None where nothing has changed; `before` are the codes of the earlier count, which are compared by
    `code_equality`."""
    if not state.is_counted:
        return CountChange.UNSEEN
    was, is_now = {code_key(text) for text in before}, {code_key(text) for text in texts}
    if was == is_now:
        return None
    if not was:
        return CountChange.APPEARED
    return CountChange.REPLACED if is_now else CountChange.GONE
