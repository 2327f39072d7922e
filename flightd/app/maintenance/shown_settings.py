"""Settings that are only looked at: those of a simulation, which no file of a drone holds."""

from __future__ import annotations

from flightd.adapters.ground_link.messages.maintenance import (
    InstallProfile,
    ProposeSettings,
    SettingsAnswer,
    TakeSettingsBack,
)
from flightd.app.maintenance.settings import key_reports, section_texts
from flightd.config.schema import Config
from flightd.core.errors import UnavailableError

_WHY = "this is a simulation, whose settings are its configuration's and its command line's"


class ShownSettings:
    """In the place of `DroneSettings`: what was given beyond the defaults, nothing to be changed."""

    def __init__(self, config: Config) -> None:
        self._config = config

    async def answer(self, request_id: str) -> SettingsAnswer:
        return SettingsAnswer(
            request=request_id,
            file="",
            tag="",
            table=self._config.model_dump(mode="json", exclude_unset=True),
            keys=key_reports(),
            sections=section_texts(),
            versions=(),
            pending=False,
            locked=_WHY,
            restarts=False,
        )

    async def propose(self, request: ProposeSettings, client: str) -> str:  # noqa: ARG002 - as a drone's
        raise UnavailableError(_WHY)

    async def take_back(self, request: TakeSettingsBack, client: str) -> str:  # noqa: ARG002
        raise UnavailableError(_WHY)

    async def install_profile(self, request: InstallProfile, client: str) -> str:  # noqa: ARG002
        raise UnavailableError(_WHY)
