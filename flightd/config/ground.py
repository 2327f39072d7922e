"""The ground link's section of the configuration."""

from __future__ import annotations

import ipaddress
from pathlib import Path
from typing import ClassVar, Self

from pydantic import Field, model_validator

from flightd.config.hazards import LossAction
from flightd.config.section import Section


class GroundConfig(Section):
    """The link to ground stations (ZMQ): off until it is told where to listen."""

    files: ClassVar = ("server_key", "clients", "audit")

    listen: str = Field(
        "",
        description="address to listen on; empty: no link; 127.0.0.1: this machine; beyond, keys are needed",
    )
    status_port: int = Field(
        5571, ge=0, le=65535, description="TCP port of status and events; 0: any free one"
    )
    command_port: int = Field(5572, ge=0, le=65535, description="TCP port of commands; 0: any free one")
    server_key: Path | None = Field(None, description="the daemon's secret key, from `flightctl keygen`")
    clients: Path | None = Field(
        None, description="allow-list: a line `ROLE PUBLIC-KEY NAME` for each client"
    )
    audit: Path | None = Field(None, description="audit log: every command as a line of JSON")
    picture_fps: float = Field(
        2.0, ge=0, le=10, description="most preview pictures of each camera per second, all clients together"
    )
    lost_s: float = Field(5.0, ge=1, le=600, description="who attends and is silent for so long is lost")
    lost_action: LossAction = Field(
        LossAction.CONTINUE, description="when the last who attends is lost: continue, hold, home or land"
    )

    @model_validator(mode="after")
    def _closed_to_strangers(self) -> Self:
        if (self.server_key is None) != (self.clients is None):
            raise ValueError("server_key and clients belong together: give both (see `flightctl keygen`)")
        if self.listen and not is_loopback(self.listen):
            missing = [key for key in ("server_key", "clients", "audit") if getattr(self, key) is None]
            if missing:
                raise ValueError(
                    f"listening on {self.listen}, beyond this machine, needs {' and '.join(missing)} "
                    '(see `flightctl keygen`), or set listen = "127.0.0.1"'
                )
        return self


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach `host`; a name other than localhost counts as the network."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
