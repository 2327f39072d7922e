"""What the daemon does without when it is started anew, so that its vehicle may be in the air."""

from __future__ import annotations

import logging
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from flightd.adapters.store.settings_file import SettingsFile
from flightd.app.flight_orders import configured_order, resumed
from flightd.app.recording import FlightSetting
from flightd.app.run import Run, run_until_signal
from flightd.config.schema import Config, load_config
from flightd.core.errors import InputError, UnavailableError
from flightd.core.snapshot import Snapshot
from flightd.runtime.free_ports import free_port, free_ports
from flightd.site.site_file import load_site
from tests.rigs.event_loops import real

CONFIG = Path(__file__).parents[3] / "configs" / "sim.toml"
SITE = load_site(CONFIG.parent / "site-demo.toml")


@pytest.fixture
def taken_port() -> Iterator[int]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield int(server.getsockname()[1])


class Started:
    """A daemon whose vehicle is silent, so that it ends after two seconds in which it looked for it."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "a file"
        self.file.write_text("no folder")
        status, command = free_ports(2, socket.SOCK_STREAM)
        self.config = self._with(
            load_config(CONFIG),
            vehicle={"url": f"udpout://127.0.0.1:{free_port()}"},
            camera={"url": f"udp://127.0.0.1:{free_port()}"},
            ground={"listen": "127.0.0.1", "status_port": status, "command_port": command},
            vision={"workers": 1},
            recorder={"folder": None},
        )
        self.heard: list[int] = []
        """What its command port answered to each tick that was told."""

    @staticmethod
    def _with(config: Config, **sections: dict[str, object]) -> Config:
        changed = {key: getattr(config, key).model_copy(update=value) for key, value in sections.items()}
        return config.model_copy(update=changed)

    async def run(self, *, anew: bool, **sections: dict[str, object]) -> None:
        config = self._with(self.config, **sections)

        def observe(_: Snapshot) -> None:
            with socket.socket() as person:
                self.heard.append(person.connect_ex(("127.0.0.1", config.ground.command_port)))

        setting = FlightSetting(config, SITE, configured_order(config), None)
        run = Run(setting, SettingsFile(CONFIG), CONFIG.read_text(), started_anew=anew)
        await run_until_signal(run, observe)


def refused(started: Started, port: int, part: str) -> dict[str, dict[str, object]]:
    parts: dict[str, dict[str, dict[str, object]]] = {
        "record": {"recorder": {"folder": started.file / "flights"}},
        "ground": {"ground": {"command_port": port}},
        "audit": {"ground": {"audit": started.file / "audit.jsonl"}},
        "metrics": {"metrics": {"listen": f"127.0.0.1:{port}"}},
    }
    return parts[part]


@pytest.mark.parametrize("part", ["record", "ground", "audit", "metrics"])
def test_in_the_air_the_vehicle_is_looked_after_without_what_cannot_be_had(
    part: str, tmp_path: Path, taken_port: int, caplog: pytest.LogCaptureFixture
) -> None:
    started = Started(tmp_path)
    sections = refused(started, taken_port, part)
    with caplog.at_level(logging.WARNING), pytest.raises(UnavailableError) as told:
        real(started.run(anew=True, **sections))
    assert len(started.heard) > 5, "it ticked, and only then gave up on a vehicle that nobody hears"
    if part != "ground":
        assert set(started.heard) == {0}, "the ground may command"
    assert f"{told.value}; the vehicle may be in the air, it is done without" in caplog.messages


@pytest.mark.parametrize("part", ["record", "ground", "audit", "metrics"])
def test_on_the_ground_it_is_an_error_before_anything_runs(
    part: str, tmp_path: Path, taken_port: int
) -> None:
    started = Started(tmp_path)
    sections = refused(started, taken_port, part)
    with pytest.raises(UnavailableError):
        real(started.run(anew=False, **sections))
    assert started.heard == []


@pytest.mark.parametrize("left", [None, "no progress at all", '{"site": "demo"'])
def test_in_the_air_nothing_has_to_be_left_over(tmp_path: Path, left: str | None) -> None:
    config = load_config(CONFIG)
    path = tmp_path / "progress.json"
    if left is not None:
        path.write_text(left)
    mission = config.mission.model_copy(update={"progress": path})
    config = config.model_copy(update={"mission": mission})
    order = configured_order(config)
    with pytest.raises(InputError):
        resumed(order, config, CONFIG, SITE, wanted=True)
    assert resumed(order, config, CONFIG, SITE, wanted=True, in_air=True) == order
