"""Does what the ground asks for to look after the drone: each request to the part that knows it."""

from __future__ import annotations

import asyncio

from flightd.adapters.ground_link.messages.answers import Accepted
from flightd.adapters.ground_link.messages.maintenance import (
    AskDoctor,
    AskSettings,
    FixParameter,
    InstallProfile,
    Maintenance,
    ProposeSettings,
    Restart,
    TakeSettingsBack,
)
from flightd.adapters.ground_link.peer import Peer
from flightd.adapters.ground_link.protocol import Answer
from flightd.app.flight import Flight
from flightd.app.maintenance.checks import DroneChecks
from flightd.app.maintenance.settings import DroneSettings
from flightd.app.maintenance.shown_settings import ShownSettings
from flightd.core.errors import RunError, UnavailableError
from flightd.core.types import EventLevel, Phase

_ANSWER_LEAVES_S = 0.3


class DroneMaintainer:
    """`adapters.ground_link.maintenance_desk.Maintainer` of a flight; `flight` is given once it is built.
    `restarts`: the service manager starts the daemon anew when it ends."""

    def __init__(
        self, checks: DroneChecks, settings: DroneSettings | ShownSettings, *, restarts: bool
    ) -> None:
        self._checks = checks
        self._settings = settings
        self._restarts = restarts
        self._restart = asyncio.Event()
        self.flight: Flight | None = None

    async def serve(self, request: Maintenance, peer: Peer) -> Answer:
        """Do it.  FlightdError, with a line for a person, where it cannot be done."""
        flight = self.flight
        if flight is None:
            raise UnavailableError("flightd is still starting", remedy="ask again in a moment")
        match request:
            case AskDoctor():
                return await self._checks.report(request.id, flight)
            case FixParameter():
                outcome = await self._checks.fix(request.name, flight)
                self._tell(flight, f"{outcome} {_by(request.person, peer)}")
                return await self._checks.report(request.id, flight, outcome)
            case AskSettings():
                return await self._settings.answer(request.id)
            case ProposeSettings() | TakeSettingsBack() | InstallProfile():
                done = await self._changed(request, peer)
                self._tell(flight, f"{done} {_by(request.person, peer)}")
                return await self._settings.answer(request.id)
            case Restart():
                return self._asked_to_restart(request, peer, flight)

    async def restart_asked(self) -> None:
        """Until the daemon is to end: asked for, and its vehicle stands disarmed at this very moment."""
        while True:
            await self._restart.wait()
            await asyncio.sleep(_ANSWER_LEAVES_S)
            self._restart.clear()
            if self.flight is not None and stands_idle(self.flight):
                return

    async def _changed(self, request: ProposeSettings | TakeSettingsBack | InstallProfile, peer: Peer) -> str:
        """What was changed of the settings, in words."""
        match request:
            case ProposeSettings():
                return await self._settings.propose(request, peer.name)
            case TakeSettingsBack():
                return await self._settings.take_back(request, peer.name)
            case InstallProfile():
                return await self._settings.install_profile(request, peer.name)

    def _asked_to_restart(self, request: Restart, peer: Peer, flight: Flight) -> Accepted:
        if not self._restarts:
            raise RunError(
                "nothing starts this flightd anew when it ends", remedy="start it anew on the drone itself"
            )
        self._tell(flight, f"started anew {_by(request.person, peer)}")
        self._restart.set()
        return Accepted(request=request.id)

    def _tell(self, flight: Flight, text: str) -> None:
        flight.publishers.note(EventLevel.WARNING, "maintenance", text)


def stands_idle(flight: Flight) -> bool:
    """Whether the flight has not begun and its vehicle is heard to be disarmed."""
    state = flight.vehicle.state()
    return flight.pilot.phase is Phase.PREFLIGHT and state is not None and not state.armed


def _by(person: str, peer: Peer) -> str:
    return f"by {person} ({peer.name})" if person else f"by {peer.name}"
