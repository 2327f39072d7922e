"""How full a place is as the text that the store keeps, and back."""

from __future__ import annotations

import json
from typing import Any

from flightd.core.inventory import CaseGrid, PlaceFill
from flightd.inventory.export.json_document import fill_json


def fill_text(fill: PlaceFill | None) -> str | None:
    """As `flightd inventory show --json` has it, None where it was not asked."""
    return None if fill is None else json.dumps(fill_json(fill), separators=(",", ":"))


def fill_of(text: str | None) -> PlaceFill | None:
    """The same back."""
    if text is None:
        return None
    told = json.loads(text)
    cases = told.pop("cases", None)
    return PlaceFill(**told, cases=cases and CaseGrid(cases["columns"], cases["rows"]))


def fill_shown(text: str | None) -> dict[str, Any] | None:
    """The same for people and programs; what was not told then is null."""
    fill = fill_of(text)
    return None if fill is None else fill_json(fill)
