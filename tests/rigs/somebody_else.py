"""Files that another user may not read."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

_NOBODY = 65534


@contextmanager
def as_somebody_else() -> Iterator[None]:
    """Meanwhile this process is a user who owns nothing; one that is no superuser is stopped as it is.  What
    it imports must be there already, for that may lie where only the superuser reads."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(_NOBODY)
    try:
        yield
    finally:
        os.seteuid(0)
