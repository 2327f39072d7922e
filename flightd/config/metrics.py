"""The metrics' section of the configuration."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from flightd.config.ground import is_loopback
from flightd.config.section import Section


class MetricsConfig(Section):
    """Prometheus metrics over HTTP: off until it is told where to listen."""

    listen: str = Field(
        "",
        description='HOST:PORT, for example "127.0.0.1:9469"; empty: off; numbers only, nothing to command',
    )

    @model_validator(mode="after")
    def _an_address(self) -> Self:
        if self.listen:
            host, port = self.address
            if not host or not 0 <= port <= 65535:
                raise ValueError(f'metrics.listen {self.listen!r}: expected HOST:PORT, as "127.0.0.1:9469"')
            if not is_loopback(host):
                raise ValueError(
                    f"metrics.listen {self.listen}: the metrics have no keys and stay on this machine; give"
                    ' "127.0.0.1:9469" and let an exporter or a tunnel carry them on'
                )
        return self

    @property
    def address(self) -> tuple[str, int]:
        """Host (without brackets) and port, -1 where that is no number."""
        host, _, port = self.listen.rpartition(":")
        number = int(port) if port.isascii() and port.isdigit() and len(port) <= 5 else -1
        return host.removeprefix("[").removesuffix("]"), number
