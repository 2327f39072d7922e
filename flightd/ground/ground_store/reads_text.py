"""The reads of a look, what stayed undecided beside them, and what was found printed, as the text that the
store keeps, and back.
"""

from __future__ import annotations

import json
from collections.abc import Sequence

from flightd.core.inventory import UndecidedCode
from flightd.core.label_values import LabelValue
from flightd.core.types import CodeRead
from flightd.inventory.export.json_document import undecided_json

NOTHING_PRINTED = "[]"


def reads_text(reads: Sequence[CodeRead]) -> str:
    """ASCII, whatever a label says."""
    rows = [
        [
            r.symbology, r.text, int(r.sure), r.agreeing, r.quality, [list(pair) for pair in r.gs1],
            *([] if r.module_px is None else [r.module_px]),
        ]
        for r in reads
    ]  # fmt: skip
    return json.dumps(rows, separators=(",", ":"))


def reads_of(text: str) -> tuple[CodeRead, ...]:
    """Without corners, as from any inventory."""
    return tuple(
        CodeRead(
            symbology, read, (), bool(sure), agreeing, quality, tuple((ai, value) for ai, value in gs1),
            module_px=module_px[0] if module_px else None,
        )
        for symbology, read, sure, agreeing, quality, gs1, *module_px in json.loads(text)
    )  # fmt: skip


def undecided_text(codes: Sequence[UndecidedCode]) -> str:
    """As `flightd inventory show --json` has it, in ASCII."""
    return json.dumps(undecided_json(codes), separators=(",", ":"))


def printed_text(texts: Sequence[LabelValue]) -> str:
    """Values of printed text, in ASCII; `NOTHING_PRINTED` for none."""
    rows = [{"kind": one.kind.value, "value": one.text, "confidence": one.confidence} for one in texts]
    return json.dumps(rows, separators=(",", ":"))


def says_more(text: str, than: str) -> bool:
    """Which of two searches of one picture stays: the one that found more, of equal ones that which is
    greater as a text; the same whichever comes first."""
    return (len(text), text) > (len(than), than)


def texts_of(reads: str) -> list[str]:
    """The different texts, in the order of their reading."""
    return list(dict.fromkeys(read[1] for read in json.loads(reads)))
