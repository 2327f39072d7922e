"""What the page Doctor asks for: a drone's report, its settings, and what a person changes.

Whatever reaches a drone goes over its ground link, which decides: this station only asks.  Passwords in the
addresses of cameras are shown to nobody but who may change them."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Awaitable, Callable, Mapping
from functools import partial
from typing import Annotated, TypeAlias

import msgspec
from msgspec import Meta
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from flightd.adapters.ground_link.messages.maintenance import SettingsAnswer, Value
from flightd.core.errors import FlightdError, InputError
from flightd.core.paint import PROFILE_NAME
from flightd.ground.access.access import Access
from flightd.ground.access.gate import identity_of, note_act, person_of
from flightd.ground.access.roles import Role
from flightd.ground.doctor.known_settings import KnownSettings
from flightd.ground.doctor.versions import station_versions
from flightd.ground.drone_link import DroneLink
from flightd.ground.json_http import as_json, refusal, said, status_of
from flightd.ground.pages import page
from flightd.ground.studio.profile_shelf import ProfileShelf

_Person = Annotated[str, Meta(max_length=64)]
_Tag = Annotated[str, Meta(max_length=64)]
_Changes = Annotated[dict[Annotated[str, Meta(max_length=80)], Value], Meta(max_length=64)]
_Answer: TypeAlias = Callable[[DroneLink, Request], Awaitable[object]]
_SETTINGS = "what is asked of the settings"
_PASSWORD = re.compile(rb'(//[^/\s":@]*:)[^/\s"@]+@')


class Fix(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Set a parameter right."""

    name: Annotated[str, Meta(min_length=1, max_length=32)]
    person: _Person = ""


class Typed(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a person types, to be judged before it is sent."""

    base: _Tag
    changes: _Changes


class Proposal(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Change settings."""

    base: _Tag
    changes: _Changes
    person: _Person = ""


class TakeBack(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Bring a kept version of the settings back."""

    base: _Tag
    version: Annotated[int, Meta(ge=1, le=10**9)]
    person: _Person = ""


class SendProfile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Send an installed colour profile to the drone: that of `file_hash`."""

    base: _Tag
    profile: Annotated[str, Meta(max_length=40, pattern=rf"^{PROFILE_NAME}\Z")]
    file_hash: Annotated[str, Meta(max_length=64)]
    person: _Person = ""


class StartAnew(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Start the daemon anew."""

    person: _Person = ""


class DoctorAnswers:
    """What the page is answered, drone by drone; profiles lie on the `shelf`, if there is one."""

    def __init__(self, shelf: ProfileShelf | None) -> None:
        self._known = KnownSettings()
        self._shelf = shelf

    async def report(self, drone: DroneLink, _request: Request) -> object:
        return await drone.ask(lambda client: client.doctor())

    async def fix(self, drone: DroneLink, request: Request) -> object:
        asked = await said(request, Fix, _SETTINGS)
        note_act(request, asked.name)
        return await drone.ask(lambda client: client.fix(asked.name, person_of(request, asked.person)))

    async def settings(self, drone: DroneLink, _request: Request) -> object:
        return self._noted(drone, await drone.ask(lambda client: client.settings()))

    async def check(self, drone: DroneLink, request: Request) -> object:
        asked = await said(request, Typed, _SETTINGS)
        complaint = await asyncio.to_thread(self._known.complaint, drone.name, asked.base, asked.changes)
        return {"complaint": complaint}

    async def propose(self, drone: DroneLink, request: Request) -> object:
        asked = await said(request, Proposal, _SETTINGS)
        note_act(request, ", ".join(asked.changes))
        person = person_of(request, asked.person)
        told = await drone.ask(lambda client: client.propose(asked.base, asked.changes, person))
        return self._noted(drone, told)

    async def take_back(self, drone: DroneLink, request: Request) -> object:
        asked = await said(request, TakeBack, _SETTINGS)
        note_act(request, f"version {asked.version}")
        person = person_of(request, asked.person)
        told = await drone.ask(lambda client: client.take_back(asked.base, asked.version, person))
        return self._noted(drone, told)

    async def send_profile(self, drone: DroneLink, request: Request) -> object:
        asked = await said(request, SendProfile, "a profile to be sent")
        note_act(request, f"profile {asked.profile} {asked.file_hash[:12]}")
        if self._shelf is None:
            raise InputError("there is no folder with profiles", remedy="flightd ground --folder out")
        content = await asyncio.to_thread(self._shelf.installed, asked.profile, asked.file_hash)
        person = person_of(request, asked.person)
        told = await drone.ask(
            lambda client: client.install_profile(asked.base, asked.profile, content, person)
        )
        return self._noted(drone, told)

    async def restart(self, drone: DroneLink, request: Request) -> object:
        asked = await said(request, StartAnew, _SETTINGS)
        return await drone.ask(lambda client: client.restart(person_of(request, asked.person)))

    def _noted(self, drone: DroneLink, told: SettingsAnswer) -> SettingsAnswer:
        self._known.note(drone.name, told)
        return told


def doctor_routes(
    drones: Mapping[str, DroneLink], access: Access, shelf: ProfileShelf | None
) -> list[BaseRoute]:
    """The page at /doctor and all that it asks for; profiles that are sent lie on the `shelf`."""
    answers = DoctorAnswers(shelf)

    def at(path: str, answer: _Answer, method: str) -> Route:
        async def guarded(request: Request) -> Response:
            drone = drones.get(request.path_params["drone"])
            if drone is None:
                return refusal("there is no such drone", 404)
            try:
                return _shown(as_json(await answer(drone, request)), request)
            except FlightdError as err:
                return refusal(str(err).removeprefix("refused: "), status_of(err, 400))

        return Route(f"/api/doctor/{{drone}}/{path}", guarded, methods=[method])

    return [
        Route("/api/doctor", partial(_station, access), methods=["GET"]),
        at("report", answers.report, "GET"),
        at("fix", answers.fix, "POST"),
        at("settings", answers.settings, "GET"),
        at("check", answers.check, "POST"),
        at("settings", answers.propose, "POST"),
        at("take-back", answers.take_back, "POST"),
        at("profile", answers.send_profile, "POST"),
        at("restart", answers.restart, "POST"),
        *page("/doctor"),
    ]


async def _station(access: Access, _request: Request) -> Response:
    """What this station runs on, and how many lines of its audit its disk did not take."""
    versions = await asyncio.to_thread(station_versions)
    return as_json({"versions": versions, "audit_lost": access.audit_lost})


def _shown(answer: Response, request: Request) -> Response:
    """The answer as this person may see it."""
    if identity_of(request).role.covers(Role.ADMIN):
        return answer
    return Response(_PASSWORD.sub(rb"\1***@", answer.body), answer.status_code, media_type=answer.media_type)
