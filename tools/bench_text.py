"""How well printed lot, expiry, quantity and licence plate are read, on drawn labels whose text is known.

Labels in several fonts, seen up to 30 degrees aside, with blur, glare, low contrast and noise; lots without I
and O, as the pattern says (`--alike`: with them, where nothing tells O from 0).  Needs the extra `ocr`.

python -m tools.bench_text [--labels N] [--seed N] [--heights 14,20,28] [--alike] [--json]
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date

import numpy as np

from flightd.config.label_text import LabelTextConfig
from flightd.core.label_values import LEAST_TEXT_CONFIDENCE, told_text
from flightd.vision.shelf.text_reader import TextReader
from flightd.vision.shelf.text_values import text_values, worth_another
from tools.label_drawing import Seen, fonts, label

_LETTERS, _ALL = "ABCDEFGHJKLMNPQRSTUVWXYZ", "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
_DIGITS = "0123456789"
_KINDS = ("lot", "expiry", "quantity", "lpn")
_TOLD = ("right", "wrong", "unknown")


@dataclass(frozen=True, slots=True)
class _Truth:
    """What a label says."""

    lot: str
    expiry: date
    quantity: int
    lpn: str

    @classmethod
    def drawn(cls, rng: np.random.Generator, letters: str) -> _Truth:
        def some(of: str, count: int) -> str:
            return "".join(rng.choice(list(of), count))

        day = date(int(rng.integers(2026, 2031)), int(rng.integers(1, 13)), int(rng.integers(1, 29)))
        plate = some(letters, 3) + some(_DIGITS, 8)
        return cls(some(letters + _DIGITS, 8), day, int(rng.integers(1, 2000)), plate)

    @property
    def lines(self) -> tuple[str, ...]:
        day = f"{self.expiry:%d.%m.%Y}"
        return f"LOT {self.lot}", f"EXP {day}", f"QTY {self.quantity} PCS", f"LPN {self.lpn}"

    @property
    def values(self) -> dict[str, str]:
        told = {"lot": self.lot, "expiry": self.expiry.isoformat(), "quantity": str(self.quantity)}
        return told | {"lpn": self.lpn}


def patterns(letters: str) -> tuple[LabelTextConfig, ...]:
    """As a site writes them."""
    return (
        LabelTextConfig(kind="lot", pattern=rf"LOT\s*([{letters}0-9]+)"),
        LabelTextConfig(kind="expiry", pattern=r"EXP\s*(\S+)", dates=("%d.%m.%Y",)),
        LabelTextConfig(kind="quantity", pattern=r"QTY\s*(\d+)"),
        LabelTextConfig(kind="lpn", pattern=r"LPN\s*([A-Z]{3}\d{8})"),
    )


def outcomes(labels: int, seed: int, heights: list[int], letters: str) -> Iterator[tuple[int, str, str]]:
    """(height, kind, right | wrong | unknown) of each value."""
    rng, reader, asked, names = np.random.default_rng(seed), TextReader(), patterns(letters), fonts()
    for number in range(labels):
        cap_px, truth = heights[number % len(heights)], _Truth.drawn(rng, letters)
        font = names[number // len(heights) % len(names)]
        values = text_values(
            reader.read(
                label(truth.lines, font, cap_px, Seen.drawn(rng, cap_px), rng),
                lambda looks: worth_another(looks, asked),
            ),
            asked,
        )
        for kind, text in truth.values.items():
            sure = {
                told_text(value.value)
                for value in values
                if value.kind == kind and value.confidence >= LEAST_TEXT_CONFIDENCE
            }
            yield cap_px, kind, "unknown" if len(sure) != 1 else "right" if sure == {text} else "wrong"


def main() -> None:
    """Draw, read, tell."""
    shown = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=shown)
    parser.add_argument("--labels", type=int, default=120)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--heights", default="14,20,28", help="of capitals, px")
    parser.add_argument("--alike", action="store_true", help="lots and plates with I and O")
    parser.add_argument("--json", action="store_true")
    chosen = parser.parse_args()
    heights = [int(height) for height in chosen.heights.split(",")]
    began = time.process_time()
    found = Counter(outcomes(chosen.labels, chosen.seed, heights, _ALL if chosen.alike else _LETTERS))
    cpu_s = (time.process_time() - began) / chosen.labels
    rows = [
        {"height_px": height, "kind": kind} | {told: found[height, kind, told] for told in _TOLD}
        for height in heights
        for kind in _KINDS
    ]
    if chosen.json:
        print(json.dumps({"rows": rows, "cpu_s_per_label": round(cpu_s, 3)}, indent=1))
        return
    print("| height | value | right | wrong | unknown |\n|---|---|---|---|---|")
    for row in rows:
        print("| {height_px} px | `{kind}` | {right} | {wrong} | {unknown} |".format(**row))
    for height in heights:
        right, wrong, unknown = (sum(found[height, kind, told] for kind in _KINDS) for told in _TOLD)
        whole = right + wrong + unknown
        print(f"{height} px: {right / whole:.1%} right, {wrong} wrong of {whole}")
    print(f"{cpu_s:.2f} s of one core for each label of four lines")


if __name__ == "__main__":
    main()
