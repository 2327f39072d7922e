"""The link to a running flightd that the options before the command describe."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from flightd.core.errors import InputError

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
        from flightd.adapters.ground_link.keys import load_pair, load_public

        if (self.key is None) != (self.server_key is None):
            raise InputError("belong together: yours, and the daemon's public one", key="--key, --server-key")
        return Address(
            self.host,
            self.status_port,
            self.command_port,
            load_pair(self.key) if self.key is not None else None,
            load_public(self.server_key) if self.server_key is not None else None,
        )
