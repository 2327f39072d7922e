"""What the page Studio asks for: picture sets, what is marked in them, masks, training, profiles."""

from __future__ import annotations

import re
from typing import Annotated, TypeVar

import msgspec
from msgspec import Meta
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from flightd.core.errors import InputError
from flightd.core.paint import NAMED_PAINTS
from flightd.ground.access.gate import note_act, person_of
from flightd.ground.bounded import Room
from flightd.ground.json_http import AnswerTo, as_json, or_refused, refusal, said
from flightd.ground.pages import page
from flightd.ground.plain_files import plain_file
from flightd.ground.request_body import whole_body
from flightd.ground.shown_text import shown
from flightd.ground.studio.picture_sets import MOST_PICTURE_BYTES
from flightd.ground.studio.profile_shelf import Shelved
from flightd.ground.studio.studio import Studio, missing_training
from flightd.vision.lens_calibration import Board
from flightd.vision.lines.colour_profile import SHIPPED
from flightd.vision.training.labelled_frames import LabelledImage, LabelledLine, LabelledRegion

_BINARY = "application/octet-stream"
_MOST_LABEL_BYTES = 1 << 20
_MOST_UPLOADS = 2
_MOST_MARKS, _MOST_POINTS = 500, 5000
_FAR_PX = 1e5

_Text = Annotated[str, Meta(min_length=1, max_length=60)]
T = TypeVar("T")


class NewSet(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A set to be made."""

    name: _Text
    paint: _Text


class Wanted(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A picture of a recorded flight."""

    flight: _Text
    place: int


class Marked(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a person says of a picture; as in `labels.json`."""

    regions: list[LabelledRegion] = []
    lines: list[LabelledLine] = []
    complete: bool = False
    negative: bool = False


class Train(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Flights on whose logs is scored, too."""

    flights: tuple[_Text, ...] = ()


class Install(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The profile that the person saw; `again`: yes, though it is worse."""

    training_hash: _Text
    who: _Text
    again: bool = False


class TakeBack(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The version to fly by again."""

    version: int


def studio_routes(studio: Studio | None) -> list[BaseRoute]:
    """The page at /studio and all that it asks for; only that there is no folder where there is none."""
    if studio is None:

        async def none(_request: Request) -> Response:
            return as_json({"folder": False})

        return [Route("/api/studio", none, methods=["GET"]), *page("/studio")]
    asked = _Asked(studio)

    def at(path: str, answer: AnswerTo, method: str) -> Route:
        async def with_a_disk(request: Request) -> Response:
            try:
                return await answer(request)
            except OSError as err:
                return refusal(f"the disk refuses: {err.strerror or 'unknown'}", 503)

        return Route(f"/api/studio{path}", or_refused(with_a_disk), methods=[method])

    picture = "/sets/{set}/pictures/{file}"
    return [
        at("", asked.overview, "GET"),
        at("/sets", asked.make, "POST"),
        at("/sets/{set}", asked.one, "GET"),
        at("/sets/{set}/pictures", asked.take, "POST"),
        at("/sets/{set}/uploads", asked.upload, "POST"),
        at(picture, asked.picture, "GET"),
        at(picture, asked.mark, "PUT"),
        at(picture, asked.take_out, "DELETE"),
        at(f"{picture}/mask", asked.mask, "GET"),
        at("/sets/{set}/boards", asked.boards, "GET"),
        at("/flights/{flight}/sensors", asked.sensors, "GET"),
        at("/sets/{set}/train", asked.train, "POST"),
        at("/sets/{set}/install", asked.install, "POST"),
        at("/profiles/{set}/back", asked.take_back, "POST"),
        at("/profiles/{set}/file", asked.profile, "GET"),
        *page("/studio"),
    ]


class _Asked:
    def __init__(self, studio: Studio) -> None:
        self._studio = studio
        self._uploads = Room(_MOST_UPLOADS, "too many pictures are on their way already")

    async def overview(self, _request: Request) -> Response:
        studio = self._studio
        studio.get_ready()
        sets = await studio.disk.run(studio.sets.names)
        shelved = await studio.disk.run(studio.shelf.shelved)
        return as_json(
            {
                "folder": True,
                "sets": sets,
                "profiles": shelved,
                "paints": [*NAMED_PAINTS],
                "shipped": SHIPPED,
                "missing": missing_training(),
            }
        )

    async def make(self, request: Request) -> Response:
        new = await said(request, NewSet, "a new set")
        made = await self._studio.disk.run(self._studio.sets.make, new.name, new.paint)
        note_act(request, f"made the set {made.name}")
        return as_json({"name": made.name})

    async def one(self, request: Request) -> Response:
        studio, name = self._studio, request.path_params["set"]
        known = await studio.disk.run(studio.sets.read, name)
        return as_json(
            {
                "name": name,
                "paint": known.paint,
                "folder": str(studio.sets.folder_of(name).resolve()),
                "pictures": known.labels,
                "training": _training(studio, name),
                "outcome": await studio.outcome_of(name),
                "profile": await studio.disk.run(studio.shelf.of, name),
            }
        )

    async def take(self, request: Request) -> Response:
        wanted = await said(request, Wanted, "a picture of a flight")
        name = request.path_params["set"]
        note_act(request, f"picture {wanted.place} of {wanted.flight}")
        return as_json({"file": await self._studio.take_from_log(name, wanted.flight, wanted.place)})

    async def upload(self, request: Request) -> Response:
        if request.headers.get("content-type", "") != _BINARY:
            return refusal("a picture is the file itself", 415)
        with self._uploads.taken():
            data = await whole_body(request, MOST_PICTURE_BYTES, "picture")
            return as_json({"file": await self._studio.take_upload(request.path_params["set"], data)})

    async def picture(self, request: Request) -> Response:
        studio, params = self._studio, request.path_params
        path = await studio.disk.run(studio.sets.picture, params["set"], params["file"])
        content = await studio.disk.run(plain_file, path, 2 * MOST_PICTURE_BYTES)
        if content is None:
            raise InputError("there is no such picture")
        headers = {"Cache-Control": "private, max-age=600, immutable"}
        return Response(content, media_type="image/jpeg", headers=headers)

    async def mark(self, request: Request) -> Response:
        studio, params = self._studio, request.path_params
        marked = await said(request, Marked, "marks of a picture", _MOST_LABEL_BYTES)
        _check(marked)
        known = await studio.disk.run(studio.sets.read, params["set"])
        before = next((one for one in known.labels if one.file == params["file"]), None)
        if before is None:
            raise InputError("there is no such picture")
        label: LabelledImage = msgspec.structs.replace(
            before,
            regions=marked.regions,
            lines=marked.lines,
            complete=marked.complete,
            negative=marked.negative,
        )
        await studio.disk.run(studio.sets.label, params["set"], label)
        return as_json(label)

    async def take_out(self, request: Request) -> Response:
        studio, params = self._studio, request.path_params
        await studio.disk.run(studio.sets.take_out, params["set"], params["file"])
        return as_json({"taken_out": params["file"]})

    async def mask(self, request: Request) -> Response:
        params, by = request.path_params, request.query_params.get("by", "strokes")
        return Response(await self._studio.mask(params["set"], params["file"], by), media_type=_BINARY)

    async def train(self, request: Request) -> Response:
        name, asked = request.path_params["set"], await said(request, Train, "flights to score on")
        await self._studio.disk.run(self._studio.sets.read, name)
        self._studio.order_training(name, asked.flights)
        return as_json({"training": _training(self._studio, name)}, 202)

    async def boards(self, request: Request) -> Response:
        sides = [request.query_params.get(name, "") for name in ("columns", "rows")]
        if not all(re.fullmatch(r"[0-9]{1,2}", side) and 3 <= int(side) <= 40 for side in sides):
            raise InputError("a board has 3 to 40 inner corners a side")
        return as_json(await self._studio.boards(request.path_params["set"], Board(*map(int, sides))))

    async def sensors(self, request: Request) -> Response:
        return as_json(await self._studio.sensors(request.path_params["flight"]))

    async def install(self, request: Request) -> Response:
        asked = await said(request, Install, "what to install")
        name, who = request.path_params["set"], person_of(request, asked.who)
        if not who:
            raise InputError("nobody installs it", remedy="say who you are")
        shelved = await self._studio.install(name, asked.training_hash, who, asked.again)
        verdict = next((one.verdict for one in shelved.versions if one.number == shelved.current), "")
        note_act(request, f"version {shelved.current} installed, {verdict}")
        return as_json(shelved)

    async def take_back(self, request: Request) -> Response:
        asked, name = await said(request, TakeBack, "a version"), request.path_params["set"]
        self._studio.sets.folder_of(name)  # its name is one
        back: Shelved = await self._studio.disk.run(self._studio.shelf.take_back, name, asked.version)
        note_act(request, f"version {asked.version} taken back")
        return as_json(back)

    async def profile(self, request: Request) -> Response:
        name = request.path_params["set"]
        self._studio.sets.folder_of(name)
        shelved = await self._studio.disk.run(self._studio.shelf.of, name)
        content = await self._studio.disk.run(plain_file, shelved.file, MOST_PICTURE_BYTES)
        if content is None:
            raise InputError("no profile of this name is installed")
        headers = {"Content-Disposition": f'attachment; filename="{name}.npz"'}
        return Response(content, media_type=_BINARY, headers=headers)


def _training(studio: Studio, name: str) -> dict[str, object] | None:
    training = studio.training_of(name)
    return None if training is None else {"running": training.running, "refused": shown(training.refused)}


def _check(marked: Marked) -> None:
    """InputError for marks that no picture has."""
    if len(marked.regions) + len(marked.lines) > _MOST_MARKS:
        raise InputError(f"more than {_MOST_MARKS} marks", remedy="take some away")
    if sum(len(region.stroke) for region in marked.regions) > _MOST_POINTS:
        raise InputError(f"strokes of more than {_MOST_POINTS} points", remedy="take some away")
    numbers: list[float] = []
    for region in marked.regions:
        numbers += [region.width, *(region.box or ()), *(at for point in region.stroke for at in point)]
    for line in marked.lines:
        numbers += [line.x1, line.y1, line.x2, line.y2, line.thickness]
        if line.length_px < 1.0 or line.thickness < 0.0:
            raise InputError("a line without length, or with a width below none")
    if not all(abs(number) < _FAR_PX for number in numbers):
        raise InputError("a mark that lies outside every picture")
