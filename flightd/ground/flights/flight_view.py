"""One flight as the page plays it back: made in the reading process, sent as JSON."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from flightd.adapters.ground_link.floor_status import floor_status
from flightd.core.errors import InputError
from flightd.core.geometry import Lens
from flightd.ground.flights.log_folder import beside, path_of
from flightd.ground.messages import framed_picture
from flightd.replay.playback.decimation import TimeGrid, decimated
from flightd.replay.playback.flight import Playback, PoseTrack
from flightd.replay.playback.loader import load_playback
from flightd.replay.playback.pictures import PicturePlace, find_pictures, middle_picture, read_picture

MOST_STRETCHES = 2000
_MOST_REPORT_BYTES = 48 << 20
_DIGITS = 4
_THUMBNAIL_PX = 160


@dataclass(frozen=True, slots=True)
class FlightView:
    """`head` is all but the curves, as JSON; `columns` are decimated on request.  `size` in bytes is what
    it takes in memory."""

    head: bytes
    grid: TimeGrid
    columns: dict[str, np.ndarray[Any, np.dtype[np.float32]]]
    pictures: tuple[PicturePlace, ...]
    lens: Lens | None

    @property
    def size(self) -> int:
        return (
            len(self.head) + sum(column.nbytes for column in self.columns.values()) + 200 * len(self.pictures)
        )

    def series(self, from_s: float, to_s: float, stretches: int) -> bytes:
        """The curves between two times as JSON: `from_s`, `step_s`, and by name two values for each
        stretch, null where unknown.  InputError where that is no stretch of the flight."""
        low, high = max(from_s, self.grid.from_s), min(to_s, self.grid.to_s)
        if not high > low or not 1 <= stretches <= MOST_STRETCHES:
            raise InputError(f"no stretch of the flight: {from_s} to {to_s} s in {stretches}")
        grid, times = TimeGrid(low, high, stretches), self.grid.times_s()
        near = slice(*np.searchsorted(times, (low - 2.0, high + 2.0)))
        curves = {
            name: np.round(decimated(times[near], column[near].astype(np.float64), grid), _DIGITS).tolist()
            for name, column in self.columns.items()
        }
        first_s = float(grid.times_s()[0])
        return msgspec.json.encode({"from_s": first_s, "step_s": grid.step_s / 2, "curves": curves})


def read_view(root: Path, relative: str) -> FlightView:
    """In the reading process.  InputError for a log that cannot be played back."""
    path = path_of(root, relative)
    played, pictures = load_playback(path), find_pictures(path)
    known = {name: column for name, column in played.columns.items() if np.isfinite(column).any()}
    return FlightView(_head(played, pictures), played.grid, known, pictures, played.lens)


def read_framed_picture(root: Path, relative: str, place: PicturePlace, lens: Lens | None) -> bytes:
    """In the reading process: a picture as the page takes it (`messages.framed_picture`)."""
    picture = read_picture(path_of(root, relative), place, lens)
    return framed_picture({"seq": picture.seq, "lines": picture.lines, "areas": ()}, picture.jpeg)


def read_thumbnail(root: Path, relative: str) -> bytes:
    """In the reading process: a small JPEG of the middle of the flight, empty where there is no picture."""
    import cv2  # noqa: PLC0415 - slow, and only that process needs it

    from flightd.vision.jpeg import decoded_jpeg  # noqa: PLC0415

    picture = decoded_jpeg(middle_picture(path_of(root, relative)))
    if picture is None:
        return b""
    height = max(1, min(_THUMBNAIL_PX, round(_THUMBNAIL_PX * picture.shape[0] / picture.shape[1])))
    small = cv2.resize(picture, (_THUMBNAIL_PX, height), interpolation=cv2.INTER_AREA)
    return bytes(cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 80])[1])


def read_report(root: Path, relative: str) -> bytes:
    """In the reading process: the report beside the log, made anew where there is none that is newer."""
    from flightd.replay.report.loader import load_flight  # noqa: PLC0415 - slow, and seldom needed
    from flightd.replay.report.page import render  # noqa: PLC0415
    from flightd.studies.counted_stock import counted_beside  # noqa: PLC0415

    path = path_of(root, relative)
    made = beside(path, "report.html")
    if made is not None and made.stat().st_mtime_ns >= path.stat().st_mtime_ns:
        if made.stat().st_size > _MOST_REPORT_BYTES:
            raise InputError("the report beside the log is too large to be shown here")
        return made.read_bytes()
    for name in ("summary.json", "truth.mcap", "inventory.db", "evidence"):
        if path.with_name(name).is_symlink():
            raise InputError(f"{name} beside the log is a link; a report is made of files in its folder only")
    return render(load_flight(path), counted_beside(path, untouched=True)).encode()


def _head(played: Playback, pictures: tuple[PicturePlace, ...]) -> bytes:
    def seconds(stamp_ns: int) -> float:
        return round((stamp_ns - played.start_ns) * 1e-9, 3)

    return msgspec.json.encode(
        {
            "duration_s": played.duration_s,
            "damage": played.damage,
            "version": played.metadata.get("version", ""),
            "floor": floor_status(played.site) if played.site is not None else None,
            "map_error": played.map_error,
            "moments": [
                {
                    "t_s": round(one.t_s, 3),
                    "phase": one.phase,
                    "reason": one.reason,
                    "node": one.node,
                    "goal": one.goal,
                    "nodes_done": one.nodes_done,
                    "nodes_planned": one.nodes_planned,
                }
                for one in played.moments
            ],
            "events": [
                {"t_s": round(one.t_s, 3), "level": one.level, "name": one.name, "text": one.text}
                for one in played.events
            ],
            "legs": [
                {"t_s": None if leg.t_s is None else round(leg.t_s, 3), "via": leg.via} for leg in played.legs
            ],
            "track": _track(played.track),
            "truth": _track(played.truth) if played.truth is not None else None,
            "seen": [
                {"t_s": round(one.t_s, 2), "lines": [[round(at, 2) for at in line] for line in one.lines]}
                for one in played.seen
            ],
            "pictures": [{"t_s": seconds(place.stamp_ns), "seq": place.seq} for place in pictures],
            "estimated": played.estimated,
        }
    )


def _track(track: PoseTrack) -> dict[str, list[float]]:
    columns = {
        "t_s": track.t_s,
        "x_m": track.x_m,
        "y_m": track.y_m,
        "yaw_rad": track.yaw_rad,
        "sigma_x_m": track.sigma_x_m,
        "sigma_y_m": track.sigma_y_m,
        "sigma_yaw_rad": track.sigma_yaw_rad,
    }
    with np.errstate(over="ignore"):  # a log may hold any number: one that overflows is told as unknown
        return {
            name: np.round(column, 3).tolist()
            for name, column in columns.items()
            if np.isfinite(column).any()
        }
