"""The link to a running flightd that the options before the command describe."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from flightd.adapters.ground_link.client import Address, GroundClient

_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class DaemonConnection:
    """Where flightd listens, the two keys, and how long to wait for an answer."""

    host: str
    status_port: int
    command_port: int
    key: Path | None
    server_key: Path | None
    timeout_s: float

    def ask(self, use: Callable[[GroundClient], Awaitable[_T]]) -> _T:
        """What `use` makes of a connected client.  InputError for keys, UnavailableError without answer."""
        from flightd.adapters.ground_link.client import GroundClient

        address = self._address()

        async def connected() -> _T:
            async with GroundClient(address, timeout_s=self.timeout_s) as client:
                return await use(client)

        return asyncio.run(connected())

    def _address(self) -> Address:
        from flightd.adapters.ground_link.client import Address

        return Address.with_keys(self.host, (self.status_port, self.command_port), self.key, self.server_key)
