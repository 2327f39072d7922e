"""The reads of a look, and what stayed undecided beside them, as the text that the store keeps, and back."""

from __future__ import annotations

import json
from collections.abc import Sequence

from flightd.core.inventory import UndecidedCode
from flightd.core.types import CodeRead
from flightd.inventory.export.json_document import undecided_json


def reads_text(reads: Sequence[CodeRead]) -> str:
    """ASCII, whatever a label says."""
    rows = [
        [r.symbology, r.text, int(r.sure), r.agreeing, r.quality, [list(pair) for pair in r.gs1]]
        for r in reads
    ]
    return json.dumps(rows, separators=(",", ":"))


def reads_of(text: str) -> tuple[CodeRead, ...]:
    """Without corners, as from any inventory."""
    return tuple(
        CodeRead(symbology, read, (), bool(sure), agreeing, quality, tuple((ai, value) for ai, value in gs1))
        for symbology, read, sure, agreeing, quality, gs1 in json.loads(text)
    )


def undecided_text(codes: Sequence[UndecidedCode]) -> str:
    """As `flightd inventory show --json` has it, in ASCII."""
    return json.dumps(undecided_json(codes), separators=(",", ":"))


def texts_of(reads: str) -> list[str]:
    """The different texts, in the order of their reading."""
    return list(dict.fromkeys(read[1] for read in json.loads(reads)))
