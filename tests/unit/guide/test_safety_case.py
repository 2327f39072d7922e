"""The evidence of the safety case, out of flights."""

from __future__ import annotations

from typing import Any

from tools.safety_case import evidence_of, evidence_of_pairs, together


def flight(
    hazard: str, clear_m: float | None, down_s: float | None, *, fault: bool = False
) -> dict[str, Any]:
    return {
        "hazard": hazard, "faults": ["near"] if fault else [], "error": "", "min_clearance_m": clear_m,
        "off_leg_max_m": 0.1, "max_overshoot_m": 0.05, "down_s": down_s,
    }  # fmt: skip


FIRST = [flight("wind", 0.5, 3.0), flight("wind", 0.3, None, fault=True)]
SECOND = [flight("wind", 0.4, 5.0)]


def test_two_lots_told_together_are_all_of_them_told_at_once() -> None:
    apart = together(evidence_of(FIRST)["wind"], evidence_of(SECOND)["wind"])
    assert apart == evidence_of([*FIRST, *SECOND])["wind"]
    assert (apart["flights"], apart["good"], apart["min_clearance_m"], apart["down_s"]) == (3, 2, 0.3, 5.0)


def test_what_was_never_told_or_never_measured_is_no_figure() -> None:
    unmeasured = evidence_of([flight("wind", None, None)])["wind"]
    assert (unmeasured["min_clearance_m"], unmeasured["down_s"]) == (None, None)
    assert together({}, unmeasured) == together(unmeasured, {}) == unmeasured
    assert together(unmeasured, evidence_of(SECOND)["wind"])["min_clearance_m"] == 0.4


def test_pairs_are_counted_and_the_unsafe_ones_are_not_safe() -> None:
    pairs = [{"unsafe": [], "min_clearance_m": 0.6, "max_overshoot_m": None},
             {"unsafe": ["near"], "min_clearance_m": 0.0, "max_overshoot_m": 0.2}]  # fmt: skip
    told = evidence_of_pairs(pairs)
    assert told == {"flights": 2, "safe": 1, "min_clearance_m": 0.0, "max_overshoot_m": 0.2}
    assert together(told, evidence_of_pairs([]))["flights"] == 2
