"""The ground link over real loopback sockets: who gets in, what comes out, and what a flood does to it."""

from __future__ import annotations

import asyncio
import json
import random
import socket
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import zmq
import zmq.asyncio

from flightd.adapters.ground_link.client import GroundClient
from flightd.adapters.ground_link.link import ZmqGround
from flightd.adapters.ground_link.messages.answers import Accepted
from flightd.adapters.ground_link.messages.base import Role
from flightd.adapters.ground_link.messages.published import EventReport, StatusReport
from flightd.core.errors import InputError, RunError, UnavailableError
from flightd.core.preview import CameraName, Preview
from flightd.core.types import CommandKind, Phase
from flightd.runtime.clock import LoopClock
from flightd.runtime.free_ports import free_ports
from flightd.runtime.within import Within
from flightd.site.site import Aisle, Edge, Node
from tests.rigs.event_loops import in_real_time
from tests.rigs.ground_link import (
    SITE,
    Keyring,
    address_of,
    connected,
    event,
    local,
    serving,
    tell_once,
    telling,
)
from tests.rigs.patience import COMMAND_S
from tests.rigs.waiting import until

EXAMPLE = Path(__file__).parents[3] / "tools" / "ground_client.py"
LEAVING = """
import asyncio
import sys

from flightd.adapters.ground_link.client import Address, GroundClient


async def main():
    client = GroundClient(Address("127.0.0.1", *map(int, sys.argv[1:])))
    client._requests.reconnect_ivl = 1  # a second in place of two minutes
    async with client:
        await asyncio.sleep(5)


asyncio.run(main())
"""


@in_real_time
async def test_an_operator_is_told_what_happens_and_commands() -> None:
    async with serving(local()) as link, GroundClient(address_of(link)) as client:
        welcome = await client.hello()
        assert (welcome.role, welcome.client) == (Role.OPERATOR, "local")
        assert await client.status() is None
        await connected(client, link)
        link.event(event("look out"))
        tell_once(link, x_m=1.25)
        async with Within(20):
            heard = [message async for message in _until_event(client)]
        assert isinstance(heard[-1], EventReport)
        assert heard[-1].text == "look out"
        status = await client.status()
        assert status is not None
        assert (status.phase, status.node, status.nodes_planned) == (Phase.FOLLOW, "A2", 12)
        assert status.position is not None
        assert (status.position.x_m, round(status.position.speed_mps, 6)) == (1.25, 0.5)
        assert status.vehicle is not None
        assert status.vehicle.battery_frac == 0.8
        assert status.latency_ms["total"] == 71.0
        assert not (await client.order(CommandKind.GOTO, "A3", "order-0001")).repeated
        assert (await client.order(CommandKind.GOTO, "A3", "order-0001")).repeated
        (command,) = link.take_commands()
        assert (command.id, command.kind, command.node) == ("order-0001", CommandKind.GOTO, "A3")
        with pytest.raises(RunError, match="cannot start in phase follow"):
            await client.order(CommandKind.START)
        with pytest.raises(InputError, match="no node 'Z9'"):
            await client.order(CommandKind.GOTO, "Z9")
        with pytest.raises(InputError, match="keeps no inventory"):
            await client.inventory()
        assert (await client.hello()).events[-1].text == "look out"


@in_real_time
async def test_an_order_that_is_sent_again_while_the_first_waits_is_answered_twice_and_done_once() -> None:
    """As of a page that tries another way; also where no answer comes."""

    async def ordered(client: GroundClient) -> list[Any]:
        orders = [client.order(CommandKind.GOTO, "A3", "order-0001") for _ in range(2)]
        return await asyncio.gather(*orders, return_exceptions=True)

    async with serving(local()) as link, GroundClient(address_of(link)) as client:
        await connected(client, link)
        tell_once(link)
        assert [type(answer) for answer in await ordered(client)] == [Accepted] * 2
        assert len(link.take_commands()) == 1
        address = address_of(link)
    async with GroundClient(address, timeout_s=0.2) as client:
        silent = await ordered(client)
        assert [type(error) for error in silent] == [UnavailableError] * 2


async def _until_event(client: GroundClient) -> Any:
    async for message in client.published():
        yield message
        if isinstance(message, EventReport):
            return


@in_real_time
async def test_published_messages_are_numbered_without_a_gap() -> None:
    async with serving(local()) as link, GroundClient(address_of(link)) as client:
        await connected(client, link)
        numbers = []
        async with Within(20), telling(link):
            async for message in client.published():
                assert isinstance(message, StatusReport)
                numbers.append(message.seq)
                if len(numbers) == 20:
                    break
        assert numbers == list(range(numbers[0], numbers[0] + 20))


@in_real_time
async def test_beyond_loopback_only_listed_keys_come_in_and_the_key_is_the_role(tmp_path: Path) -> None:
    ring = Keyring.make(tmp_path)
    async with serving(ring.config()) as link:
        async with GroundClient(ring.address(link, "operator")) as client:
            assert (await client.hello()).role is Role.OPERATOR
            await connected(client, link)
            await client.order(CommandKind.PAUSE)
            await client.attend()
            assert link.silent_s(LoopClock().now_ns() + 10**9) >= 1.0
        async with GroundClient(ring.address(link, "viewer")) as client:
            assert (await client.hello()).role is Role.VIEWER
            await connected(client, link)
            with pytest.raises(RunError, match="viewer is a viewer"):
                await client.order(CommandKind.STOP)
            with pytest.raises(RunError, match="only operators attend"):
                await client.attend()
        async with GroundClient(ring.address(link, "stranger"), timeout_s=2.0) as client:
            with pytest.raises(UnavailableError, match="not on the daemon's list of clients"):
                await client.hello()
        async with GroundClient(address_of(link), timeout_s=2.0) as client:
            with pytest.raises(UnavailableError, match="wants a key"):
                await client.hello()
        assert [command.kind for command in link.take_commands()] == [CommandKind.PAUSE]
    lines = [json.loads(line) for line in (tmp_path / "audit.jsonl").read_text().splitlines()]
    assert [(line["client"], line["command"], line["outcome"]) for line in lines] == [
        ("operator", "pause", "accepted"),
        ("viewer", "stop", "role"),
    ]
    assert lines[0]["address"] == "127.0.0.1"


@in_real_time
async def test_a_stranger_hears_nothing_on_the_status_port_either(tmp_path: Path) -> None:
    ring = Keyring.make(tmp_path)
    async with (
        serving(ring.config()) as link,
        GroundClient(ring.address(link, "stranger")) as stranger,
        GroundClient(ring.address(link, "viewer")) as viewer,
    ):
        await connected(viewer, link)
        heard: list[object] = []

        async def listen() -> None:
            heard.append(await anext(aiter(stranger.published())))

        async with asyncio.TaskGroup() as tasks:
            listening = tasks.create_task(listen())
            async with Within(20), telling(link):
                numbers = 0
                async for _ in viewer.published():
                    numbers += 1
                    if numbers == 20:
                        break
            listening.cancel()
        assert heard == []


@in_real_time
async def test_a_plain_req_socket_and_json_are_a_whole_client() -> None:
    """What the guide shows, without a line of flightd."""
    async with serving(local()) as link:
        address = address_of(link)
        with zmq.asyncio.Context() as context, context.socket(zmq.REQ) as req:
            req.linger = 0
            req.connect(address.endpoint(address.command_port))
            await req.send_json({"version": 1, "id": "my-first-order", "op": "command", "command": "start"})
            async with Within(20):
                answer = await req.recv_json()
        assert answer == {
            "answer": "accepted",
            "version": 1,
            "request": "my-first-order",
            "repeated": False,
        }


@in_real_time
async def test_the_example_client_shows_events_and_sends_a_tired_drone_home() -> None:
    async with serving(local()) as link:
        process = await asyncio.create_subprocess_exec(
            sys.executable, EXAMPLE, *link.endpoints, stdout=asyncio.subprocess.PIPE
        )
        assert process.stdout is not None
        told: list[str] = []

        async def read(lines: asyncio.StreamReader) -> None:
            told.extend([line.decode() async for line in lines])

        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(read(process.stdout))
            commands: list[CommandKind] = []

            def ordered_home() -> bool:
                link.event(event("look out"))
                tell_once(link, battery_frac=0.4)
                commands.extend(command.kind for command in link.take_commands())
                return bool(commands)

            await until(ordered_home)
            tell_once(link)
            process.kill()
        await process.wait()
        assert commands == [CommandKind.HOME]
        assert "warning test look out\n" in told


@in_real_time
async def test_pictures_come_on_request_at_a_capped_rate() -> None:
    async with serving(local(picture_fps=2.0)) as link:
        assert not link.picture_due(10**9), "nobody asked"
        async with GroundClient(address_of(link)) as one, GroundClient(address_of(link)) as two:
            async with asyncio.TaskGroup() as tasks:
                asked = [tasks.create_task(client.picture()) for client in (one, two)]
                await until(lambda: link.pictures_wanted == 2)
                assert link.picture_due(10**10)
                assert not link.picture_due(10**10 + 10**8), "twice a second at most"
                link.picture(Preview(CameraName.DOWN, 7, 10**10, b"jpeg"))
            for answer, jpeg in (task.result() for task in asked):
                assert (answer.seq, answer.stamp_ns, jpeg) == (7, 10**10, b"jpeg")
            assert not link.picture_due(10**11), "each request gets one"


@in_real_time
async def test_no_picture_is_said_so_and_not_waited_for_for_ever() -> None:
    async with serving(local()) as link, GroundClient(address_of(link)) as client:
        async with asyncio.TaskGroup() as tasks:
            refused = tasks.create_task(_refusal(client))
            await until(lambda: link.pictures_wanted)
            link.give_up_pictures(LoopClock().now_ns() + 4 * 10**9)
        assert "delivers no picture" in refused.result()


async def _refusal(client: GroundClient) -> str:
    with pytest.raises(InputError) as refused:
        await client.picture()
    return str(refused.value)


@in_real_time
async def test_junk_frames_of_every_shape_leave_the_link_whole() -> None:
    random_ = random.Random(4)
    async with serving(local()) as link:
        address = address_of(link)
        with zmq.asyncio.Context() as context, context.socket(zmq.DEALER) as dealer:
            dealer.linger = 0
            dealer.connect(address.endpoint(address.command_port))
            for _ in range(500):
                frames = [random_.randbytes(random_.randrange(60)) for _ in range(random_.randrange(1, 5))]
                await dealer.send_multipart(frames)
            for _ in range(500):
                async with Within(20):
                    answer = json.loads((await dealer.recv_multipart())[-1])
                assert answer["answer"] == "refused"
        async with GroundClient(address) as client:
            await client.order(CommandKind.START)
        assert len(link.take_commands()) == 1
        assert link.refused == 500


@in_real_time
async def test_what_is_not_zmq_and_what_is_too_long_only_loses_its_own_connection() -> None:
    async with serving(local()) as link:
        address = address_of(link)
        for port in (address.status_port, address.command_port):
            with socket.create_connection(("127.0.0.1", port)) as raw:
                raw.sendall(b"GET / HTTP/1.1\r\n\r\n" + random.Random(1).randbytes(2000))
        with zmq.asyncio.Context() as context, context.socket(zmq.DEALER) as dealer:
            dealer.linger = 0
            dealer.connect(address.endpoint(address.command_port))
            await dealer.send(b'{"version": 1, "id": "' + b"x" * 100_000)
            async with GroundClient(address) as client:
                await client.hello()
            assert link.requests >= 1
        async with GroundClient(address) as client:
            await client.order(CommandKind.START)
        assert len(link.take_commands()) == 1


@in_real_time
async def test_a_flood_does_not_keep_the_stop_waiting_nor_the_loop() -> None:
    """Judged by ratios and counts: between two requests of the flood the loop gets its turn."""
    async with serving(local()) as link:
        address = address_of(link)
        turns = 0

        async def count_turns() -> None:
            nonlocal turns
            while True:
                await asyncio.sleep(0.001)
                turns += 1

        with zmq.asyncio.Context() as context, context.socket(zmq.DEALER) as flood:
            flood.linger = 0
            flood.sndhwm = 5000
            flood.connect(address.endpoint(address.command_port))
            async with asyncio.TaskGroup() as tasks:
                counting = tasks.create_task(count_turns())
                for _ in range(3000):
                    await flood.send(b"junk")
                async with GroundClient(address, timeout_s=20.0) as client:
                    await client.order(CommandKind.STOP)
                assert link.requests < 3000, "the stop overtook the flood"
                assert [command.kind for command in link.take_commands()] == [CommandKind.STOP]
                await until(lambda: link.requests > 3000)
                counting.cancel()
        assert turns * 10 > 3000


class _TimedGround(ZmqGround):
    """Counts the seconds for which requests keep the loop."""

    busy_s = 0.0

    def _take(self, frames: Sequence[zmq.Frame]) -> None:
        began_s = time.monotonic()
        super()._take(frames)
        self.busy_s += time.monotonic() - began_s


@in_real_time
async def test_expensive_requests_leave_the_loop_most_of_its_time() -> None:
    """A hello on a map of 10,000 nodes takes milliseconds to answer; the flight does not wait for many."""
    aisles = [Aisle(f"R{i}", 0.0, 3.0 * i, (1.5,) * 99) for i in range(100)]
    crosses = [Edge(f"R{i}-1", f"R{i + 1}-1") for i in range(99)]
    nodes = {
        f"{aisle.id}-{k + 1}": Node(f"{aisle.id}-{k + 1}", 1.5 * k, aisle.y_m, aisle.id, k + 1)
        for aisle in aisles
        for k in range(100)
    }
    pads = (replace(SITE.home, node="R0-1"),)
    big = replace(SITE, aisles=tuple(aisles), crosses=tuple(crosses), nodes=nodes, edges=(), pads=pads)
    with _TimedGround(local(), big, LoopClock()) as link:
        address = address_of(link)
        with zmq.asyncio.Context() as context, context.socket(zmq.DEALER) as flood:
            flood.linger = 0
            flood.connect(address.endpoint(address.command_port))
            async with asyncio.TaskGroup() as tasks:
                serving_ = tasks.create_task(link.run())
                for i in range(60):
                    await flood.send_json({"version": 1, "id": f"request-{i}", "op": "hello"})
                await until(lambda: link.requests >= 10)
                began_s, busy_before_s, before = time.monotonic(), link.busy_s, link.requests
                await until(lambda: link.requests >= before + 30)
                share = (link.busy_s - busy_before_s) / (time.monotonic() - began_s)
                serving_.cancel()
        assert share < 0.35


@in_real_time
async def test_a_taken_port_is_named_and_nothing_is_left_open() -> None:
    with ZmqGround(local(), SITE, LoopClock()) as first:
        port = address_of(first).command_port
        taken = local().model_copy(update={"command_port": port})
        with pytest.raises(UnavailableError, match=f"command_port {port}"):
            ZmqGround(taken, SITE, LoopClock()).__enter__()


@in_real_time
async def test_nobody_there_is_said_so() -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    async with serving(local()) as link:
        address = address_of(link)
    nobody = replace(address, status_port=port, command_port=port)
    async with GroundClient(nobody, timeout_s=0.5) as client:
        with pytest.raises(UnavailableError, match="nobody listens"):
            await client.hello()


def test_who_asks_nothing_of_a_daemon_that_is_away_for_long_can_leave_it() -> None:
    """In a process of its own: one that hangs there can be ended in no other way."""
    words = [sys.executable, "-c", LEAVING, *map(str, free_ports(2, socket.SOCK_STREAM))]
    assert subprocess.run(words, timeout=COMMAND_S, check=False).returncode == 0
