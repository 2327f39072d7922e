"""Scenario files: read, checked, found by name, laid over each other."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from flightd.config.paths import shipped
from flightd.core.errors import InputError
from flightd.sim.scenario.scenario import Scenario

_FOLDER = "scenarios"


def load_scenario(path: Path) -> Scenario:
    """Read a scenario file; InputError names the file, the key and the remedy."""
    return _checked(_table(path), f"scenario {path}")


def load_scenarios(names: Sequence[str]) -> Scenario:
    """The scenarios of these names or files laid over each other, all their faults together.  InputError
    where two give the same key different values."""
    paths = [scenario_path(name) for name in names]
    if len(paths) == 1:
        return load_scenario(paths[0])
    merged: dict[str, Any] = {}
    owners: dict[str, Path] = {}
    faults: list[Any] = []
    for path in paths:
        load_scenario(path)
        table = _table(path)
        table.pop("expect", None)  # each is about itself alone
        faults += table.pop("fault", [])
        for section, keys in table.items():
            for key, value in keys.items():
                name = f"{section}.{key}"
                known = merged.setdefault(section, {}).setdefault(key, value)
                if known != value:
                    raise InputError(
                        f"scenario {path}: {name}: {owners[name]} gives another value; leave it out of one"
                    )
                owners.setdefault(name, path)
    return _checked(merged | {"fault": faults}, "scenario " + " + ".join(map(str, paths)))


def scenario_path(name: str) -> Path:
    """The file of that path, or the shipped scenario of that name."""
    if name.endswith(".toml") or "/" in name:
        return Path(name)
    known = shipped_scenarios()
    if name not in known:
        raise InputError(
            f"--scenario {name}: no such scenario; give a TOML file, all, or one of {', '.join(known)}"
        )
    return known[name]


def shipped_scenarios() -> dict[str, Path]:
    """The scenarios that ship with flightd, by name."""
    folder = shipped(f"{_FOLDER}/lines_lost.toml").parent
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def _table(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as err:
        raise InputError(f"scenario {path}: {err.strerror}; give the path of a TOML file") from err
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as err:
        raise InputError(f"scenario {path}: not TOML: {err}") from err


def _checked(table: dict[str, Any], name: str) -> Scenario:
    try:
        return Scenario.model_validate(table)
    except ValidationError as err:
        first = err.errors()[0]
        key = ".".join(str(part) for part in first["loc"])
        raise InputError(f"{name}: {key}: {first['msg'].lower()}") from err
