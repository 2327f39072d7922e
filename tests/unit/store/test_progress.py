"""The file of stops left over: what survives, and what is refused."""

from __future__ import annotations

import asyncio
import math
import threading
from dataclasses import replace
from pathlib import Path

import pytest

from flightd.adapters.store import kept_file
from flightd.adapters.store.progress import LeftOver, NothingLeftError, load_left_over, progress_file
from flightd.app.build import plan_of
from flightd.app.flight_orders import configured_order, resumed
from flightd.config.schema import Config, load_config
from flightd.core.errors import InputError, TransientError
from flightd.core.flight_order import FlightOrder
from flightd.site.site_file import load_site
from tests.rigs.event_loops import real

CONFIGS = Path(__file__).parents[3] / "configs"
DEMO = load_site(CONFIGS / "site-demo.toml")
LARGE = load_site(CONFIGS / "site-large.toml")


async def kept(path: Path, *states: tuple[str, ...]) -> None:
    """Put the states one after the other, with and without time to write, then lose the task."""
    file = progress_file(path, DEMO)
    task = asyncio.ensure_future(file.run())
    for i, state in enumerate(states):
        file.put(LeftOver(state, "A1", 3.0))
        if i % 2 == 0:
            await asyncio.sleep(0.01)
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)


def test_the_newest_state_is_on_disk_however_it_ends(tmp_path: Path) -> None:
    path = tmp_path / "state" / "progress.json"
    states = (("A2", "A3", "B1"), ("A3", "B1"), ("B1",))
    for count, last in enumerate(states, start=1):
        real(kept(path, *states[:count]))
        assert load_left_over(path, DEMO) == LeftOver(last, "A1", 3.0)
    assert [file.name for file in path.parent.iterdir()] == ["progress.json"]


def test_a_finished_plan_leaves_nothing_to_resume(tmp_path: Path) -> None:
    path = tmp_path / "progress.json"
    with pytest.raises(NothingLeftError, match="nothing to resume"):
        load_left_over(path, DEMO)
    real(kept(path, ("A2",), ()))
    with pytest.raises(NothingLeftError, match="every stop was made"):
        load_left_over(path, DEMO)


def test_another_sites_progress_and_rubbish_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "progress.json"
    real(kept(path, ("A2",)))
    with pytest.raises(InputError, match="progress on site demo, not on large"):
        load_left_over(path, LARGE)
    for rubbish in ("{", "[]", '{"site": "demo"}', '{"site": "demo", "remaining": ["Z9"]}'):
        path.write_text(rubbish)
        with pytest.raises(InputError):
            load_left_over(path, DEMO)


def test_what_is_left_at_nodes_that_lie_elsewhere_now_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "progress.json"
    real(kept(path, ("A2", "A3")))
    for off_m, is_same in ((0.1, True), (0.6, False)):
        a3 = DEMO.nodes["A3"]
        site = replace(DEMO, nodes={**DEMO.nodes, "A3": replace(a3, x_m=a3.x_m + off_m)})
        if is_same:
            assert load_left_over(path, site).remaining == ("A2", "A3")
            continue
        with pytest.raises(
            InputError, match=r"progress\.json: A3 lies elsewhere on demo .* without --resume"
        ):
            load_left_over(path, site)


def test_a_disk_that_refuses_is_trouble_not_the_end(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file where a folder should be")
    file = progress_file(tmp_path / "state" / "progress.json", DEMO)

    async def run() -> None:
        file.put(LeftOver(("A2",), "A1", 0.0))
        await file.run()

    with pytest.raises(TransientError, match="progress"):
        real(run())


def test_a_disk_that_hangs_does_not_keep_the_end_of_a_flight_waiting(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The loop hands the vehicle back meanwhile."""
    released = threading.Event()
    monkeypatch.setattr(kept_file, "replace_file", lambda *_: released.wait(10.0))

    async def test() -> None:
        file = progress_file(tmp_path / "progress.json", DEMO)
        task = asyncio.ensure_future(file.run())
        file.put(LeftOver(("A2",), "A1", 3.0))
        await asyncio.sleep(0.05)
        task.cancel()
        for _ in range(3):
            await asyncio.sleep(0.01)
            assert not task.done()
        released.set()
        await asyncio.gather(task, return_exceptions=True)

    real(test())


def test_what_is_left_over_takes_the_place_of_the_configured_nodes(tmp_path: Path) -> None:
    config = load_config(CONFIGS / "sim.toml")
    path = tmp_path / "progress.json"
    with pytest.raises(InputError, match=r"mission\.progress names no file"):
        taken_up(config, path, wanted=True)
    mission = config.mission.model_copy(update={"progress": path, "resume": True})
    config = config.model_copy(update={"mission": mission})
    assert taken_up(config, path, wanted=False).nodes == ()
    with pytest.raises(InputError, match="nothing to resume"):
        taken_up(config, path, wanted=True)
    real(kept(path, ("A3", "B1")))
    order = taken_up(config, path, wanted=False)
    assert (order.nodes, order.pad) == (("A3", "B1"), "home")
    assert math.degrees(order.start_yaw_rad) == pytest.approx(171.9, abs=0.1)
    assert plan_of(config, DEMO, order).stops[0].visit


@pytest.mark.parametrize(
    "left", ["", "[]", '{"site": "large", "remaining": ["A2"], "stand": "A1", "yaw_rad": 0}']
)
def test_a_start_in_the_air_is_never_refused_for_what_is_left_over(tmp_path: Path, left: str) -> None:
    """It looks after what flies, whatever the file says."""
    path = tmp_path / "progress.json"
    config = load_config(CONFIGS / "sim.toml").with_values(mission={"progress": path})
    if left:
        path.write_text(left)
    else:
        real(kept(path, ("A2",), ()))  # on the way home
    with pytest.raises(InputError):
        taken_up(config, path, wanted=True)
    order = configured_order(config)
    assert resumed(order, config, path, DEMO, wanted=True, in_air=True) == order
    none = config.with_values(mission={"progress": None})
    assert resumed(order, none, path, DEMO, wanted=True, in_air=True) == order


def taken_up(config: Config, path: Path, *, wanted: bool) -> FlightOrder:
    return resumed(configured_order(config), config, path, DEMO, wanted=wanted)
