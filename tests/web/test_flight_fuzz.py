"""A log may hold anything: it is listed and played, or refused in one line, and never more than that."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import pytest
from mcap.writer import Writer

from flightd.core.errors import InputError
from flightd.core.topics import Topic
from flightd.ground.flights.flight_row import read_rows
from flightd.ground.flights.flight_view import read_view
from flightd.ground.flights.log_folder import find_logs
from flightd.replay.log_chunks import LogChunks
from flightd.replay.report.loader import load_flight
from tests.replay.synthetic_flight import write_flight

Spoil: TypeAlias = Callable[[Any, random.Random], Any]

WILD: tuple[Any, ...] = (
    None, True, -1, 0, 2**63, 2**64 - 1, -(2**70), 1e308, -1e308, 1e-320, "", "x" * 50, "\ud800x", [], {},
    [None] * 9,
)  # fmt: skip
RARELY = 0.0004
WILD_NUMBERS = (1e308, -1e308, 1.5e154, 3e200, -2e170, 1e-320, 0.0, 1e9)
WILD_STAMPS = (0, 2**63, 2**64 - 1)
TAKEN = frozenset(Topic) - {Topic.LINES}


@pytest.fixture(scope="module")
def messages(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[str, int, Any]]:
    """Some of every kind that a flight holds: topic, stamp, JSON."""
    with LogChunks(write_flight(tmp_path_factory.mktemp("flight"), truth=False)) as log:
        found = [
            (message.topic, message.stamp_ns, json.loads(message.payload))
            for message in log.messages([*log.chunks[:2], *log.chunks[-3:-1]], TAKEN)
        ]
    order = {"nodes": ["A2", "A4"], "best_order": False, "pad": None, "start_yaw_rad": 0.0, "autostart": True}
    return [*found[:40], *found[40::40], (Topic.ORDER, 5 * 10**9, order)]


def spoilt(value: Any, chance: random.Random) -> Any:
    if chance.random() < RARELY:
        return chance.choice(WILD)
    return inside(value, spoilt, chance)


def with_wild_numbers(value: Any, chance: random.Random) -> Any:
    """Of the right kind, so that nothing refuses it."""
    if isinstance(value, float) and chance.random() < 0.01:
        return chance.choice(WILD_NUMBERS)
    return inside(value, with_wild_numbers, chance)


def inside(value: Any, spoil: Spoil, chance: random.Random) -> Any:
    if isinstance(value, dict):
        return {key: spoil(item, chance) for key, item in value.items()}
    if isinstance(value, list):
        return [spoil(item, chance) for item in value]
    return value


def write_spoilt(
    path: Path, messages: list[tuple[str, int, Any]], chance: random.Random, spoil: Spoil = spoilt
) -> None:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("", "")
        channels: dict[str, int] = {}
        for topic, stamp_ns, value in chance.sample(messages, len(messages)):
            if topic not in channels:
                channels[topic] = writer.register_channel(topic, "json", 0)
            stamp = chance.choice(WILD_STAMPS) if chance.random() < 0.02 else stamp_ns
            writer.add_message(channels[topic], stamp, json.dumps(spoil(value, chance)).encode(), stamp)
        writer.finish()


def test_a_log_of_wild_messages_is_listed_and_played_or_refused(
    messages: list[tuple[str, int, Any]], tmp_path: Path
) -> None:
    played = refused = 0
    for seed in range(60):
        write_spoilt(tmp_path / "flight.mcap", messages, random.Random(seed))
        (row,) = read_rows(find_logs(tmp_path).logs)
        assert "\n" not in row.trouble
        try:
            view = read_view(tmp_path, "flight.mcap")
        except InputError:
            refused += 1
            continue
        played += 1
        assert json.loads(view.head)["duration_s"] > 0, seed
        curves = json.loads(view.series(0.0, 1e12, 50))["curves"]
        assert {len(curve) for curve in curves.values()} <= {100}, seed
    assert min(played, refused) > 5


def test_numbers_that_no_flight_has_are_told_as_unknown_by_page_and_report(
    messages: list[tuple[str, int, Any]], tmp_path: Path
) -> None:
    for seed in range(24):
        write_spoilt(tmp_path / "flight.mcap", messages, random.Random(seed), with_wild_numbers)
        assert json.loads(read_view(tmp_path, "flight.mcap").head)["duration_s"] > 0, seed
        assert load_flight(tmp_path / "flight.mcap").duration_s > 0, seed
