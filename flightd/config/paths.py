"""Where the files that ship with flightd lie."""

from __future__ import annotations

from pathlib import Path

import flightd
from flightd.core.errors import InputError

_PACKAGE = Path(flightd.__file__).parent
_PLACES = (Path("configs"), _PACKAGE.parent / "configs", Path("/etc/flightd"), _PACKAGE / "configs")
"""The folder one stands in, the checkout, the installed service, and what every wheel carries."""


def shipped(name: str) -> Path:
    """The file `name` of `configs/`, of the first place that has it.  InputError when none has."""
    for place in _PLACES:
        if (place / name).is_file():
            return place / name
    remedy = "give a file of your own"
    raise InputError(f"not found in {', '.join(map(str, _PLACES))}", file=name, remedy=remedy)
