"""The emulator writes the recorded navdata and takes the recorded client's commands as a drone does."""

from __future__ import annotations

from typing import Any

import pytest

from flightd.sim.ardrone.navdata_writer import NavdataReport, bootstrap, packet
from tests.protocol.ardrone import golden

GOLDEN = golden.recorded()
DEMO_PACKETS = [p for p in GOLDEN["navdata"] if p["name"].startswith("demo_")]


@pytest.mark.parametrize("recorded", DEMO_PACKETS, ids=lambda p: p["name"])
def test_demo_packets_are_written_byte_for_byte(recorded: dict[str, Any]) -> None:
    raw, demo = recorded["raw"], recorded["raw"]["demo"]
    report = NavdataReport(
        state=raw["state"],
        sequence=raw["sequence"],
        major=demo["major"],
        minor=demo["minor"],
        battery_percent=demo["battery_percent"],
        theta_mdeg=demo["theta_mdeg"],
        phi_mdeg=demo["phi_mdeg"],
        psi_mdeg=demo["psi_mdeg"],
        altitude_mm=demo["altitude_mm"],
        vx_mmps=demo["vx_mm_s"],
        vy_mmps=demo["vy_mm_s"],
        vision=bool(raw["vision_flag"]),
    )
    tags = [tag for tag, _ in raw["options_tag_size"][:-1]]
    written, wanted = packet(report, tags), bytes.fromhex(recorded["hex"])
    assert len(written) == len(wanted)
    modelled = 16 + 148 + 4 if 16 in tags else len(wanted)  # the emulator's vision detects no markers
    assert written[:modelled] == wanted[:modelled]


@pytest.mark.parametrize(
    "recorded", [p for p in GOLDEN["navdata"] if p["bytes"] == 24], ids=lambda p: p["name"]
)
def test_bootstrap_packets_are_written_byte_for_byte(recorded: dict[str, Any]) -> None:
    assert bootstrap(recorded["raw"]["state"]).hex() == recorded["hex"]
