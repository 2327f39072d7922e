"""The configuration's reference: every key is there, with what it means, its unit and its range."""

from __future__ import annotations

import pytest

from flightd.config.reference import Row, rows, tables
from flightd.site.site_tables import SiteFile

ROWS = rows()
NUMBERS = {"number", "whole number"}


def row(name: str) -> Row:
    return next(row for row in ROWS if row.name == name)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_every_key_is_documented(row: Row) -> None:
    assert row.description, "says what it is for"
    if row.type in NUMBERS:
        assert row.range, "has a range"
    if "number" in row.type and "whole number" not in row.type:
        assert row.unit, "has a unit, in its name or beside it"


def test_every_table_says_what_it_is_for() -> None:
    assert [table.name for table in tables() if not table.description] == []
    assert "mission.expert" in {table.name for table in tables()}


def test_a_row_tells_type_unit_range_and_default_as_the_file_has_them() -> None:
    assert row("mission.height_m")[2:6] == ("number", "m", "0.5 to 20", "1.6")
    assert row("mission.site")[2:6] == ("path", "", "", "required")
    assert row("mission.nodes")[2:6] == ("list of text", "", "", "[]")
    assert row("mission.heading")[2:6] == ("choice", "", "along, shelf", '"along"')
    assert row("mission.autostart")[2:6] == ("true or false", "", "", "false")
    assert row("mission.expert.turn_accel_degps2")[2:6] == ("number", "deg/s^2", "above 0 to 720", "57.2958")
    assert row("scan.max_height_m")[2:6] == ("number", "m", "0.5 to 20", "")
    assert row("control.horizontal.kp")[2:6] == ("number", "m/s^2 per m", "0 to 100", "10")
    assert row("tracking.expert.noise.gust_s")[2:6] == ("number", "s", "above 0 to 60", "2.5")


def test_names_tell_apart_what_stands_in_several_tables() -> None:
    assert len({row.name for row in ROWS}) == len(ROWS)


def test_tables_that_may_be_repeated_are_told_with_their_keys() -> None:
    repeated = {table.name: table.repeated for table in tables(SiteFile)}
    assert (repeated["site"], repeated["aisle"], repeated["pad"]) == (False, True, True)
    assert {"aisle.id", "aisle.spacing_m", "rack.levels_m"} <= {row.name for row in rows(SiteFile)}
