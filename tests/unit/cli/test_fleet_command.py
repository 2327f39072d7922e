"""`flightd fleet`: what it says of a flight."""

from __future__ import annotations

from tests.command import Command


def test_of_a_drone_alone_no_distance_to_another_one_is_told(flightd: Command) -> None:
    small = ("fleet", "sim", "--aisles", 2, "--nodes", 2, "--hours", 0.1)
    code, alone, _ = flightd(*small, "--drones", 1)
    assert code == 0
    assert "least charge" in alone
    assert "None" not in alone
    assert "least distance of two drones" in flightd(*small, "--drones", 2)[1]
