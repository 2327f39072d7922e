from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.adapters.recorder.schemas import encode
from flightd.core.inventory import PlaceFill
from flightd.core.scanning import CodeSet, Occupancy, PlaceLook
from flightd.core.tick import TickInput
from flightd.core.types import Attitude, CodeRead, LandedState, VehicleState
from flightd.replay.log import converted
from flightd.replay.nan_values import with_nan

QUAD = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
SILENT = VehicleState(
    Attitude(1, 0.0, 0.0, 0.0),
    math.nan,
    0,
    math.nan,
    "",
    False,
    False,
    LandedState.UNKNOWN,
    math.nan,
    15.0,
    9,
)


@dataclass(frozen=True)
class Part:
    height_m: float
    goal_m: float | None = None


@dataclass(frozen=True)
class Record:
    """Every form in which a record's types declare a number."""

    number: float
    count: int
    text: str
    perhaps: float | None
    part: Part
    no_part: Part | None
    pair: tuple[float, float | None]
    mixed: tuple[str, float]
    many: tuple[float, ...]
    parts: tuple[Part, ...]
    named: dict[str, float] = field(default_factory=dict)
    named_parts: dict[str, Part | None] = field(default_factory=dict)
    pairs: tuple[tuple[float, float], ...] | None = None


SOME = Record(1.0, 1, "", None, Part(1.0), None, (1.0, None), ("", 1.0), (), ())
NUMBER = st.just(math.nan) | st.floats(-9, 9)
PERHAPS = st.none() | st.floats(-9, 9)
PART = st.builds(Part, NUMBER, PERHAPS)
RECORD = st.builds(
    Record,
    number=NUMBER,
    count=st.integers(0, 9),
    text=st.text(max_size=3),
    perhaps=PERHAPS,
    part=PART,
    no_part=st.none() | PART,
    pair=st.tuples(NUMBER, PERHAPS),
    mixed=st.tuples(st.text(max_size=3), NUMBER),
    many=st.lists(NUMBER, max_size=3).map(tuple),
    parts=st.lists(PART, max_size=2).map(tuple),
    named=st.dictionaries(st.text(max_size=2), NUMBER, max_size=2),
    named_parts=st.dictionaries(st.text(max_size=2), st.none() | PART, max_size=2),
    pairs=st.none() | st.lists(st.tuples(NUMBER, NUMBER), max_size=2).map(tuple),
)


def _read_back(record: object) -> object:
    return converted(msgspec.json.decode(encode(record)), type(record))


@given(RECORD)
def test_a_record_reads_back_as_it_was_with_nan_and_none_apart(record: Record) -> None:
    assert repr(_read_back(record)) == repr(record)


def test_what_a_camera_could_not_tell_stays_none_beside_a_number_that_is_none() -> None:
    read = CodeRead("QR Code", "A", QUAD, sure=True, agreeing=1, quality=1.0)
    untold = PlaceLook("A-1", QUAD, 1.0, Occupancy.UNSURE)
    half = replace(untold, fill=PlaceFill(None, 0.1))
    codes = CodeSet(1, 1, 64, 48, (read,), (untold, half), {"read": math.nan})
    assert repr(_read_back(codes)) == repr(codes)


def test_a_tick_tells_no_vehicle_from_one_that_tells_no_height() -> None:
    assert _read_back(TickInput(1)) == TickInput(1)
    tick = TickInput(1, vehicle=SILENT)
    assert repr(_read_back(tick)) == repr(tick)


def test_what_was_read_is_left_as_it_is() -> None:
    recorded = msgspec.json.decode(encode(TickInput(1, vehicle=SILENT)))
    with_nan(recorded, TickInput)
    assert recorded == msgspec.json.decode(encode(TickInput(1, vehicle=SILENT)))


@pytest.mark.parametrize("value", [None, 1.5, "x", [None], {"part": 3, "many": {}, "pair": [None]}])
def test_what_is_no_such_record_is_refused_and_not_filled(value: object) -> None:
    with pytest.raises(msgspec.ValidationError):
        converted(value, Record)


def test_a_missing_part_is_no_number() -> None:
    with pytest.raises(msgspec.ValidationError, match=r"Expected `object`, got `null` - at `\$\.part`"):
        converted(msgspec.json.decode(encode(SOME)) | {"part": None}, Record)
