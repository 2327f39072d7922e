"""What is told of labels with linear codes of which a part is damaged: read, left, or told wrong.

Each label is seen three times from about the same place under the same light, with 2.75 to 4 pixels for each
module, and the looks go the product's way to a finding.  Damaged are its ends (torn off, covered, worn, cut
off by the picture's edge) or any of its bars (a blot, a lamp's image); undamaged ones show what is read.

python -m tools.bench_damage [--labels N] [--seed N] [--list]
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from flightd.core.scanning import BodyPose
from flightd.core.types import CodeRead
from flightd.mission.scan.code_assignment import PlacedRead
from flightd.mission.scan.location_votes import LocationVotes
from flightd.vision.shelf.code_reader import read_codes
from tools.damaged_labels import Damage, DamagedLabel, Kind, Printed, Seen

_VIEWS = 3
_PLACE = "A-01-1-1"
_M_PER_PX = 0.0004


@dataclass(frozen=True, slots=True)
class Told:
    """What became of one label."""

    label: DamagedLabel
    seen: Seen
    reads: tuple[CodeRead, ...]

    @property
    def read(self) -> bool:
        return {one.text for one in self.reads} == {self.label.printed.text}

    @property
    def wrong(self) -> tuple[CodeRead, ...]:
        return tuple(one for one in self.reads if one.text != self.label.printed.text)


def told_of(label: DamagedLabel, rng: np.random.Generator) -> Told:
    """Look at a label and find what it says."""
    seen = Seen.drawn(rng)
    votes = LocationVotes(_PLACE, "A1", _VIEWS)
    for number in range(_VIEWS):
        reads = read_codes(label.picture(seen.again(rng), rng))
        pose = BodyPose(number, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.01, 0.01, 0.01, True)
        votes.add(number, pose, None, [_placed(read) for read in reads])
    finding = votes.finding(final=True)
    return Told(label, seen, finding.reads if finding is not None else ())


def _placed(read: CodeRead) -> PlacedRead:
    corners = np.array(read.corners_px)
    x_px, y_px = corners.mean(axis=0)
    size_m = float(np.ptp(corners, axis=0).max()) * _M_PER_PX
    return PlacedRead(read, _PLACE, _PLACE, x_px * _M_PER_PX, 1.0 - y_px * _M_PER_PX, size_m, 0.99)


def told(labels: int, seed: int) -> Iterator[Told]:
    """So many labels of each kind with each damage."""
    for kind_number, kind in enumerate(Kind):
        for damage_number, damage in enumerate(Damage):
            for number in range(labels):
                rng = np.random.default_rng([seed, kind_number, damage_number, number])
                yield told_of(DamagedLabel.drawn(Printed.drawn(kind, rng), damage, rng), rng)


def table(found: Sequence[Told]) -> list[str]:
    """The figures, a line each."""
    lines = ["| labels | undamaged | read | damaged | read | wrong |", "|---|---|---|---|---|---|"]
    for name, group in [
        *((kind.value, [one for one in found if one.label.printed.kind is kind]) for kind in Kind),
        ("all", list(found)),
    ]:
        whole = [one for one in group if one.label.damage is Damage.NONE]
        hurt = [one for one in group if one.label.damage is not Damage.NONE]
        read, still = (sum(one.read for one in those) for those in (whole, hurt))
        wrong = sum(bool(one.wrong) for one in group)
        lines.append(f"| {name} | {len(whole)} | {read} | {len(hurt)} | {still} | {wrong} |")
    return lines


def main() -> None:
    """Look, read, tell."""
    shown = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=shown)
    parser.add_argument("--labels", type=int, default=20, help="of each kind with each damage")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--list", action="store_true", help="the labels that were told wrong, too")
    asked = parser.parse_args()
    found = list(told(asked.labels, asked.seed))
    print("\n".join(table(found)))
    if asked.list:
        for one in found:
            for read in one.wrong:
                label = one.label
                print(
                    f"{label.printed.kind} {label.printed.content}, {label.damage} by {label.share:+.2f}, "
                    f"{one.seen.px:.2f} px: {read.symbology} {read.text} (sure {read.sure}, {read.agreeing})"
                )


if __name__ == "__main__":
    main()
