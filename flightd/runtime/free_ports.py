"""Ports of the loopback interface that nobody uses now."""

from __future__ import annotations

import contextlib
import socket


def free_ports(count: int, kind: int = socket.SOCK_DGRAM) -> list[int]:
    """So many different ones: of UDP, or of TCP where `kind` is SOCK_STREAM.  OSError where there is none."""
    with contextlib.ExitStack() as stack:
        probes = [stack.enter_context(socket.socket(socket.AF_INET, kind)) for _ in range(count)]
        for probe in probes:
            probe.bind(("127.0.0.1", 0))
        return [int(probe.getsockname()[1]) for probe in probes]


def free_port(kind: int = socket.SOCK_DGRAM) -> int:
    """One of them."""
    (port,) = free_ports(1, kind)
    return port
