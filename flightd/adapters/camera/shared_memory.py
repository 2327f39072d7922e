"""A camera that is a process of its own: frames in shared memory, one UDP notice for each."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any
from urllib.parse import urlsplit

from flightd.adapters.camera.frame_order import OUT_OF_ORDER, FrameOrder
from flightd.core.errors import InputError, UnavailableError
from flightd.ports import Clock
from flightd.runtime.datagrams import is_stalled
from flightd.runtime.frame_notice import ExposureRequest, decode_notice, encode_request
from flightd.runtime.frame_ring import FrameTicket
from flightd.tracking.device_clock import DeviceClock


def parse_address(url: str) -> tuple[str, int]:
    """(host, port) of a `udp://HOST:PORT`; InputError otherwise."""
    parts = urlsplit(url)
    try:
        port = parts.port
    except ValueError:
        port = None
    if parts.scheme != "udp" or not parts.hostname or port is None:
        raise InputError(f"camera.url {url!r}: expected udp://HOST:PORT, for example udp://127.0.0.1:5600")
    return parts.hostname, port


class SharedCamera(asyncio.DatagramProtocol):
    """Listens for notices and hands each frame's ticket to `on_frame`; what is no usable notice, or one of a
    frame older than one that was delivered, is counted (`refused`) and told to `on_trouble`, at most once in
    five seconds.  A notice of a frame that was taken with another exposure than is wanted is answered by a
    request."""

    def __init__(
        self,
        url: str,
        size_px: tuple[int, int],
        latency_s: float,
        clock: Clock,
        on_frame: Callable[[FrameTicket], None],
        on_trouble: Callable[[str], None],
    ) -> None:
        self._address = parse_address(url)
        self._url = url
        self._size_px = size_px
        self._clock = clock
        latency_ns = round(latency_s * 1e9)
        self._device = DeviceClock(latency_ns)
        self._order = FrameOrder(url, latency_ns, on_trouble)
        self._on_frame = on_frame
        self.frames = 0
        self._wanted = ExposureRequest(1.0)
        self._transport: asyncio.DatagramTransport | None = None

    @property
    def refused(self) -> int:
        """Notices of no use, and of frames that must not be flown by."""
        return self._order.refused

    async def run(self) -> None:
        """Listen until cancelled.  Raises UnavailableError when the port is taken."""
        loop = asyncio.get_running_loop()
        try:
            transport, _ = await loop.create_datagram_endpoint(lambda: self, local_addr=self._address)
        except OSError as err:
            raise UnavailableError(
                f"camera.url {self._url}: {err.strerror}; is another flightd running?"
            ) from err
        try:
            self._transport = transport
            await asyncio.get_running_loop().create_future()
        finally:
            self._transport = None
            transport.close()

    def expose(self, part: float, gain: float) -> None:
        """Ask for frames of these parts of the usual exposure and gain from now on."""
        self._wanted = ExposureRequest(part, gain)

    def datagram_received(self, data: bytes, addr: Any) -> None:
        arrival_ns = self._clock.now_ns()
        try:
            notice = decode_notice(data)
        except InputError as err:
            self._order.refuse(str(err), arrival_ns)
            return
        if (notice.width_px, notice.height_px) != self._size_px:
            wanted = "{}x{}".format(*self._size_px)
            reason = f"frames are {notice.width_px}x{notice.height_px}, the configuration says {wanted}"
            self._order.refuse(reason, arrival_ns)
            return
        line = self._transport
        other = (notice.exposure, notice.gain) != (self._wanted.exposure, self._wanted.gain)
        if other and line is not None and not is_stalled(line):
            line.sendto(encode_request(self._wanted), addr)
        stamp_ns = self._device.to_ours(notice.device_ns, arrival_ns)
        if stamp_ns is None:
            self._order.refuse(OUT_OF_ORDER, arrival_ns)
            return
        if not self._order.passes(stamp_ns, arrival_ns):
            return
        self.frames += 1
        self._on_frame(
            FrameTicket(
                notice.ring,
                notice.slot,
                notice.slots,
                notice.seq,
                stamp_ns,
                arrival_ns,
                notice.width_px,
                notice.height_px,
                notice.exposure,
                notice.gain,
            )
        )
