"""The evidence of the safety case, out of flights."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from flightd.app.simulation.sweep_routes import digest
from flightd.sim.scenario.scenario_files import shipped_scenarios
from tools import safety_case
from tools.safety_case import EVIDENCE, MixedError, evidence_of, evidence_of_pairs, markdown, together


def flight(
    hazard: str,
    clear_m: float | None,
    down_s: float | None,
    *,
    fault: bool = False,
    seed: int = 1,
    code: str = "aaa",
) -> dict[str, Any]:
    return {
        "hazard": hazard, "faults": ["near"] if fault else [], "error": "", "min_clearance_m": clear_m,
        "off_leg_max_m": 0.1, "max_overshoot_m": 0.05, "down_s": down_s,
        "seed": seed, "code": code, "vehicle": "px4", "flown": f"2026-11-0{seed}", "world": "usual",
    }  # fmt: skip


FIRST = [flight("wind", 0.5, 3.0), flight("wind", 0.3, None, fault=True, seed=2)]
SECOND = [flight("wind", 0.4, 5.0, seed=3)]


def test_two_lots_told_together_are_all_of_them_told_at_once() -> None:
    apart = together("wind", evidence_of(FIRST)["wind"], evidence_of(SECOND)["wind"])
    assert apart == evidence_of([*FIRST, *SECOND])["wind"]
    assert (apart["flights"], apart["good"], apart["min_clearance_m"], apart["down_s"]) == (3, 2, 0.3, 5.0)


def test_what_was_never_told_or_never_measured_is_no_figure() -> None:
    unmeasured = evidence_of([flight("wind", None, None)])["wind"]
    assert (unmeasured["min_clearance_m"], unmeasured["down_s"]) == (None, None)
    assert together("wind", {}, unmeasured) == together("wind", unmeasured, {}) == unmeasured
    assert together("wind", unmeasured, evidence_of(SECOND)["wind"])["min_clearance_m"] == 0.4


def test_pairs_are_counted_and_the_unsafe_ones_are_not_safe() -> None:
    pairs = [{"unsafe": [], "min_clearance_m": 0.6, "max_overshoot_m": None},
             {"unsafe": ["near"], "min_clearance_m": 0.0, "max_overshoot_m": 0.2}]  # fmt: skip
    told = evidence_of_pairs(pairs)
    assert told == {"flights": 2, "safe": 1, "min_clearance_m": 0.0, "max_overshoot_m": 0.2}
    assert together("two faults", told, evidence_of_pairs([]))["flights"] == 2


def test_flights_of_other_code_or_of_a_seed_told_of_already_are_not_summed() -> None:
    told = evidence_of(FIRST)["wind"]
    assert (told["seeds"], told["code"], told["vehicle"], told["flown"]) == (
        [1, 2],
        "aaa",
        "px4",
        "2026-11-02",
    )
    other = evidence_of([flight("wind", 0.4, 5.0, seed=3, code="bbb")])["wind"]
    with pytest.raises(MixedError, match=r"wind: .* of code aaa, these of bbb"):
        together("wind", told, other)
    with pytest.raises(MixedError, match="told of already: seeds 1 to 2"):
        together("wind", told, told)
    with pytest.raises(MixedError, match="different code: aaa, bbb"):
        evidence_of([*FIRST, flight("wind", 0.4, 5.0, seed=3, code="bbb")])
    changed = evidence_of([flight("wind", 0.4, 5.0, code="aaa-dirty")])["wind"]
    with pytest.raises(MixedError, match="not known to be the same"):
        together("wind", changed, evidence_of([flight("wind", 0.4, 5.0, seed=2, code="aaa-dirty")])["wind"])


def test_evidence_from_before_origins_were_kept_is_none_and_only_renewed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    figures = {"flights": 9, "good": 9, "min_clearance_m": 0.5, "off_leg_max_m": 0.1,
               "max_overshoot_m": 0.1, "down_s": None}  # fmt: skip
    evidence, sweep = tmp_path / "evidence.json", tmp_path / "sweep.json"
    kept = {"flown": "2026-10-01", "world": "usual", "hazards": {"wind": figures, "pilot": figures}}
    evidence.write_text(json.dumps(kept))
    now = {"scenario": digest(shipped_scenarios()["wind"])}
    sweep.write_text(json.dumps({"flights": [one | now for one in FIRST]}))
    monkeypatch.setattr(safety_case, "EVIDENCE", evidence)
    with pytest.raises(SystemExit):
        safety_case.main([str(sweep), "--add"])
    assert "vehicle not kept, these of px4" in capsys.readouterr().err
    assert json.loads(evidence.read_text()) == kept
    assert safety_case.main([str(sweep), "--renew"]) == 0
    rows = {line.split(" | ")[0]: line for line in safety_case.markdown().splitlines()}
    assert rows["| `wind`"].endswith("| 1 to 2 | 2026-11-02 | px4, aaa |")
    assert " | not since its scenario or routes changed | " in rows["| `pilot`"]


def test_flights_of_a_scenario_as_it_was_are_no_evidence_of_what_it_is_now(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    told = json.loads(EVIDENCE.read_text(encoding="utf-8"))
    (name, row), *_ = told["hazards"].items()
    changed = tmp_path / EVIDENCE.name
    monkeypatch.setattr(safety_case, "EVIDENCE", changed)
    stale = "| not since its scenario or routes changed |"
    for told_of, count in ((digest(shipped_scenarios()[name]), 0), ("another", 1)):
        told["hazards"] = {name: row | {"scenario": told_of}}
        changed.write_text(json.dumps(told), encoding="utf-8")
        assert markdown().count(stale) == count
    (first,) = evidence_of(FIRST).values()
    (second,) = evidence_of(SECOND).values()
    with pytest.raises(MixedError, match="its scenario is another one since"):
        together("wind", first | {"scenario": "a"}, second | {"scenario": "b"})
    assert together("wind", first | {"scenario": "a"}, second | {"scenario": "a"})["scenario"] == "a"
