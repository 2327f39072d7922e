"""A site flown in the simulator by the station: started, told, one at a time, ended, and by whom."""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from websockets.asyncio.client import ClientConnection

from flightd.adapters.ground_link.client import Address
from flightd.ground.access.roles import Role
from flightd.ground.server import Listening
from flightd.ground.site_page import simulated_flight
from tests.rigs.event_loops import in_real_time
from tests.rigs.waiting import until as until_true
from tests.web.people_rig import audited, with_people
from tests.web.served import Station, served, told

SITE = Path(__file__).parents[2] / "configs" / "site-racks-small.toml"
NOBODY = ("simulation", Address("127.0.0.1", 1, 1))
"""A drone that has the name already."""
STAND_IN = """
import json, os, pathlib, signal, sys, time
out = pathlib.Path(sys.argv[sys.argv.index("--out") + 1])
(out / "pid").write_text(str(os.getpid()))
assert pathlib.Path(sys.argv[sys.argv.index("--warehouse") + 1]).is_file()
if STUBBORN:
    signal.signal(signal.SIGTERM, lambda *_: (out / "asked").open("a").write("x"))
print("hold 0/8 nodes", file=sys.stderr, flush=True)
if GOOD:
    summary = {"mission": "done", "reason": "all nodes visited", "more": 1}
    (out / "summary.json").write_text(json.dumps(summary))
else:
    for _ in range(60):
        time.sleep(1)
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "sites"
    folder.mkdir()
    shutil.copy(SITE, folder / "hall 1.toml")
    return folder


def stand_in(monkeypatch: pytest.MonkeyPatch, *, good: bool = False, stubborn: bool = False) -> None:
    """Another program flies in the simulator's place."""
    code = STAND_IN.replace("STUBBORN", str(stubborn)).replace("GOOD", str(good))
    monkeypatch.setattr(simulated_flight, "SIMULATOR", (sys.executable, "-c", code))
    monkeypatch.setattr(simulated_flight, "_LOOK_S", 0.05)


async def ask(
    station: Station, method: str, name: str = "hall 1.toml", by: Mapping[str, str] | None = None
) -> tuple[int, str]:
    path = f"/api/site/simulation?name={quote(name)}"
    return await station.ask(method, path, {"Origin": station.origin, **(by or {})})


def _holds(file: Path, text: str) -> bool:
    return file.exists() and file.read_text() == text


async def until(page: ClientConnection, **wanted: Any) -> dict[str, Any]:
    """What is told of the simulated flight, once it is as wanted."""
    while True:
        said: dict[str, Any] = await told(page, "simulation", "")
        if wanted.items() <= said.items():
            return said


def is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


@in_real_time
async def test_one_at_a_time_is_a_drone_of_the_station_until_it_is_ended(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stand_in(monkeypatch)
    state = tmp_path / "state"
    async with served(NOBODY, folder=folder, state=state) as station, station.page() as page:
        assert (await until(page, site="", good=None))["admins_only"] is False
        assert (await ask(station, "POST", "none.toml"))[0] == 400
        assert (await ask(station, "DELETE"))[0] == 409
        code, text = await ask(station, "POST")
        assert code == 200
        below = json.loads(text)["folder"]
        assert below.startswith("simulated/")
        assert below.endswith("-hall-1")
        said = await until(page, last="hold 0/8 nodes", drone="simulation-2")
        assert (said["site"], said["folder"], said["good"]) == ("hall 1.toml", below, None)
        code, text = await ask(station, "POST")
        assert (code, "hall 1.toml is flown already" in text) == (409, True)
        assert (await station.act("simulation-2", id="12345678", command="stop"))[0] == 503, "it is known"
        assert (await ask(station, "DELETE"))[0] == 200
        await until(page, drone="", good=False, last="hold 0/8 nodes")
        assert (await station.act("simulation-2", id="12345679", command="stop"))[0] == 404
        assert not is_alive(int((folder / below / "pid").read_text()))
    acts = [(line["act"], line["outcome"], line["text"]) for line in audited(state)]
    assert ("POST", "accepted", f"hall 1.toml into {below}; HTTP 200") in acts
    assert ("DELETE", "accepted", "HTTP 200") in acts


@in_real_time
async def test_a_good_flight_is_told_as_its_summary_has_it_and_may_be_flown_again(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stand_in(monkeypatch, good=True)
    async with served(folder=folder) as station, station.page() as page:
        assert (await ask(station, "POST"))[0] == 200
        await until(page, drone="", good=True, last="done: all nodes visited")
        monkeypatch.setattr(simulated_flight, "SIMULATOR", ("/no/such/simulator",))
        monkeypatch.setattr(simulated_flight, "FOLDER", "again")
        assert (await ask(station, "POST"))[0] == 200
        await until(page, drone="", good=False, last="it cannot be started: No such file or directory")


@in_real_time
async def test_it_is_told_to_end_as_often_as_people_ask_and_killed_at_the_stations_end(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stand_in(monkeypatch, stubborn=True)
    monkeypatch.setattr(simulated_flight, "_END_S", 0.2)
    async with served(folder=folder) as station, station.page() as page:
        below = json.loads((await ask(station, "POST"))[1])["folder"]
        await until(page, last="hold 0/8 nodes")
        pid = int((folder / below / "pid").read_text())
        for asked in ("x", "xx"):
            assert (await ask(station, "DELETE"))[0] == 200
            await until_true(partial(_holds, folder / below / "asked", asked))
        assert is_alive(pid)
    assert not is_alive(pid)
    assert (folder / below / "asked").read_text() == "xx", "the station's own end is no third wish"


@in_real_time
async def test_where_other_machines_reach_the_station_it_is_an_admins(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stand_in(monkeypatch, good=True)
    monkeypatch.setattr(Listening, "is_beyond", True)
    keys = with_people(tmp_path)
    async with served(folder=folder, state=tmp_path, login=True) as station:
        answers = {}
        for role in Role:
            by = {"Authorization": f"Bearer {keys[role]}"}
            answers[role] = await ask(station, "POST", by=by)
    assert [answers[role][0] for role in Role] == [403, 409, 200]
    assert "an admin has flights simulated" in answers[Role.OPERATOR][1]
