"""Datagrams that must go out now or not at all."""

from __future__ import annotations

import asyncio


def is_stalled(transport: asyncio.DatagramTransport) -> bool:
    """Whether a datagram given earlier still waits here for the network to take it.  asyncio lets them pile
    up without a bound and sends all of them once it can, however old."""
    return bool(transport.get_write_buffer_size())  # type: ignore[attr-defined]  # the stubs leave it out
