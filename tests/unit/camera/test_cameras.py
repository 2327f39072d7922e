"""Cameras: notices of shared frames, recordings, and addresses that are wrong."""

from __future__ import annotations

import asyncio
import json
import socket
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.adapters.camera.capture import CaptureCamera
from flightd.adapters.camera.connect import connect_camera
from flightd.adapters.camera.shared_memory import SharedCamera
from flightd.adapters.camera.source import parse_source
from flightd.config.camera import CameraConfig
from flightd.core.errors import InputError, TransientError, UnavailableError
from flightd.runtime.clock import LoopClock
from flightd.runtime.frame_notice import FrameNotice, decode_notice, encode_notice
from flightd.runtime.frame_ring import FrameTicket
from flightd.runtime.free_ports import free_port
from tests.rigs.event_loops import real, virtual


def notice(seq: int, device_ns: int, width: int = 64) -> bytes:
    return encode_notice(FrameNotice("flightd-1-x", 4, seq % 4, seq, device_ns, width, 36))


def test_notices_become_tickets_in_our_time_and_junk_is_counted() -> None:
    troubles: list[str] = []

    async def main() -> tuple[list[FrameTicket], SharedCamera]:
        clock, tickets, port = LoopClock(), list[FrameTicket](), free_port()
        camera = SharedCamera(
            f"udp://127.0.0.1:{port}", (64, 36), 0.05, clock, tickets.append, troubles.append
        )
        running = asyncio.ensure_future(camera.run())
        await asyncio.sleep(0.01)
        loop = asyncio.get_running_loop()
        sender, _ = await loop.create_datagram_endpoint(
            asyncio.DatagramProtocol, remote_addr=("127.0.0.1", port)
        )
        for junk in (b"0", b"\xff\xfe", b"{}", notice(1, 5, width=640), b'{"version": 9}'):
            sender.sendto(junk)
        for seq in range(3):
            await asyncio.sleep(0.033)
            sender.sendto(notice(seq, clock.now_ns() + 10**15))
        await asyncio.sleep(0.01)
        running.cancel()
        await asyncio.wait([running])
        sender.close()
        return tickets, camera

    tickets, camera = virtual(main())
    assert [t.seq for t in tickets] == [0, 1, 2]
    assert camera.refused == 5
    assert len(troubles) == 1, "told once, not for every datagram"
    assert "not a frame notice" in troubles[0]
    assert all(abs(t.arrival_ns - t.stamp_ns - 50_000_000) < 10_000 for t in tickets)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        *(("slots", value) for value in (-3, 0, 1 << 20, 1 << 70)),
        *(("slot", value) for value in (-1, 1 << 20)),
        *(("seq", value) for value in (-1, 1 << 63)),
        *(("device_ns", value) for value in (1 << 63, -(1 << 64))),
        *(("width_px", value) for value in (0, -64, 1 << 20)),
        ("height_px", -36),
    ],
)
def test_a_notice_of_numbers_beyond_any_frame_is_refused(field: str, value: int) -> None:
    told = {"ring": "flightd-1-x", "slots": 4, "slot": 1, "seq": 1, "device_ns": 1, "width_px": 64}
    told["height_px"] = 36
    assert decode_notice(json.dumps(told).encode()).seq == 1
    with pytest.raises(InputError, match="not a frame notice"):
        decode_notice(json.dumps(told | {field: value}).encode())


@dataclass(frozen=True)
class Notice:
    """Of a frame `seq` frames after the first, sent so much after its exposure."""

    seq: int
    late_s: float


def delivered_of(notices: list[Notice], interval_s: float = 0.03) -> tuple[list[tuple[int, float]], int]:
    """What a shared camera makes of them: (seq, error of its stamp in seconds) of each frame, and how many it
    refused.  Its camera's clock is not ours."""
    delivered: list[tuple[int, float]] = []

    async def main() -> int:
        clock, port = LoopClock(), free_port()
        began_ns = clock.now_ns()

        def take(ticket: FrameTicket) -> None:
            exposed_s = began_ns * 1e-9 + ticket.seq * interval_s
            delivered.append((ticket.seq, ticket.stamp_ns * 1e-9 - exposed_s))

        camera = SharedCamera(f"udp://127.0.0.1:{port}", (64, 36), 0.05, clock, take, lambda _: None)
        running = asyncio.ensure_future(camera.run())
        loop = asyncio.get_running_loop()
        sender, _ = await loop.create_datagram_endpoint(
            asyncio.DatagramProtocol, remote_addr=("127.0.0.1", port)
        )
        for sent in sorted(notices, key=lambda n: n.seq * interval_s + n.late_s):
            due_s = sent.seq * interval_s + sent.late_s
            await asyncio.sleep(due_s - (clock.now_ns() - began_ns) * 1e-9)
            sender.sendto(notice(sent.seq, began_ns + round(sent.seq * interval_s * 1e9) + 10**15))
        await asyncio.sleep(0.01)
        running.cancel()
        await asyncio.wait([running])
        sender.close()
        return camera.refused

    refused = virtual(main())
    return delivered, refused


def test_a_notice_that_comes_late_and_out_of_order_is_refused_and_moves_no_other() -> None:
    """150 ms late, behind five newer ones."""
    notices = [Notice(seq, 0.2 if seq == 20 else 0.05) for seq in range(40)]
    delivered, refused = delivered_of(notices)
    assert [seq for seq, _ in delivered] == [seq for seq in range(40) if seq != 20]
    assert refused == 1
    assert all(abs(error_s) < 1e-3 for _, error_s in delivered)


@given(late=st.lists(st.integers(0, 300), min_size=30, max_size=30))
@settings(max_examples=25, deadline=None)
def test_whatever_order_notices_come_in_frames_are_delivered_in_that_of_exposure(late: list[int]) -> None:
    notices = [Notice(seq, 0.05 + (late_ms * 1e-3 if seq > 2 else 0.0)) for seq, late_ms in enumerate(late)]
    delivered, refused = delivered_of(notices)
    seqs = [seq for seq, _ in delivered]
    assert seqs == sorted(set(seqs))
    assert len(delivered) + refused == len(notices)
    assert all(abs(error_s) < 1e-3 for _, error_s in delivered), (
        "late ones too are told when they were exposed"
    )


def test_a_frame_exposed_long_ago_is_refused_though_no_newer_one_came() -> None:
    notices = [Notice(0, 0.05), Notice(1, 0.05), Notice(2, 1.5), Notice(60, 0.05)]
    delivered, refused = delivered_of(notices)
    assert [seq for seq, _ in delivered] == [0, 1, 60]
    assert refused == 1


def test_a_port_in_use_is_said_in_one_line() -> None:
    async def main() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
            taken.bind(("127.0.0.1", 0))
            url = f"udp://127.0.0.1:{taken.getsockname()[1]}"
            await SharedCamera(url, (64, 36), 0.0, LoopClock(), lambda _: None, print).run()

    with pytest.raises(UnavailableError, match="in use; is another flightd running"):
        real(main())


@pytest.mark.parametrize(
    "url",
    ["udp://", "udp://host", "http://x:1", "device:", "file:/no/such", "folder:/no/such", "stream:camera"],
)
def test_a_wrong_address_is_refused_before_anything_opens(url: str) -> None:
    async def main() -> None:
        connect_camera(CameraConfig(url=url), LoopClock(), lambda _: None, print)

    with pytest.raises(InputError, match=r"camera\.url"):
        real(main())


def write_pictures(folder: Path, count: int) -> None:
    for i in range(count):
        cv2.imwrite(str(folder / f"{i}.png"), np.full((36, 64, 3), i * 20, np.uint8))


def test_a_folder_is_played_in_order_and_its_end_is_told(tmp_path: Path) -> None:
    write_pictures(tmp_path, 4)
    (tmp_path / "broken.png").write_bytes(b"nothing")
    tickets: list[FrameTicket] = []

    async def main() -> None:
        source = parse_source(f"folder:{tmp_path}", 64, 36, 200.0)
        await CaptureCamera(source, 0.01, LoopClock(), tickets.append, print).run()

    with pytest.raises(TransientError, match="no more frames"):
        real(main())
    assert [t.seq for t in tickets] == [0, 1, 2, 3]
    assert all(t.stamp_ns < t.arrival_ns - 9_000_000 for t in tickets)


def test_pictures_of_another_size_are_refused_by_name(tmp_path: Path) -> None:
    write_pictures(tmp_path, 1)

    async def main() -> None:
        source = parse_source(f"folder:{tmp_path}", 640, 360, 200.0)
        await CaptureCamera(source, 0.0, LoopClock(), lambda _: None, print).run()

    with pytest.raises(TransientError, match="frames are 64x36, the configuration says 640x360"):
        real(main())
