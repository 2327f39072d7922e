"""A simulated camera tells of a picture as soon as it lies in memory, and of its arrival when that is due."""

from __future__ import annotations

import asyncio

import numpy as np

from flightd.core.types import Image
from flightd.runtime.clock import LoopClock
from flightd.runtime.frame_notice import FrameNotice, decode_notice
from flightd.runtime.frame_ring import FrameRing, FrameTicket
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.sensors.camera import CameraPeer
from flightd.sim.sensors.optics import USUALLY, SimCamera, Taking, picture_for, wide_lens
from tests.rigs.event_loops import virtual
from tests.rigs.held_time import held
from tests.rigs.waiting import until

LENS = wide_lens(64, 36)
PICTURES = 5


class Numbered:
    """Every pixel of a picture is its number."""

    def render(
        self, kinematics: Kinematics, seq: int, out: Image | None = None, how: Taking = USUALLY
    ) -> Image:
        picture = picture_for(LENS, out)
        picture[:] = seq
        return picture


class Notices(asyncio.DatagramProtocol):
    def __init__(self) -> None:
        self.heard: list[FrameNotice] = []

    def datagram_received(self, data: bytes, addr: object) -> None:
        self.heard.append(decode_notice(data))


def standing(stamp_ns: int) -> Kinematics:
    return Kinematics(stamp_ns, *[0.0] * 12)


def test_a_picture_is_told_of_before_its_notice_comes_and_lies_where_that_says() -> None:
    drawn: list[FrameTicket] = []

    async def main() -> tuple[list[FrameNotice], list[int]]:
        loop, notices = asyncio.get_running_loop(), Notices()
        transport, _ = await loop.create_datagram_endpoint(lambda: notices, local_addr=("127.0.0.1", 0))
        levels: list[int] = []

        def look(ticket: FrameTicket) -> None:
            assert ticket.seq not in {notice.seq for notice in notices.heard}
            ring = FrameRing.attach(ticket.ring, ticket.slots, ticket.width_px, ticket.height_px)
            ring.check(ticket.slot, ticket.seq)
            levels.extend(np.unique(ring.pixels(ticket.slot)).tolist())
            ring.close()
            drawn.append(ticket)

        address = transport.get_extra_info("sockname")
        camera = CameraPeer(
            SimCamera(LENS), Numbered, "eye", address, standing, LoopClock(), hold=held, drawn=look
        )
        seeing = asyncio.ensure_future(camera.run())
        await until(lambda: len(notices.heard) >= PICTURES)
        seeing.cancel()
        await asyncio.wait([seeing])
        transport.close()
        return notices.heard, levels

    heard, levels = virtual(main())
    assert levels[:PICTURES] == list(range(PICTURES))
    told = [(n.ring, n.slots, n.slot, n.seq, n.width_px, n.height_px) for n in heard[:PICTURES]]
    assert [(t.ring, t.slots, t.slot, t.seq, t.width_px, t.height_px) for t in drawn[:PICTURES]] == told
