"""The recorded bytes that the protocol tests are held to."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parents[1]


def recorded() -> Any:
    """AT vectors, navdata packets, PaVE headers and client transcripts of the npm client `ar-drone`."""
    return json.loads((FOLDER / "ardrone_golden.json").read_text())


def pave_68() -> bytes:
    """Five video frames with 68-byte headers, as they came from a drone."""
    return (FOLDER / "pave-68.bin").read_bytes()
