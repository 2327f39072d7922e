"""Video: real H.264 over TCP, in virtual time."""

from __future__ import annotations

import asyncio
import contextlib
import sys
from collections.abc import AsyncIterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from flightd.adapters.vehicle.ardrone.camera import SLOTS, ArDroneCamera
from flightd.adapters.vehicle.ardrone.clock_counters import WrappingCounter
from flightd.adapters.vehicle.ardrone.pave import FrameType, PaveFrame, PaveParser
from flightd.adapters.vehicle.ardrone.settings import DroneCamera
from flightd.adapters.vehicle.ardrone.video import MAX_BACKLOG, Backlog, DecodedFrame, Decoder, VideoStream
from flightd.config.paths import shipped
from flightd.core.errors import UnavailableError
from flightd.core.types import Image
from flightd.runtime.clock import LoopClock
from flightd.runtime.frame_ring import FrameRing, FrameTicket
from flightd.sim.ardrone.front_camera import front_peer
from flightd.sim.ardrone.server import ArDroneServer
from flightd.sim.ardrone.video import Encoder, Packer, VideoChannel, is_idr
from flightd.sim.racks.appearance import RackAppearance
from flightd.site.site_file import load_site
from tests.protocol.ardrone import golden
from tests.rigs.ardrone import ANY_PORTS, bench, ended, make_drone
from tests.rigs.event_loops import virtual
from tests.rigs.held_time import held

FRAMES = PaveParser().feed(golden.pave_68())
PERIOD_S = 1 / 30


def bars(n: int, bgr: tuple[int, int, int] = (255, 255, 255)) -> Image:
    """A picture with a bar whose place tells its number."""
    picture = np.full((360, 640, 3), 30, np.uint8)
    picture[:, 8 * (n % 70) : 8 * (n % 70) + 40] = bgr
    return picture


def number_of(picture: Image) -> int:
    columns = np.flatnonzero(picture.mean(axis=(0, 2)) > 140)
    return round(float(columns[0]) / 8)


class Watching:
    """A drone that shows numbered pictures, and a stream that receives them."""

    def __init__(
        self, server: ArDroneServer, stream: VideoStream, pictures: list[DecodedFrame], clock: LoopClock
    ):
        self.server = server
        self.stream = stream
        self.pictures = pictures
        self.clock = clock
        self.shown = 0

    async def show(self, count: int) -> None:
        for _ in range(count):
            await asyncio.sleep(PERIOD_S)
            self.server.show(bars(self.shown))
            self.shown += 1
        await asyncio.sleep(0.005)


@contextlib.asynccontextmanager
async def watching(header_bytes: int = 64, latency_s: float = 0.0) -> AsyncIterator[Watching]:
    clock = LoopClock()
    async with ArDroneServer(make_drone(), clock, ANY_PORTS, video_header_bytes=header_bytes) as server:
        pictures: list[DecodedFrame] = []
        stream = VideoStream((server.ports.host, server.ports.video), latency_s, clock, pictures.append, held)
        task = asyncio.create_task(stream.run())
        try:
            yield Watching(server, stream, pictures, clock)
        finally:
            await ended(task)


def test_the_recorded_video_of_a_real_drone_is_decoded() -> None:
    decoder = Decoder()
    pictures = [decoder.newest([frame.payload]) for frame in FRAMES]
    for picture in pictures:
        assert picture is not None
        assert picture.shape == (360, 640, 3)
        assert picture.std() > 10
    first, last = pictures[0], pictures[-1]
    assert first is not None
    assert last is not None
    assert np.abs(first.astype(int) - last.astype(int)).mean() < 20, "five frames of one scene"


@pytest.mark.parametrize("header_bytes", [64, 68])
def test_pictures_arrive_in_order_and_as_they_were(header_bytes: int) -> None:
    async def main() -> None:
        async with watching(header_bytes) as w:
            await w.show(60)
            numbers = [number_of(picture.bgr) for picture in w.pictures]
            assert len(numbers) >= 40
            assert numbers == list(range(numbers[0], 60))
            wanted = bars(numbers[-1])
            assert np.abs(w.pictures[-1].bgr.astype(int) - wanted.astype(int)).mean() < 4
            assert not w.pictures[-1].bgr.flags.writeable

    virtual(main())


def test_nothing_is_shown_before_the_first_whole_picture() -> None:
    async def main() -> None:
        async with watching() as w:
            await w.show(14)
            assert w.pictures == []
            assert w.stream.dropped >= 12
            await w.show(6)
            assert w.pictures

    virtual(main())


def test_stamps_follow_the_encoders_clock_less_the_latency() -> None:
    async def main() -> None:
        async with watching(latency_s=0.1) as w:
            await w.show(40)
            for picture in w.pictures:
                assert picture.arrival_ns - picture.stamp_ns == pytest.approx(100_000_000, abs=1_100_000)
            stamps = [picture.stamp_ns for picture in w.pictures]
            assert stamps == sorted(set(stamps))

    virtual(main())


def test_a_silent_stream_is_opened_anew_and_waits_for_a_whole_picture() -> None:
    async def main() -> None:
        async with watching() as w:
            await w.show(30)
            before = len(w.pictures)
            await asyncio.sleep(2.0)
            assert w.stream.connections == 2
            await w.show(40)
            numbers = [number_of(picture.bgr) for picture in w.pictures[before:]]
            assert numbers == list(range(numbers[0], 70))
            assert len(numbers) > 20

    virtual(main())


def test_video_that_is_not_there_yet_is_asked_for_again() -> None:
    async def main() -> None:
        clock = LoopClock()
        pictures: list[DecodedFrame] = []
        async with ArDroneServer(make_drone(), clock, ANY_PORTS) as server:
            ports = server.ports
        stream = VideoStream((ports.host, ports.video), 0.0, clock, pictures.append, held)
        task = asyncio.create_task(stream.run())
        await asyncio.sleep(5.0)
        async with ArDroneServer(make_drone(), clock, ports) as server:
            w = Watching(server, stream, pictures, clock)
            await asyncio.sleep(1.0)
            await w.show(30)
            assert pictures
            await ended(task)

    virtual(main())


def test_frames_lost_at_the_drone_are_waited_out() -> None:
    async def main() -> None:
        async with watching() as w:
            await w.show(35)
            w.server.congested = True
            await w.show(1)
            w.server.congested = False
            shown_before = w.shown
            await w.show(30)
            after = [
                number_of(picture.bgr) for picture in w.pictures if number_of(picture.bgr) >= shown_before
            ]
            assert after
            assert after[0] > shown_before, "no picture that leans on the lost one"
            assert after == list(range(after[0], w.shown))

    virtual(main())


def test_undecodable_data_restarts_at_the_next_whole_picture() -> None:
    async def main() -> None:
        async with watching() as w:
            await w.show(35)
            w.server.send_video(Packer(first_number=1 << 20).pack([b"\x65" + bytes(range(1, 200))], 0))
            await w.show(40)
            assert w.stream.broken == 1
            assert [number_of(picture.bgr) for picture in w.pictures[-10:]] == [
                65,
                66,
                67,
                68,
                69,
                0,
                1,
                2,
                3,
                4,
            ]

    virtual(main())


def frames(kinds: str, first: int = 100) -> list[PaveFrame]:
    """Frames numbered on: I for an IDR, P for what leans on it, - for a lost one."""
    header = FRAMES[0].header
    types = {"I": FrameType.IDR, "P": FrameType.P}
    return [
        PaveFrame(replace(header, frame_number=first + n, frame_type=types[kind]), b"x")
        for n, kind in enumerate(kinds)
        if kind != "-"
    ]


@pytest.mark.parametrize(
    ("kinds", "kept"),
    [
        ("PPP", ""),
        ("PPIPP", "IPP"),
        ("IPPPIP", "IP"),
        ("IPP-PP", ""),
        ("IPP-PPIP", "IP"),
        ("IPP-IP", "IP"),
        ("I" + "P" * MAX_BACKLOG, ""),
    ],
)
def test_only_what_can_be_decoded_and_is_new_waits(kinds: str, kept: str) -> None:
    backlog = Backlog()
    for frame in frames(kinds):
        backlog.add(frame, 0)
    waiting = backlog.take()
    assert "".join("I" if frame.header.frame_type == FrameType.IDR else "P" for frame, _ in waiting) == kept
    assert backlog.dropped + len(waiting) == len(kinds.replace("-", ""))


def test_of_several_waiting_pictures_only_the_newest_is_shown() -> None:
    encoder = Encoder()
    packer = Packer()
    stream = b"".join(packer.pack(encoder.encode(bars(n)), n * 33) for n in range(10))
    payloads = [frame.payload for frame in PaveParser().feed(stream)]
    picture = Decoder().newest(payloads)
    assert picture is not None
    assert number_of(picture) == 9


def test_the_emulated_stream_is_what_the_drone_sends() -> None:
    encoder, packer = Encoder(), Packer(68)
    sequence = [encoder.encode(bars(n)) for n in range(31)]
    assert [n for n, units in enumerate(sequence) if is_idr(units)] == [0, 15, 30]
    parsed = PaveParser().feed(b"".join(packer.pack(units, 33 * n) for n, units in enumerate(sequence)))
    real = FRAMES[0].header
    for frame, units in zip(parsed, sequence, strict=True):
        header = frame.header
        assert (header.version, header.video_codec, header.header_size) == (2, 4, 68)
        assert (header.encoded_width, header.encoded_height) == (real.encoded_width, real.encoded_height)
        assert (header.display_width, header.display_height) == (real.display_width, real.display_height)
        assert header.frame_type == (FrameType.IDR if is_idr(units) else FrameType.P)
        assert header.advertised_size == header.payload_size == len(frame.payload)
        types = [unit[0] & 0x1F for unit in units]
        assert types == ([7, 8, 5] if is_idr(units) else [1])
        assert frame.payload[: header.sps_size][4:5] == (b"\x67" if is_idr(units) else b"")
    positions = [frame.header.stream_pos_lw for frame in parsed]
    for (one, frame), after in zip(zip(positions, parsed, strict=True), positions[1:], strict=False):
        header = frame.header
        assert after - one == header.payload_size - header.sps_size - header.pps_size


# One stream, two cameras


def test_each_picture_goes_to_the_camera_it_shows_and_none_during_the_switch() -> None:
    async def main() -> None:
        async with bench() as b:
            tickets: dict[DroneCamera, list[FrameTicket]] = {DroneCamera.DOWN: [], DroneCamera.FRONT: []}
            camera = ArDroneCamera(
                b.vehicle,
                0.0,
                b.clock,
                {kind: taken.append for kind, taken in tickets.items()},
                held,
            )
            task = asyncio.create_task(camera.run())
            await b.configured()
            colours = {0: (60, 60, 220), 1: (60, 220, 60)}
            seen: dict[DroneCamera, list[np.ndarray[Any, Any]]] = {
                DroneCamera.DOWN: [],
                DroneCamera.FRONT: [],
            }

            async def film(count: int) -> None:
                for n in range(count):
                    await asyncio.sleep(PERIOD_S)
                    b.server.show(bars(n, colours[b.server.channel]))
                    await asyncio.sleep(0.001)
                    for kind, taken in tickets.items():
                        for ticket in taken:
                            ring = FrameRing.attach(ticket.ring, SLOTS, ticket.width_px, ticket.height_px)
                            picture = ring.pixels(ticket.slot).copy()
                            ring.check(ticket.slot, ticket.seq)
                            ring.close()
                            seen[kind].append(picture.reshape(-1, 3).max(axis=0))
                        taken.clear()

            await film(60)
            b.vehicle.select_camera(DroneCamera.FRONT)
            await film(60)
            assert camera.unassigned > 0
            assert len(seen[DroneCamera.DOWN]) > 20
            assert len(seen[DroneCamera.FRONT]) > 20
            for top in seen[DroneCamera.DOWN][1:]:
                assert top[1] > top[2] + 60
            for top in seen[DroneCamera.FRONT]:
                assert top[2] > top[1] + 60
            await ended(task)

    virtual(main())


def test_a_camera_that_is_started_again_shows_on() -> None:
    async def main() -> None:
        async with bench() as b:
            taken: list[FrameTicket] = []
            camera = ArDroneCamera(b.vehicle, 0.0, b.clock, {DroneCamera.DOWN: taken.append}, held)
            for _ in range(2):
                task = asyncio.create_task(camera.run())
                await b.configured()
                taken.clear()
                for n in range(60):
                    await asyncio.sleep(PERIOD_S)
                    b.server.show(bars(n, (60, 60, 220)))
                assert len(taken) > 20
                await ended(task)

    virtual(main())


def test_the_front_channel_shows_the_racks_and_the_bottom_one_the_floor() -> None:
    site = load_site(shipped("site-racks-small.toml"))

    async def main() -> None:
        async with bench() as b:
            taken: list[FrameTicket] = []
            camera = ArDroneCamera(b.vehicle, 0.0, b.clock, dict.fromkeys(DroneCamera, taken.append), held)
            front = front_peer(b.server, site, RackAppearance(), 1, b.clock, held)
            tasks = [asyncio.create_task(part.run()) for part in (camera, front)]
            await b.configured()
            floor = bars(0, (60, 220, 60))

            async def newest() -> Image:
                taken.clear()
                for _ in range(60):
                    await asyncio.sleep(PERIOD_S)
                    b.server.show(floor, camera=VideoChannel.BOTTOM)
                    await asyncio.sleep(0.001)
                ticket = taken[-1]
                ring = FrameRing.attach(ticket.ring, SLOTS, ticket.width_px, ticket.height_px)
                picture: Image = ring.pixels(ticket.slot).copy()
                ring.close()
                return picture

            def differs(picture: Image, other: Image) -> float:
                return float(np.abs(picture.astype(float) - other).mean())

            assert differs(await newest(), floor) < 10.0
            b.vehicle.select_camera(DroneCamera.FRONT)
            racks = await newest()
            assert differs(racks, floor) > 30.0
            assert racks.std() > 10.0
            b.vehicle.select_camera(DroneCamera.DOWN)
            assert differs(await newest(), floor) < 10.0
            for task in tasks:
                await ended(task)

    virtual(main())


def test_without_pyav_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(UnavailableError, match=r"extra ardrone.* -m pip install 'av"):
        Decoder()


def test_counters_that_wrap_go_on() -> None:
    counter = WrappingCounter(100)
    assert [counter.unwrap(value) for value in (90, 99, 3, 50, 98, 1, 0)] == [90, 99, 103, 150, 198, 201, 0]
