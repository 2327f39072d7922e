from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from flightd.adapters.recorder.mcap_file import McapFile
from flightd.adapters.recorder.mcap_repair import repair
from flightd.adapters.recorder.schemas import encode
from flightd.core.errors import InputError
from flightd.core.scanning import CountedPlace
from flightd.core.tick import TickInput
from flightd.core.topics import Document, Topic
from flightd.core.types import AttitudeSetpoint, CodeRead, Event, EventLevel
from flightd.replay.log import read_log, recorded_tick


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log with a few messages in two chunks."""
    path = tmp_path_factory.mktemp("log") / "flight.mcap"
    file = McapFile.create(path)
    file.add_metadata("flightd", {"version": "1"})
    for channel, topic in enumerate((Topic.SETPOINT, Topic.EVENT, Topic.MAP), start=1):
        file.add_channel(channel, topic, "x", '{"type":"object"}')
    file.add_message(1, 1, encode(AttitudeSetpoint(1)))
    file.add_message(2, 2, encode(Event(2, EventLevel.INFO, "armed", "armed")))
    file.flush()
    file.add_message(3, 3, encode(Document("map")))
    file.close()
    return path


_MUTATIONS = st.lists(
    st.tuples(st.sampled_from(["set", "delete", "insert"]), st.integers(0, 1 << 16), st.binary(max_size=12)),
    min_size=1,
    max_size=6,
)


def _mutated(content: bytes, mutations: list[tuple[str, int, bytes]]) -> bytes:
    changed = bytearray(content)
    for how, at, data in mutations:
        place = at % (len(changed) + 1)
        if how == "set":
            changed[place : place + len(data)] = data
        elif how == "delete":
            del changed[place : place + len(data)]
        else:
            changed[place:place] = data
    return bytes(changed)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(mutations=_MUTATIONS)
def test_a_damaged_log_is_read_or_refused_but_never_crashes(
    small: Path, tmp_path: Path, mutations: list[tuple[str, int, bytes]]
) -> None:
    path = tmp_path / "mutated.mcap"
    path.write_bytes(_mutated(small.read_bytes(), mutations))
    with suppress(InputError):
        read_log(path)
        repair(path)
        assert "cut off" not in read_log(path).damage


def test_a_damaged_chunk_is_passed_over_and_told(small: Path, tmp_path: Path) -> None:
    content = bytearray(small.read_bytes())
    content[content.index(b"zstd") + 30] ^= 0xFF
    path = tmp_path / "damaged.mcap"
    path.write_bytes(content)
    log = read_log(path)
    assert log.messages(Document) == [Document("map")]
    assert log.messages(Event) == []
    assert "chunk" in log.damage


def test_only_the_wanted_topics_are_read(small: Path) -> None:
    assert {entry.topic for entry in read_log(small, {Topic.EVENT}).entries} == {Topic.EVENT}


def test_a_message_that_does_not_fit_its_topic_is_told(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    file = McapFile.create(path)
    file.add_channel(1, Topic.SETPOINT, "x", '{"type":"object"}')
    file.add_message(1, 1, b'{"stamp_ns": "soon"}')
    file.close()
    with pytest.raises(InputError, match=r"flight\.mcap: a message on /setpoint"):
        read_log(path)


def test_a_missing_log_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot open the flight log: No such file"):
        read_log(tmp_path / "none.mcap")


@pytest.mark.parametrize(
    ("told", "place"),
    [
        ('["A-1"]', CountedPlace("A-1")),
        (
            encode([CountedPlace("A-1", (CodeRead("QR Code", "T", (), True, 2, 1.0),))]).decode(),
            CountedPlace("A-1", (CodeRead("QR Code", "T", (), True, 2, 1.0),)),
        ),
    ],
    ids=["its name alone, as earlier versions did", "what was read there"],
)
def test_what_was_counted_before_the_flight_is_read_back(told: str, place: CountedPlace) -> None:
    message = msgspec.json.decode(f'{{"now_ns": 7, "counted": {told}}}')
    assert recorded_tick(Path("flight.mcap"), message) == TickInput(7, counted=(place,))


def test_what_was_counted_and_is_no_list_is_refused_in_a_line() -> None:
    with pytest.raises(InputError, match=r"flight.mcap: a message on .* is not what this version records"):
        recorded_tick(Path("flight.mcap"), {"now_ns": 7, "counted": 5})
