"""What the page Site asks: POST works something out and changes nothing, PUT saves."""

from __future__ import annotations

import math
from pathlib import Path

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from flightd.config.front_camera import FrontCameraConfig
from flightd.core.errors import InputError, RunError
from flightd.ground.access.gate import identity_of, note_act
from flightd.ground.access.roles import Role
from flightd.ground.bounded import Room, Threads
from flightd.ground.json_http import JSON, as_json, is_json
from flightd.ground.pages import page
from flightd.ground.reading_process import ReadingProcess
from flightd.ground.request_body import whole_body
from flightd.ground.site_page import exchange
from flightd.ground.site_page.drafts import MOST_BYTES
from flightd.ground.site_page.simulated_flight import SimulatedFlight
from flightd.ground.site_page.site_files import SiteFiles
from flightd.ground.site_page.work import check_sent, export_sent, new_sent, opened_text, text_sent
from flightd.ground.stock_routes import answered, download
from flightd.site.exchange import map_files

_WORK_S = 20.0
_MOST_TOGETHER = 8


def site_page(
    folder: Path | None, working: ReadingProcess, simulated: SimulatedFlight | None
) -> list[BaseRoute]:
    """The page over the site files under `folder`; maps are laid out and checked in `working`, and flown by
    `simulated`."""
    asked = SiteAnswers(SiteFiles(folder), working, simulated)
    ways = [
        ("GET", "", asked.sites),
        ("GET", "/file", asked.open),
        ("GET", "/version", asked.version),
        ("POST", "/check", asked.check),
        ("POST", "/new", asked.new),
        ("POST", "/import", asked.take_in),
        ("POST", "/export", asked.give_out),
        ("PUT", "/file", asked.save),
        ("POST", "/simulation", asked.fly),
        ("DELETE", "/simulation", asked.end_flight),
    ]
    return [
        *page("/site"),
        *(
            Route(f"/api/site{way}", answered(answer, "this map cannot be worked on"), methods=[verb])
            for verb, way, answer in ways
        ),
    ]


class SiteAnswers:
    """What the page may ask.  Files are read and written in threads, maps are worked on in a process."""

    def __init__(self, files: SiteFiles, working: ReadingProcess, simulated: SimulatedFlight | None) -> None:
        self._files = files
        self._simulated = simulated
        self._working = working
        self._threads = Threads(1, 16, "too many questions about site files wait already")
        self._uploads = Room(_MOST_TOGETHER, "too many maps are being sent already")

    async def sites(self, _request: Request) -> Response:
        """The site files that are there, and with which camera maps are checked unless another is told."""
        names = await self._threads.run(self._files.names)
        return as_json(
            {
                "folder": self._files.title,
                "sites": [{"name": name, "written_s": written_s} for name, written_s in names],
                "camera": _shipped_camera(),
            }
        )

    async def open(self, request: Request) -> Response:
        """A site file to be edited: `?name=`."""
        name = _name(request)
        opened = await self._threads.run(self._files.open, name)
        versions = await self._threads.run(self._files.versions, name)
        draft = await self._working.run(opened_text, _WORK_S, opened.text, name)
        return as_json({**draft, "stamp": opened.stamp, "versions": versions})

    async def version(self, request: Request) -> Response:
        """An old version of it: `?name=&version=`."""
        name, version = _name(request), request.query_params.get("version", "")
        text = await self._threads.run(self._files.version, name, version)
        return as_json(await self._working.run(opened_text, _WORK_S, text, f"{name}, {version}"))

    async def check(self, request: Request) -> Response:
        """A map laid out and checked as it stands in the editor."""
        told = await self._working.run(check_sent, _WORK_S, await self._json(request))
        return Response(told, media_type=JSON)

    async def save(self, request: Request) -> Response:
        """Save under `?name=`, over the version that was opened or as a new file."""
        name = _name(request)
        text, stamp = await self._working.run(text_sent, _WORK_S, await self._json(request))
        if stamp:
            saved = await self._threads.run(self._files.save, name, stamp, text)
        else:
            saved = await self._threads.run(self._files.create, name, text)
        versions = await self._threads.run(self._files.versions, name)
        draft = await self._working.run(opened_text, _WORK_S, saved.text, name)
        return as_json({**draft, "stamp": saved.stamp, "versions": versions})

    async def new(self, request: Request) -> Response:
        """A map of equal aisles; nothing is saved."""
        return as_json(await self._working.run(new_sent, _WORK_S, await self._json(request)))

    async def take_in(self, request: Request) -> Response:
        """The map that another program's file describes: `?kind=csv`, `lif` or `toml`."""
        kind = request.query_params.get("kind", "")
        with self._uploads.taken():
            data = await whole_body(request, map_files.MOST_BYTES)
            return as_json(await self._working.run(exchange.imported, _WORK_S, kind, data))

    async def give_out(self, request: Request) -> Response:
        """The map as a file for another program: `?kind=`."""
        kind = request.query_params.get("kind", "")
        data = await self._working.run(export_sent, _WORK_S, kind, await self._json(request))
        suffix, media_type = exchange.NAMED[kind]
        return download(data, f"site{suffix}", media_type)

    async def fly(self, request: Request) -> Response:
        """Fly a site file in the simulator: `?name=`; how it goes the pages are told by themselves."""
        flight, name = self._flight(request), _name(request)
        file = await self._threads.run(self._files.path, name)
        folder = flight.start(name, file)
        note_act(request, f"{name} into {folder}")
        return as_json({"folder": folder})

    async def end_flight(self, request: Request) -> Response:
        """End the simulated flight that is under way."""
        self._flight(request).end()
        return as_json({})

    def _flight(self, request: Request) -> SimulatedFlight:
        if self._simulated is None:
            raise RunError("the station was told no folder to fly into", remedy="give it --folder DIR")
        role = identity_of(request).role
        if self._simulated.admins_only and not role.covers(Role.ADMIN):
            raise RunError("other machines reach this station: an admin has flights simulated")
        return self._simulated

    async def _json(self, request: Request) -> bytes:
        if not is_json(request):
            raise InputError("a map is sent as JSON")
        with self._uploads.taken():
            return await whole_body(request, MOST_BYTES, "map")


def _name(request: Request) -> str:
    return request.query_params.get("name", "")


def _shipped_camera() -> dict[str, float]:
    camera = FrontCameraConfig()
    fov_rad = 2 * math.atan(camera.width_px / 2 / camera.fx_px)
    return {
        "fov_deg": round(math.degrees(fov_rad), 1),
        "width_px": camera.width_px,
        "exposure_ms": camera.exposure_s * 1e3,
        "module_mm": 3.0,
        "speed_mps": 0.3,
    }
