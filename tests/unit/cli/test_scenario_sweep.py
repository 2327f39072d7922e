"""`flightd sim --scenario all` and `--seeds`, by flights that only pretend: what is kept, told, returned."""

from __future__ import annotations

import json
import os
import re
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from flightd.app.simulation.flown_code import flown_code
from flightd.app.simulation.launch import FlightInterruptedError
from flightd.app.simulation.scenario_sweep import hazard_scenarios
from flightd.app.simulation.simulation import Simulation
from flightd.cli.main import main
from flightd.core.errors import FlightdError, InputError, RunError, UnavailableError
from flightd.sim.judge.hazard_verdict import HazardVerdict
from flightd.sim.judge.verdict import JudgedFault

Run = Callable[..., tuple[int, str, str]]
NAMES = list(hazard_scenarios())
FIRST, SECOND, THIRD = NAMES[:3]


class Flights:
    """What is flown, by hazard and seed; at a number of flight something may happen, in the air or after."""

    def __init__(self) -> None:
        self.flown: list[tuple[str, int]] = []
        self.raising: dict[int, FlightdError] = {}
        self.judging: dict[int, Callable[[], object]] = {}
        self.bad: set[str] = set()

    def fly(self, simulation: Simulation) -> SimpleNamespace:
        if error := self.raising.get(len(self.flown) + 1):
            self.flown.append((self._hazard(simulation), simulation.seed))
            raise error
        self.flown.append((self._hazard(simulation), simulation.seed))
        return SimpleNamespace(phase="done")

    def judge(self, simulation: Simulation) -> SimpleNamespace:
        self.judging.get(len(self.flown), lambda: None)()
        name = self._hazard(simulation)
        faults = (JudgedFault("hit_rack", 3.0, 0.1),) if name in self.bad else ()
        verdict = HazardVerdict(name, 0.5, "land", ("land",), "landed", 9.0, 1.0, 0.1, 0.1, 0.0, faults)
        return SimpleNamespace(hazard=verdict)

    @staticmethod
    def _hazard(simulation: Simulation) -> str:
        folder = simulation.flight_log.parent
        return (folder.parent if folder.name.startswith("seed-") else folder).name


@pytest.fixture
def flights(monkeypatch: pytest.MonkeyPatch) -> Flights:
    pretended = Flights()
    monkeypatch.setattr("flightd.app.simulation.scenario_sweep.fly", pretended.fly)
    monkeypatch.setattr("flightd.app.simulation.scenario_sweep.judge_flight", pretended.judge)
    return pretended


@pytest.fixture
def sim(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Run:
    """Exit code, stdout and stderr of `flightd sim --out TMP` with more arguments."""

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["flightd", "sim", "--out", str(tmp_path), *arguments])
        with pytest.raises(SystemExit) as ended:
            main()
        printed = capsys.readouterr()
        return int(ended.value.code or 0), printed.out, printed.err

    return run


def kept(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / "sweep.jsonl").read_text().splitlines()[1:]]


def test_every_hazard_is_flown_with_every_seed_and_kept(flights: Flights, sim: Run, tmp_path: Path) -> None:
    code, out, _ = sim("--scenario", "all", "--seed", "4", "--seeds", "2", "--json")
    assert code == 0
    assert flights.flown == [(name, seed) for name in NAMES for seed in (4, 5)]
    told = json.loads(out)
    assert (told["wrong"], told["interrupted"]) == ([], "")
    assert told["flights"] == kept(tmp_path)
    assert (tmp_path / FIRST / "seed-5").is_dir()
    assert {(row["vehicle"], row["code"], row["world"]) for row in told["flights"]} == {
        ("ardupilot", flown_code(), "usual")
    }
    assert all(re.fullmatch(r"\d{4}-\d\d-\d\d", row["flown"]) for row in told["flights"])


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_in_flight_ends_it_all_and_the_same_command_goes_on(
    flights: Flights, sim: Run, tmp_path: Path, number: signal.Signals
) -> None:
    flights.raising[3] = FlightInterruptedError(number, None)
    code, out, err = sim("--scenario", "all", "--json")
    assert code == 128 + number
    assert [name for name, _ in flights.flown] == [FIRST, SECOND, THIRD]
    assert f"interrupted by {number.name} after 2 of {len(NAMES)} flights" in err
    told = json.loads(out)
    assert [row["hazard"] for row in told["flights"]] == [FIRST, SECOND]
    assert told["interrupted"] == number.name
    assert told["flights"] == kept(tmp_path)

    flights.raising.clear()
    flights.flown.clear()
    code, out, err = sim("--scenario", "all", "--json")
    assert code == 0
    assert [name for name, _ in flights.flown] == NAMES[2:]
    assert f"goes on after 2 of {len(NAMES)} flights" in err
    assert f"3 of {len(NAMES)}: {THIRD}" in err
    assert [row["hazard"] for row in json.loads(out)["flights"]] == NAMES


def test_a_signal_while_a_flight_is_judged_ends_it_all(flights: Flights, sim: Run, tmp_path: Path) -> None:
    flights.judging[2] = lambda: os.kill(os.getpid(), signal.SIGTERM)
    before = signal.getsignal(signal.SIGTERM)
    code, out, _ = sim("--scenario", "all")
    assert code == 128 + signal.SIGTERM
    assert "Every hazard, flown" in out
    assert [row["hazard"] for row in kept(tmp_path)] == [FIRST]
    assert signal.getsignal(signal.SIGTERM) is before


def test_an_error_of_one_flight_is_its_own(flights: Flights, sim: Run) -> None:
    errors = [UnavailableError("no port"), RunError("no end"), InputError("no log")]
    flights.raising.update(enumerate(errors, start=1))
    flights.bad.add(THIRD)
    code, out, err = sim("--scenario", "all", "--seeds", "2", "--json")
    assert code == 1
    assert len(flights.flown) == 2 * len(NAMES)
    told = json.loads(out)
    assert [row["error"] for row in told["flights"][:4]] == [*map(str, errors), ""]
    wrong = [f"{name} with seed {seed}" for name in (FIRST, SECOND, THIRD) for seed in (1, 2)]
    wrong.remove(f"{SECOND} with seed 2")
    assert told["wrong"] == wrong
    assert f"5 of {2 * len(NAMES)} did not go as the table says: {', '.join(wrong)}" in err


def test_a_flight_that_cannot_be_judged_is_told_as_such(flights: Flights, sim: Run, tmp_path: Path) -> None:
    def no_log() -> None:
        raise InputError("cannot open the flight log")

    flights.raising[2], flights.judging[2] = UnavailableError("no port"), no_log
    code, out, _ = sim("--scenario", "all")
    assert code == 1
    row = kept(tmp_path)[1]
    assert (row["hazard"], row["outcome"], row["found_s"]) == (SECOND, "not judged", None)
    assert row["error"] == "no port; not judged: cannot open the flight log"
    assert "Every hazard, flown" in out


def test_what_this_vehicle_cannot_have_is_its_rows_error(flights: Flights, sim: Run) -> None:
    """Nobody can take an AR.Drone's range finder away."""
    code, out, _ = sim("--scenario", "all", "--vehicle", "ardrone", "--json")
    assert code == 1
    errors = {row["hazard"]: row["error"] for row in json.loads(out)["flights"]}
    assert "height_lost" in errors["height_lost"]
    assert errors["camera_frozen"] == errors["companion_dead"] == ""
    assert len(flights.flown) == sum(not error for error in errors.values())


def test_what_cannot_be_flown_at_all_is_refused_at_once(flights: Flights, sim: Run) -> None:
    code, out, err = sim("--scenario", "all", "--set", "mission.height_m=high")
    assert (code, out, flights.flown) == (2, "", [])
    assert "mission.height_m" in err


def test_a_list_is_left_alone_that_other_options_began(flights: Flights, sim: Run, tmp_path: Path) -> None:
    flights.raising[2] = FlightInterruptedError(signal.SIGINT, None)
    sim("--scenario", "all")
    begun = (tmp_path / "sweep.jsonl").read_bytes()
    code, out, err = sim("--scenario", "all", "--world", "rough")
    assert (code, out) == (2, "")
    assert f"holds 1 of {len(NAMES)} flights of another sweep (world); give another --out" in err
    assert (tmp_path / "sweep.jsonl").read_bytes() == begun


def test_a_line_that_was_being_written_is_flown_again(flights: Flights, sim: Run, tmp_path: Path) -> None:
    flights.raising[3] = FlightInterruptedError(signal.SIGINT, None)
    sim("--scenario", "all")
    path = tmp_path / "sweep.jsonl"
    path.write_bytes(path.read_bytes()[:-20])
    flights.raising.clear()
    flights.flown.clear()
    assert sim("--scenario", "all")[0] == 0
    assert flights.flown[0][0] == SECOND
    assert [row["hazard"] for row in kept(tmp_path)] == NAMES


def test_a_sweep_that_was_flown_to_its_end_begins_anew(flights: Flights, sim: Run, tmp_path: Path) -> None:
    sim("--scenario", "all")
    assert sim("--scenario", "all", "--world", "rough")[0] == 0
    assert len(flights.flown) == 2 * len(NAMES)
    assert len(kept(tmp_path)) == len(NAMES)


def test_a_file_that_is_no_such_list_is_refused(flights: Flights, sim: Run, tmp_path: Path) -> None:
    (tmp_path / "sweep.jsonl").write_text("something else\n")
    code, _, err = sim("--scenario", "all")
    assert (code, flights.flown) == (2, [])
    assert "sweep.jsonl: is no list of a sweep's flights" in err


@pytest.fixture
def seeds(monkeypatch: pytest.MonkeyPatch) -> dict[int, FlightdError]:
    """Flights of many seeds that only pretend; those in it raise, in the air (RunError) or judged."""
    raising = dict[int, FlightdError]()
    summary = {
        "mission": "completed", "reason": "", "nodes_visited": 1, "nodes_planned": 1, "faults": [],
        "cross_track_rms_m": 0.1, "min_clearance_m": 1.0, "verdict": "good",
    }  # fmt: skip

    def fly(simulation: Simulation) -> object:
        if isinstance(error := raising.get(simulation.seed), RunError):
            raise error
        return object()

    def judge(simulation: Simulation, *_: object) -> dict[str, Any]:
        if error := raising.get(simulation.seed):
            raise error
        return {**summary, "seed": simulation.seed}

    monkeypatch.setattr("flightd.cli.scenario_sweep.fly", fly)
    monkeypatch.setattr("flightd.cli.scenario_sweep.write_results", judge)
    return raising


def test_a_seed_whose_flight_fails_is_a_row_and_the_others_fly_on(
    seeds: dict[int, FlightdError], sim: Run
) -> None:
    seeds |= {1: RunError("no end"), 3: InputError("no log")}
    code, out, err = sim("--seeds", "4", "--json")
    assert code == 1
    told = json.loads(out)
    assert [(row["seed"], row["verdict"], row.get("error")) for row in told["flights"]] == [
        (1, "not judged", "no end"), (2, "good", None), (3, "not judged", "no log"), (4, "good", None),
    ]  # fmt: skip
    assert told["bad"] == [1, 3]
    assert "2 of 4 flights are bad: seeds 1, 3" in err
    code, out, _ = sim("--seeds", "4")
    assert code == 1
    assert "not judged: no end" in out
    assert "1 of 1" in out


def test_a_signal_ends_the_flights_of_many_seeds_too(seeds: dict[int, FlightdError], sim: Run) -> None:
    seeds[2] = FlightInterruptedError(signal.SIGTERM, None)
    code, out, err = sim("--seeds", "3", "--json")
    assert code == 128 + signal.SIGTERM
    told = json.loads(out)
    assert [flight["seed"] for flight in told["flights"]] == [1]
    assert told["interrupted"] == "SIGTERM"
    assert "interrupted by SIGTERM after 1 flight\n" in err
