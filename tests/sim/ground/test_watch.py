"""`flightctl watch`: the screen shows what the link says, its keys command."""

from __future__ import annotations

import asyncio
import math

import pytest
from textual.widgets import RichLog, Static

from flightd.adapters.ground_link.client import GroundClient
from flightd.adapters.ground_link.messages.answers import Welcome
from flightd.adapters.ground_link.messages.base import Role
from flightd.adapters.ground_link.messages.floor import FloorStatus
from flightd.adapters.ground_link.messages.published import Position
from flightd.adapters.ground_link.peer import Peer
from flightd.adapters.ground_link.request_handler import RequestHandler
from flightd.cli.watch.floor_map import FloorMap, arrow
from flightd.cli.watch.screen import WatchApp
from flightd.core.types import CommandKind, Phase
from flightd.runtime.clock import LoopClock
from tests.rigs.event_loops import in_real_time
from tests.rigs.ground_link import SITE, address_of, event, local, serving, telling
from tests.rigs.waiting import until


def floor() -> FloorStatus:
    handler = RequestHandler(SITE, "s", lambda _: None)
    welcome = handler.answer(b'{"version":1,"id":"12345678","op":"hello"}', Peer("x", Role.VIEWER), 0)
    assert isinstance(welcome, Welcome)
    return welcome.floor


def text_of(app: WatchApp, name: str) -> str:
    widget = app.query_one(name)
    if isinstance(widget, RichLog):
        return "\n".join(line.text for line in widget.lines)
    assert isinstance(widget, Static)
    return "\n".join(
        "".join(segment.text for segment in widget.render_line(y)) for y in range(widget.size.height)
    )


@in_real_time
async def test_the_screen_shows_map_state_and_events_and_its_keys_command() -> None:
    async with serving(local()) as link, GroundClient(address_of(link), timeout_s=20) as client:
        app = WatchApp(client, await client.hello())
        async with app.run_test(size=(120, 40)) as screen, telling(link):
            await until(lambda: "FOLLOW" in text_of(app, "#title"))
            assert "A1" in text_of(app, "MapView")
            assert "→" in text_of(app, "MapView")
            state = text_of(app, "#state")
            for shown in ("A2 → A2", "80%", "GUIDED_NOGPS, armed", "detection", "1.60 m"):
                assert shown in state
            link.event(event("look out"))
            await until(lambda: "look out" in text_of(app, "#events"))
            for key in "prhls":
                await screen.press(key)
            await until(lambda: text_of(app, "#events").count("accepted") == 5)
            await until(lambda: link.silent_s(LoopClock().now_ns()) > 0)
        assert {command.kind for command in link.take_commands()} == {
            CommandKind.PAUSE,
            CommandKind.RESUME,
            CommandKind.HOME,
            CommandKind.LAND,
            CommandKind.STOP,
        }
        assert link.silent_s(LoopClock().now_ns() + 10**10) == 0.0, "it took its leave"


@in_real_time
async def test_a_refused_order_and_silence_are_shown() -> None:
    async with serving(local()) as link, GroundClient(address_of(link), timeout_s=20) as client:
        app = WatchApp(client, await client.hello(), attend=False)
        async with app.run_test(size=(120, 40)) as screen:
            async with telling(link, Phase.LAND):
                await until(lambda: "LAND" in text_of(app, "#title"))
                await screen.press("p")
                await until(lambda: "cannot pause in phase land" in text_of(app, "#events"))
            await until(lambda: "SILENT" in text_of(app, "#title"))


@in_real_time
async def test_a_daemon_started_anew_is_met_again() -> None:
    async with serving(local()) as first:
        address = address_of(first)
        again = local().model_copy(
            update={"status_port": address.status_port, "command_port": address.command_port}
        )
        client = GroundClient(address, timeout_s=20)
        await client.__aenter__()
        app = WatchApp(client, await client.hello(), attend=False)
        session = client.session
    async with client, app.run_test(size=(120, 40)):
        await asyncio.sleep(0)
        async with serving(again) as second, telling(second):
            await until(lambda: "started anew" in text_of(app, "#events"))
            assert client.session != session


@pytest.mark.parametrize(
    ("yaw_deg", "sign"), [(0, "→"), (90, "↓"), (180, "←"), (-90, "↑"), (-180, "←"), (40, "↘"), (359, "→")]
)
def test_the_arrow_points_where_the_nose_does(yaw_deg: float, sign: str) -> None:
    assert arrow(math.radians(yaw_deg)) == sign


@pytest.mark.parametrize(("columns", "rows"), [(80, 20), (30, 30), (12, 5), (200, 8)])
def test_the_map_fits_and_the_drone_is_where_it_should_be(columns: int, rows: int) -> None:
    drawn = FloorMap(floor(), columns, rows)
    for node in SITE.nodes.values():
        lines = drawn.draw(Position(node.x_m, node.y_m, 0.0, 0.0, 1.0), goal=node.id).plain.split("\n")
        assert len(lines) == rows
        assert {len(line) for line in lines} == {columns}
        column, row = drawn.cell(node.x_m, node.y_m)
        assert lines[row][column] == "→"
        assert sum(line.count("→") for line in lines) == 1


def test_the_map_keeps_directions_and_proportions() -> None:
    drawn = FloorMap(floor(), 120, 30)
    a1, a6, b1 = (drawn.cell(SITE.nodes[n].x_m, SITE.nodes[n].y_m) for n in ("A1", "A6", "B1"))
    assert a6[0] > a1[0]
    assert b1[1] > a1[1]
    per_m_across = (a6[0] - a1[0]) * 2 / SITE.distance_m("A1", "A6")
    per_m_down = (b1[1] - a1[1]) * 4 / 3.0
    assert per_m_across == pytest.approx(per_m_down, rel=0.1)


def test_a_position_off_the_map_is_drawn_at_its_edge() -> None:
    lines = FloorMap(floor(), 40, 10).draw(Position(1e6, -1e6, 0.0, 0.0, 1.0)).plain.split("\n")
    assert lines[0][-1] == "→"
