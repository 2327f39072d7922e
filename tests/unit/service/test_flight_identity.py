"""Which flight a log is of: told in the log, in UTC, and tied to the clock of its stamps."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

from flightd.adapters.recorder.recorder import McapRecorder
from flightd.app.flight_identity import FlightIdentity
from flightd.app.flight_orders import configured_order
from flightd.app.recording import FlightSetting
from flightd.config.schema import load_config
from flightd.core.topics import Topic
from flightd.replay.log import read_log
from flightd.site.site_file import load_site

CONFIGS = Path(__file__).parents[3] / "configs"
CONFIG = load_config(CONFIGS / "sim.toml")
SITE = load_site(CONFIGS / "site-demo.toml")


def identity(**sections: dict[str, str]) -> FlightIdentity:
    config = CONFIG.with_values(**sections)
    return FlightIdentity.of(FlightSetting(config, SITE, configured_order(config)), "this-computer", 7_000)


def test_a_log_tells_site_drone_run_and_start(tmp_path: Path) -> None:
    before = datetime.now(UTC) - timedelta(milliseconds=1)
    flight = identity(vehicle={"name": "Kestrel"}, inventory={"run": "2026-W47"})
    path = tmp_path / "flight.mcap"
    with McapRecorder(path, metadata=flight.metadata()) as recorder:
        recorder.record(Topic.TRUTH, 7_000, {})
    told = read_log(path).metadata
    assert (told["site"], told["drone"], told["run"]) == (SITE.name, "Kestrel", "2026-W47")
    assert before <= datetime.fromisoformat(told["started_utc"]) <= datetime.now(UTC)
    assert told["started_utc"].endswith("Z")
    assert told["started_clock_ns"] == "7000"


def test_without_names_it_is_this_computer_and_the_start() -> None:
    flight = identity()
    assert flight.drone == "this-computer"
    assert flight.run == f"{flight.started:%Y-%m-%dT%H:%M:%SZ}"
