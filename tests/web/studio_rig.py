"""A folder with a recorded flight, and what marks its pictures as a person does: by what shows in them."""

from __future__ import annotations

import asyncio
import json
import math
from pathlib import Path
from typing import Any

from flightd.runtime.within import Within
from tests.replay.synthetic_flight import write_flight
from tests.web.served import JSON, Station

WIDTH, HEIGHT = 640, 360
_WITHIN_S = 90.0


def flown_folder(root: Path) -> Path:
    """A folder with one flight, whose pictures show yellow lines on grey concrete."""
    (root / "flown").mkdir()
    write_flight(root / "flown", truth=False, summary=False)
    return root


_FLOOR_CLEAR_PX = 45.0


def marks_of(lines: list[dict[str, Any]], shift_px: float = 90.0) -> dict[str, Any]:
    """Strokes along the first of the lines that a picture's head tells, and beside it, clear of the others;
    the lines by their ends, as labels."""
    ends = [[(x * WIDTH, y * HEIGHT) for x, y in (line["points"][0], line["points"][-1])] for line in lines]
    (x0, y0), (x1, y1) = ends[0]
    length = math.hypot(x1 - x0, y1 - y0)
    aside = (-(y1 - y0) / length * shift_px, (x1 - x0) / length * shift_px)

    def beside(side: int, begins: float) -> list[list[float]]:
        return [
            [x0 + (x1 - x0) * part + side * aside[0], y0 + (y1 - y0) * part + side * aside[1]]
            for part in (begins, begins + 0.3)
        ]

    def room(stroke: list[list[float]]) -> float:
        inside = min(min(x, WIDTH - x, y, HEIGHT - y) for x, y in stroke)
        return min(inside - 10 + _FLOOR_CLEAR_PX, *(_nearest(stroke, line) for line in ends))

    floor = max((beside(side, begins) for begins in (0.0, 0.7) for side in (1, -1)), key=room)
    labels = [
        {
            "x1": line["points"][0][0] * WIDTH - 0.5,
            "y1": line["points"][0][1] * HEIGHT - 0.5,
            "x2": line["points"][-1][0] * WIDTH - 0.5,
            "y2": line["points"][-1][1] * HEIGHT - 0.5,
            "thickness": 30.0,
        }
        for line in lines
    ]
    regions = [
        {"paint": True, "stroke": [[x0, y0], [x1, y1]], "width": 12},
        {"paint": False, "stroke": floor, "width": 12},
    ]
    return {"regions": regions, "lines": labels, "complete": True}


def _nearest(stroke: list[list[float]], line: list[tuple[float, float]]) -> float:
    """How near the stroke comes to the line between its ends, in pixels."""
    (ax, ay), (bx, by) = line
    steps = [k / 20 for k in range(21)]
    points = [(ax + (bx - ax) * t, ay + (by - ay) * t) for t in steps]
    (cx, cy), (dx, dy) = stroke
    return min(math.hypot(cx + (dx - cx) * t - x, cy + (dy - cy) * t - y) for t in steps for x, y in points)


async def post(station: Station, path: str, said: object, method: str = "POST") -> tuple[int, Any]:
    """What the station answers to the JSON of its own page."""
    headers = {"Origin": station.origin, **JSON}
    code, text = await station.ask(method, path, headers, json.dumps(said).encode(), _WITHIN_S)
    return code, json.loads(text)


async def got(station: Station, path: str) -> Any:
    code, text = await station.ask("GET", path, within_s=_WITHIN_S)
    assert code == 200, text
    return json.loads(text)


async def flight_of(station: Station, within_s: float = 60.0) -> tuple[str, int]:
    """The id of the folder's flight, and how many pictures it has."""
    async with Within(within_s):
        while not (rows := (await got(station, "/api/flights"))["rows"]):  # noqa: ASYNC110 - it tells nobody
            await asyncio.sleep(0.1)
    flight = str(rows[0]["id"])
    return flight, len((await got(station, f"/api/flights/{flight}"))["flight"]["pictures"])


async def head_of(station: Station, path: str) -> tuple[dict[str, Any], bytes]:
    """The head of a framed picture, and the picture."""
    host = f"{station.where.host}:{station.where.port}"
    asked = f"GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n"
    said = await station.say(asked.encode(), within_s=_WITHIN_S)
    head, _, body = said.partition(b"\r\n\r\n")
    assert b" 200 " in head.splitlines()[0], said[:400]
    length = int.from_bytes(body[:4], "big")
    return json.loads(body[4 : 4 + length]), body[4 + length :]


async def marked_set(station: Station, name: str, paint: str, count: int, marks: bool = True) -> list[str]:
    """A set of so many marked pictures of the flight; their files."""
    flight, pictures = await flight_of(station)
    assert (await post(station, "/api/studio/sets", {"name": name, "paint": paint}))[0] == 200
    files = []
    for place in list(range(0, pictures, max(pictures // count, 1)))[:count]:
        code, taken = await post(
            station, f"/api/studio/sets/{name}/pictures", {"flight": flight, "place": place}
        )
        assert code == 200, taken
        files.append(taken["file"])
        head, _ = await head_of(station, f"/api/flights/{flight}/pictures/{place}")
        path = f"/api/studio/sets/{name}/pictures/{taken['file']}"
        if marks:
            code, said = await post(station, path, marks_of(head["lines"]), "PUT")
            assert code == 200, said
    return files


async def trained(station: Station, name: str, flights: list[str], within_s: float = 300.0) -> Any:
    """The set once it was trained."""
    code, said = await post(station, f"/api/studio/sets/{name}/train", {"flights": flights})
    assert code == 202, said
    async with Within(within_s):
        while True:
            known = await got(station, f"/api/studio/sets/{name}")
            if not (known["training"] or {}).get("running"):
                return known
            await asyncio.sleep(0.2)
