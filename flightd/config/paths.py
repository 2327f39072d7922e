"""Where the files that ship with flightd lie."""

from __future__ import annotations

from pathlib import Path

import flightd
from flightd.core.errors import InputError

_PLACES = (Path("configs"), Path(flightd.__file__).parent.parent / "configs", Path("/etc/flightd"))


def shipped(name: str) -> Path:
    """The file `name` of `configs/`: of the folder one stands in, the checkout, or the installed system."""
    for place in _PLACES:
        if (place / name).is_file():
            return place / name
    raise InputError(f"{name}: not found in {', '.join(map(str, _PLACES))}; give a file of your own")
