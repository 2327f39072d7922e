"""Cameras: notices of shared pictures, recordings, and addresses that are wrong."""

from __future__ import annotations

import asyncio
import socket
from pathlib import Path

import cv2
import numpy as np
import pytest

from flightd.adapters.camera.capture import CaptureCamera, parse_source
from flightd.adapters.camera.connect import connect_camera
from flightd.adapters.camera.shared_memory import SharedCamera
from flightd.config.camera import CameraConfig
from flightd.core.errors import InputError, TransientError, UnavailableError
from flightd.runtime.clock import LoopClock
from flightd.runtime.frame_notice import FrameNotice, encode_notice
from flightd.runtime.frame_ring import FrameTicket
from tests.rigs.event_loops import real, virtual
from tests.rigs.free_ports import free_port


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
    assert camera.rejected == 5
    assert len(troubles) == 1, "told once, not for every datagram"
    assert "not a picture notice" in troubles[0]
    assert all(abs(t.arrival_ns - t.stamp_ns - 50_000_000) < 10_000 for t in tickets)


def test_a_port_in_use_is_said_in_one_line() -> None:
    async def main() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
            taken.bind(("127.0.0.1", 0))
            url = f"udp://127.0.0.1:{taken.getsockname()[1]}"
            await SharedCamera(url, (64, 36), 0.0, LoopClock(), lambda _: None, print).run()

    with pytest.raises(UnavailableError, match="in use; is another flightd running"):
        real(main())


@pytest.mark.parametrize(
    "url", ["udp://", "udp://host", "http://x:1", "device:", "file:/no/such", "folder:/no/such"]
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
        await CaptureCamera(source, 0.01, LoopClock(), tickets.append).run()

    with pytest.raises(TransientError, match="no more pictures"):
        real(main())
    assert [t.seq for t in tickets] == [0, 1, 2, 3]
    assert all(t.stamp_ns < t.arrival_ns - 9_000_000 for t in tickets)


def test_pictures_of_another_size_are_refused_by_name(tmp_path: Path) -> None:
    write_pictures(tmp_path, 1)

    async def main() -> None:
        source = parse_source(f"folder:{tmp_path}", 640, 360, 200.0)
        await CaptureCamera(source, 0.0, LoopClock(), lambda _: None).run()

    with pytest.raises(TransientError, match="pictures are 64x36, the configuration says 640x360"):
        real(main())
