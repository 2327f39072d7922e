"""Foxglove live: a foreign viewer sees warehouse, drone and pictures, and nothing that it does holds up the
station or a drone."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import sys
import time
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import ClientConnection
from websockets.exceptions import ConnectionClosed, InvalidStatus

pytest.importorskip("foxglove", reason="needs foxglove-sdk: pip install -e '.[dev]'")

import cv2
import numpy as np

from flightd.adapters.ground_link.camera_optics import camera_optics
from flightd.adapters.ground_link.client import Address
from flightd.adapters.ground_link.link import ZmqGround
from flightd.adapters.ground_link.messages.answers import PictureAnswer
from flightd.config.schema import load_config
from flightd.core.errors import InputError, UnavailableError
from flightd.core.preview import CameraName, Preview
from flightd.ground.foxglove_view import origin_gate
from flightd.ground.foxglove_view.drone_view import StationTime
from flightd.ground.foxglove_view.live_server import FoxgloveServer
from flightd.ground.foxglove_view.mailbox import Mailbox
from flightd.ground.foxglove_view.origin_gate import FOXGLOVES_PAGE, is_let_in
from flightd.ground.foxglove_view.reach import foxglove_address
from flightd.ground.messages import LinkPicture, PictureKey
from flightd.ground.server import Listening
from flightd.runtime.clock import LoopClock
from flightd.runtime.within import Within
from flightd.site.site_file import load_site
from tests.rigs.event_loops import in_real_time
from tests.rigs.ground_link import address_of, local, serving, telling
from tests.rigs.waiting import until
from tests.web.foreign_viewer import PROTOCOL, ForeignViewer, viewing
from tests.web.served import served, told

ROOT = Path(__file__).parents[2]
RACKS = load_site(ROOT / "configs" / "site-racks.toml")
FRONT = {"url": "device:/dev/video1", "mount_yaw_deg": 90.0}
OPTICS = camera_optics(load_config(ROOT / "configs" / "sim.toml").with_values(front_camera=FRONT))
PICTURE = cv2.imencode(".jpg", np.full((180, 320, 3), 90, np.uint8))[1].tobytes()
NOWHERE = Address("127.0.0.1", 1, 1)
DOWN, FRONT_IMAGE = "/demo/down_camera/image", "/demo/front_camera/image"


@contextlib.asynccontextmanager
async def flying() -> AsyncIterator[ZmqGround]:
    """A drone on a real link, with pictures of both cameras for whoever asks."""

    async def show(link: ZmqGround) -> None:
        seq = 0
        while True:
            seq += 1
            for camera in CameraName:
                now_ns = LoopClock().now_ns()
                if link.picture_due(now_ns, camera):
                    link.picture(Preview(camera, seq, now_ns, PICTURE))
            await asyncio.sleep(0.02)

    more = {"cameras": tuple(CameraName), "optics": OPTICS}
    async with serving(local(picture_fps=10.0), RACKS, **more) as link, telling(link):
        showing = asyncio.ensure_future(show(link))
        try:
            yield link
        finally:
            showing.cancel()
            await asyncio.wait([showing])


async def seen_all(viewer: ForeignViewer) -> dict[str, tuple[int, Any]]:
    """The next message of every topic of a drone."""
    topics = (
        "/demo/scene", "/demo/camera_frames", "/demo/drone_frame", "/demo/pose", DOWN, FRONT_IMAGE,
        "/demo/down_camera/calibration", "/demo/front_camera/calibration",
    )  # fmt: skip
    await viewer.subscribe(*topics)
    return {topic: await viewer.next(topic) for topic in topics}


@in_real_time
async def test_a_foreign_viewer_of_a_stations_own_process_sees_it_all_live() -> None:
    async with flying() as link:
        address = address_of(link)
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-m", "flightd", "ground", "--listen", "127.0.0.1:0", "--foxglove", "127.0.0.1:0",
            "--drone", f"demo=127.0.0.1:{address.status_port}/{address.command_port}",
            cwd=ROOT, stderr=asyncio.subprocess.PIPE, env=os.environ | {"PYTHONPATH": str(ROOT)},
        )  # fmt: skip
        assert process.stderr is not None
        try:
            assert b"ground station is at" in await process.stderr.readline()
            url = (await process.stderr.readline()).decode().split()[-1]
            async with viewing(url) as viewer:
                assert viewer.socket.subprotocol == PROTOCOL
                seen = await seen_all(viewer)
                check_seen(viewer, seen)
                process.send_signal(signal.SIGINT)
                assert await ended(viewer.socket), "it says good-bye"
            assert await asyncio.wait_for(process.wait(), 30) == 0
            said = (await process.stderr.read()).decode()
            assert said.endswith("flightd: the ground station was ended by SIGINT\n")
        finally:
            if process.returncode is None:
                process.kill()
                await process.wait()


async def ended(socket: ClientConnection) -> bool:
    """Whether the server closes it in order."""
    try:
        async with Within(30):
            while True:
                await socket.recv()
    except ConnectionClosed as closed:
        return closed.rcvd is not None


def check_seen(viewer: ForeignViewer, seen: dict[str, tuple[int, Any]]) -> None:
    now_ns = time.time_ns()
    assert viewer.server["capabilities"] == [], "a viewer is told, and asked nothing"
    assert viewer.channels["/demo/scene"]["schemaName"] == "foxglove.SceneUpdate"
    for stamp_ns, _ in seen.values():
        assert abs(now_ns - stamp_ns) < 20e9, "the station's own wall clock"
    entities = {entity["id"]: entity for entity in seen["/demo/scene"][1]["entities"]}
    assert len(entities["lines"]["cubes"]) == len(RACKS.lines)
    assert len(entities["racks"]["cubes"]) == len(RACKS.shelves)
    assert len(entities["bays"]["cubes"]) > len(RACKS.shelves)
    map_frame = entities["lines"]["frame_id"]
    pose = seen["/demo/pose"][1]
    assert (map_frame, pose["frame_id"]) == (f"{RACKS.name}/map", f"{RACKS.name}/map")
    position = pose["pose"]["position"]
    assert (position["x"], position["y"], position["z"]) == pytest.approx((1.0, -0.01, 1.6))
    (moved,) = seen["/demo/drone_frame"][1]["transforms"]
    assert (moved["parent_frame_id"], moved["child_frame_id"]) == (map_frame, "demo/drone")
    mounted = seen["/demo/camera_frames"][1]["transforms"]
    assert {found["child_frame_id"] for found in mounted} == {"demo/down_camera", "demo/front_camera"}
    for camera in CameraName:
        image = seen[f"/demo/{camera}_camera/image"][1]
        assert (image[2], image[3], image[4]) == (PICTURE, b"jpeg", f"demo/{camera}_camera".encode())


@in_real_time
async def test_the_lens_is_told_at_the_pictures_size_and_what_stands_to_whoever_comes_later() -> None:
    async with flying() as link:
        with FoxgloveServer(Listening("127.0.0.1", 0), ["demo"]) as server:
            async with served(("demo", address_of(link)), viewers=[server]):
                assert link.pictures_wanted == 0
                async with viewing(server.url) as viewer:
                    await seen_all(viewer)
                    calibration = "/demo/front_camera/calibration"
                    while (lens := (await viewer.next(calibration))[1])["width"] != 320:
                        pass
                    assert lens["K"][0] == pytest.approx(OPTICS[1].fx_px * 320 / OPTICS[1].width_px)
                await until(lambda: not server.has_use_for(PictureKey("demo", CameraName.DOWN)))
                await until(lambda: link.pictures_wanted == 0)
                async with viewing(server.url, "app://foxglove") as later:
                    await later.subscribe("/demo/scene", calibration, "/station")
                    assert (await later.next("/demo/scene"))[1]["entities"]
                    assert (await later.next(calibration))[1]["width"] == 320
                    counts = (await later.next("/station"))[1]
                    assert counts["viewers"] == 1
                    assert counts.keys() == {"viewers", "replaced", "viewers_behind"}
                assert silent_s(link) == 0.0, "a viewer attends no flight"


def silent_s(link: ZmqGround) -> float:
    return link.silent_s(LoopClock().now_ns())


@in_real_time
async def test_no_page_of_another_site_is_let_in_and_not_more_viewers_than_there_is_room_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(origin_gate, "MOST_VIEWERS", 2)
    with FoxgloveServer(Listening("127.0.0.1", 0), ["demo"]) as server:
        for origin in ("https://evil.example", "http://127.0.0.1:8080", "null"):
            with pytest.raises(InvalidStatus) as refused:
                async with viewing(server.url, origin):
                    pass
            assert refused.value.response.status_code == 403
        async with viewing(server.url, FOXGLOVES_PAGE) as first, viewing(server.url) as second:
            await first.advertised("/station")
            await second.advertised("/station")
            with pytest.raises(InvalidStatus) as refused:
                async with viewing(server.url):
                    pass
            assert refused.value.response.status_code == 503
        reader, writer = await asyncio.open_connection("127.0.0.1", server.where.port)
        writer.write(b"x" * 20_000)  # no head ever
        assert await reader.read() == b""
        writer.close()
        async with viewing(server.url) as later:
            await later.advertised("/station")


@pytest.mark.parametrize(
    ("head", "let_in"),
    [
        (b"GET / HTTP/1.1\r\nHost: a\r\n\r\n", True),
        (b"GET / HTTP/1.1\r\nOrigin: file://\r\n\r\n", True),
        (b"GET / HTTP/1.1\r\nORIGIN:https://app.foxglove.dev\r\n\r\n", True),
        (b"GET / HTTP/1.1\r\norigin : https://app.foxglove.dev.evil.example\r\n\r\n", False),
        (b"GET / HTTP/1.1\r\nOrigin: file://\r\nOrigin: HTTPS://evil.example\r\n\r\n", False),
        (b"GET / HTTP/1.1\r\nOrigin: http://app.foxglove.dev\r\n\r\n", False),
        (b"GET / HTTP/1.1\r\nOrigin:\r\n\r\n", False),
    ],
)
def test_whose_page_asks_is_known_by_its_origin(head: bytes, let_in: bool) -> None:
    assert is_let_in(head) is let_in


@in_real_time
async def test_a_viewer_that_takes_nothing_loses_pictures_and_holds_up_nobody() -> None:
    large = PICTURE + bytes(300_000)
    key = PictureKey("demo", CameraName.DOWN)
    async with serving(local(picture_fps=10.0)) as link, telling(link):
        with FoxgloveServer(Listening("127.0.0.1", 0), ["demo"]) as server:
            async with (
                served(("demo", address_of(link)), viewers=[server]) as station,
                station.page() as page,
                viewing(server.url) as quick,
            ):
                reader, writer = await asyncio.open_connection("127.0.0.1", server.where.port, limit=4096)
                await stall(reader, writer, quick)
                await quick.subscribe(DOWN, "/station")
                while (await quick.next("/station"))[1]["viewers"] < 2:
                    pass
                for seq in range(90):
                    answer = PictureAnswer(request="", seq=seq, stamp_ns=LoopClock().now_ns())
                    server.show(key, LinkPicture(answer, None, large))
                    assert (await quick.next(DOWN))[1][2] == large
                while (await quick.next("/station"))[1]["viewers_behind"] == 0:
                    pass
                await told(page, "status")
    writer.transport.abort()  # the server has ended without it


def test_pictures_that_newer_ones_replace_are_counted() -> None:
    box = Mailbox()
    for number in range(5):
        box.put("picture", number)
    box.put("status", "new")
    assert (box.dropped, box.holds("picture"), box.holds("other")) == (4, True, False)
    assert [box.take(), box.take()] == [("picture", 4), ("status", "new")]
    box.close()
    assert box.take() is None


async def stall(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, other: ForeignViewer) -> None:
    """Subscribe to pictures, and read nothing from then on."""
    await other.advertised(DOWN)
    key = "dGhlIHNhbXBsZSBub25jZQ=="
    head = [
        "GET / HTTP/1.1", "Host: 127.0.0.1", "Upgrade: websocket", "Connection: Upgrade",
        f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13", f"Sec-WebSocket-Protocol: {PROTOCOL}",
    ]  # fmt: skip
    writer.write("\r\n".join([*head, "", ""]).encode())
    assert b" 101 " in await reader.readuntil(b"\r\n\r\n")
    wanted = [{"id": 1, "channelId": other.channels[DOWN]["id"]}]
    said = json.dumps({"op": "subscribe", "subscriptions": wanted}).encode()
    writer.write(bytes([0x81, 0x80 | len(said), 0, 0, 0, 0]) + said)  # a text frame, masked by nothing
    await writer.drain()
    assert len(said) < 126


def test_it_is_reached_from_this_machine_alone_and_where_nobody_has_to_sign_in() -> None:
    assert foxglove_address("127.0.0.1", login=False) == Listening("127.0.0.1", 8765)
    assert foxglove_address("[::1]:9000", login=False) == Listening("::1", 9000)
    for beyond in ("0.0.0.0", "10.0.0.7:8765", "::"):
        with pytest.raises(InputError, match=r"--foxglove .*reaches beyond this machine.*no sign-in.*ssh -L"):
            foxglove_address(beyond, login=False)
    with pytest.raises(InputError, match=r"--foxglove: everybody shall sign in"):
        foxglove_address("127.0.0.1", login=True)
    with pytest.raises(InputError, match=r"--foxglove 1:2:x: expected ADDRESS"):
        foxglove_address("1:2:x", login=False)


def test_a_port_that_is_taken_is_told_in_one_line() -> None:
    with (
        FoxgloveServer(Listening("127.0.0.1", 0), []) as server,
        pytest.raises(UnavailableError, match=r"Address already in use; give --foxglove an address"),
    ):
        FoxgloveServer(Listening("127.0.0.1", server.where.port), [])


def test_stamps_become_the_stations_time_by_the_quickest_status() -> None:
    at = StationTime()
    assert at.at(5, 1_000) == 1_000, "nothing was heard"
    at.heard(100, 1_400)
    at.heard(200, 1_450)
    at.heard(300, 1_900)
    assert at.at(300, 1_900) == 1_550
    at.heard(400, 5_000_000_000)
    assert at.at(400, 0) == 5_000_000_000, "the clocks run apart"
    at.forget()
    assert at.at(5, 7) == 7
