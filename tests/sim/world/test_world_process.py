"""The world in a process of its own: what it dies of is told."""

from __future__ import annotations

import multiprocessing
import socket
from pathlib import Path

import pytest

from flightd.app.simulation.world_process import run_world, watch_world
from flightd.config.paths import shipped
from flightd.core.errors import FlightdError, RunError, UnavailableError
from flightd.runtime.message_channel import Channel
from flightd.runtime.within import Within
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.world import FrontSpec, WorldSpec
from flightd.site.site_file import load_site
from tests.rigs.event_loops import real


def death_of(spec: WorldSpec, log: Path) -> FlightdError:
    async def main() -> None:
        context = multiprocessing.get_context("spawn")
        channel = Channel()
        process = context.Process(target=run_world, args=(spec, 1.0, log, channel.theirs))
        process.start()
        channel.theirs.close()
        async with Within(60.0):
            await watch_world(process, channel, lambda _index, _begins: None)

    with pytest.raises(FlightdError) as told:
        real(main())
    return told.value


def test_what_a_person_can_mend_is_told_as_it_is(tmp_path: Path) -> None:
    site = load_site(shipped("site-demo.toml"))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        spec = WorldSpec(site, 1, ("127.0.0.1", 9), vehicle_ports=(taken.getsockname()[1],))
        death = death_of(spec, tmp_path / "truth.mcap")
    assert isinstance(death, UnavailableError)
    assert "cannot listen" in str(death)


def test_a_fault_of_the_world_itself_is_named(tmp_path: Path) -> None:
    spec = WorldSpec(load_site(shipped("site-demo.toml")), 1, ("127.0.0.1", 9), vehicle_ports=(0, 0))
    death = death_of(spec, tmp_path / "truth.mcap")
    assert isinstance(death, RunError)
    assert "the simulated world failed: ValueError" in str(death)


def test_a_camera_that_cannot_draw_ends_the_world_and_names_itself(tmp_path: Path) -> None:
    broken = RackAppearance(shares="no shares at all")  # type: ignore[arg-type]
    front = FrontSpec(("127.0.0.1", 9), appearance=broken)
    spec = WorldSpec(load_site(shipped("site-racks-small.toml")), 1, ("127.0.0.1", 9), front=front)
    death = death_of(spec, tmp_path / "truth.mcap")
    assert isinstance(death, RunError)
    assert str(death).startswith("the simulated front camera cannot draw picture 0: AttributeError: ")
    assert "\n" not in str(death)
