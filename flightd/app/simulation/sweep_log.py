"""The rows of a sweep as they are kept: `sweep.jsonl`, a line for each flight that ended."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeAlias

from flightd import __version__
from flightd.app.simulation.prepare import SimOptions
from flightd.app.simulation.sweep_routes import ROUTES
from flightd.core.errors import InputError, cannot_write

SweptRow: TypeAlias = dict[str, Any]
"""One flight of a sweep as JSON has it: its `HazardVerdict` (`hazard` is the scenario's name), seed, route,
day and `Origin`, whether it went by the clock, and why it ended early or was not judged ("" where it was)."""


def asked_of(options: SimOptions, flights: int, seeds: int) -> dict[str, Any]:
    """What a sweep flies, as JSON, by which it is known again; of the files that it reads, what they hold."""
    files = [path for path in (options.config, options.warehouse) if path and Path(path).is_file()]
    read = {str(path): hashlib.sha256(Path(path).read_bytes()).hexdigest() for path in files}
    told = asdict(options) | {"seeds": seeds, "flights": flights, "files": read, "flightd": __version__}
    told |= {"routes": [asdict(route) for route in ROUTES]}
    known: dict[str, Any] = json.loads(json.dumps(told, default=str))
    return known


class SweepLog:
    """Goes on with the sweep that was interrupted in the same file, where the same is `asked`.

    A sweep that was flown to its end begins anew.  InputError where the file holds an unfinished sweep of
    something else, which would be lost, or cannot be read or written.
    """

    def __init__(self, path: Path, asked: Mapping[str, Any], say: Callable[[str], None]) -> None:
        self._path = path
        kept = self._kept(asked)
        self._rows = {(row["hazard"], row["seed"]): row for row in kept}
        lines = [{"sweep": asked}, *kept]
        fresh = path.with_suffix(".new")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            fresh.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")
            fresh.replace(path)
        except OSError as err:
            raise cannot_write(path, err) from err
        if kept:
            say(f"goes on after {len(kept)} of {asked['flights']} flights; delete {path} to begin anew")

    def __len__(self) -> int:
        return len(self._rows)

    def row(self, hazard: str, seed: int) -> SweptRow | None:
        """The flight that ended, None for one that is still to be flown."""
        return self._rows.get((hazard, seed))

    def append(self, row: SweptRow) -> None:
        """Keep it, whatever becomes of this process."""
        self._rows[row["hazard"], row["seed"]] = row
        try:
            with self._path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
                file.flush()
                os.fsync(file.fileno())
        except OSError as err:
            raise cannot_write(self._path, err) from err

    def _kept(self, asked: Mapping[str, Any]) -> list[SweptRow]:
        """The rows to go on after."""
        try:
            text = self._path.read_text(encoding="utf-8")
        except FileNotFoundError:
            return []
        except (OSError, UnicodeDecodeError) as err:
            raise InputError(f"cannot be read: {err}", file=self._path) from err
        *whole, _torn = text.split("\n")
        try:
            lines = [json.loads(line) for line in whole]
            of = lines.pop(0)["sweep"] if lines else asked
            flights = int(of["flights"])
            rows = {(row["hazard"], row["seed"]): row for row in lines}
        except (ValueError, TypeError, LookupError) as err:
            raise InputError(
                "is no list of a sweep's flights", file=self._path, remedy="give another --out, or delete it"
            ) from err
        if len(rows) >= flights:
            return []
        if of != asked and rows:
            differs = ", ".join(sorted(key for key in {**of, **asked} if of.get(key) != asked.get(key)))
            raise InputError(
                f"holds {len(rows)} of {flights} flights of another sweep ({differs})",
                file=self._path,
                remedy="give another --out, or delete it",
            )
        return list(rows.values()) if of == asked else []
