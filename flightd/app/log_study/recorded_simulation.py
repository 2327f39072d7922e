"""A simulated flight as its files have it, for a judge who was not there."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from flightd.app.recording import SETTING_TOPICS, recorded_setting
from flightd.app.simulation.simulation import FLIGHT_LOG, Simulation
from flightd.core.errors import InputError
from flightd.core.topics import Document, Topic
from flightd.replay.log import FlightLog, read_log
from flightd.sim.scenario.scenario import Scenario
from flightd.sim.unknowns import Unknowns


def recorded_simulation(log: Path) -> tuple[Simulation, dict[str, Any]] | None:
    """The simulation that wrote `log`, and the summary that it left; None where no `truth.mcap` and
    `summary.json` of it lie beside it, or those are of a flight of another name.  InputError for files that
    do not hold what they should."""
    truth, summary = log.with_name("truth.mcap"), log.with_name("summary.json")
    if log.name != FLIGHT_LOG or not truth.exists() or not summary.exists():
        return None
    told = _summary(summary)
    recorded = read_log(log, {Topic.SCENARIO, *SETTING_TOPICS})
    flown = recorded_setting(recorded)
    simulation = Simulation(
        config=flown.config,
        site=flown.site,
        scenario=_scenario(recorded),
        seed=told["seed"],
        speed=None,
        folder=log.parent,
        order=flown.order,
        unknowns=_unknowns(truth),
    )
    return simulation, told


def _summary(path: Path) -> dict[str, Any]:
    try:
        told = json.loads(path.read_bytes())
    except (OSError, ValueError) as err:
        raise InputError(f"cannot be read: {err}", file=path) from None
    if not isinstance(told, dict) or not isinstance(told.get("seed"), int):
        raise InputError("is no summary of a simulated flight: no seed", file=path)
    return told


def _unknowns(truth: Path) -> Unknowns:
    """What of the world a flight is judged by: how far its lines lay beside their map."""
    told = read_log(truth, {Topic.UNKNOWNS}).messages(Document)
    try:
        drawn = json.loads(told[-1].text) if told else {}
        return Unknowns(map_error_m=float(drawn.get("map_error_m", 0.0)))
    except (ValueError, TypeError, AttributeError) as err:
        raise InputError(f"what its world kept to itself cannot be read: {err}", file=truth) from None


def _scenario(log: FlightLog) -> Scenario:
    documents = log.messages(Document, Topic.SCENARIO)
    if not documents:
        raise InputError("holds no scenario: an older version recorded it", file=log.path)
    try:
        return Scenario.model_validate_json(documents[-1].text)
    except ValidationError as err:
        first = err.errors()[0]
        where = ".".join(map(str, first["loc"]))
        what = f"its scenario is of another version: {where}: {first['msg']}"
        raise InputError(what, file=log.path) from None
