"""A flight's recorded pictures as a video, with what vision saw and what the mission did drawn in."""

from __future__ import annotations

import bisect
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from flightd.core.errors import InputError, UnavailableError
from flightd.core.topics import RecordedFrame, Topic
from flightd.core.types import Image, LineSet, Status
from flightd.replay.log import LogReader, read_log
from flightd.studies.overlay import draw
from flightd.studies.progress_bar import track
from flightd.vision.jpeg import decoded_jpeg

_ENDINGS = frozenset((".mp4", ".m4v", ".mov", ".avi", ".mkv"))
_FASTEST_FPS = 60.0
_LONGEST_STILL = 300
"""A picture stands for at most this many frames of the video where others are missing."""


def export_video(log: Path, video: Path) -> int:
    """Write the recorded pictures of `log` to an MP4 file, in the time in which they were taken.

    Returns the number of pictures.  InputError if there are none or the file has no video's name (nothing
    of that name is touched then), UnavailableError if it cannot be written.
    """
    if video.suffix.casefold() not in _ENDINGS:
        raise InputError("is no name of a video", file=video, remedy="name it .mp4")
    stamps_ns = sorted(entry.stamp_ns for entry in LogReader(log).entries({Topic.FRAME}))
    if not stamps_ns:
        raise InputError("holds no pictures", file=log, remedy="record some or export without --video")
    fps = _rate_hz(stamps_ns)
    writer: cv2.VideoWriter | None = None
    pictures = frames = 0
    try:
        for stamp_ns, canvas in track(_canvases(log, stamps_ns[0]), "drawing", total=len(stamps_ns)):
            if writer is None:
                writer, size = _opened(video, fps, canvas), (canvas.shape[1], canvas.shape[0])
            shown = canvas if (canvas.shape[1], canvas.shape[0]) == size else cv2.resize(canvas, size)
            due = round((stamp_ns - stamps_ns[0]) / 1e9 * fps) + 1
            for _ in range(min(max(due - frames, 1), _LONGEST_STILL)):
                writer.write(shown)
            frames = max(frames + 1, due)
            pictures += 1
    finally:
        if writer is not None:
            writer.release()
    if not pictures:
        raise InputError("none of its pictures can be decoded", file=log)
    return pictures


def _rate_hz(stamps_ns: list[int]) -> float:
    """The usual rate of the pictures."""
    gaps_s = np.diff(stamps_ns) / 1e9
    gaps_s = gaps_s[gaps_s > 0]
    return min(1.0 / float(np.median(gaps_s)), _FASTEST_FPS) if len(gaps_s) else 1.0


def _canvases(log: Path, start_ns: int) -> Iterator[tuple[int, Image]]:
    """Each picture that can be decoded, drawn over, with its stamp."""
    told = read_log(log, {Topic.LINES, Topic.STATUS})
    seen = {lines.frame_seq: lines for lines in told.messages(LineSet)}
    statuses = told.messages(Status)
    status_ns = [status.stamp_ns for status in statuses]
    for entry in LogReader(log).entries({Topic.FRAME}):
        assert isinstance(entry.message, RecordedFrame)
        found = seen.get(entry.message.seq)
        image = _decoded(entry.message, found)
        if image is None:
            continue
        newest = bisect.bisect_right(status_ns, entry.stamp_ns) - 1
        title = _title((entry.stamp_ns - start_ns) / 1e9, statuses[newest] if newest >= 0 else None)
        nothing = LineSet(entry.message.seq, entry.stamp_ns, image.shape[1], image.shape[0], (), (), "")
        yield entry.stamp_ns, draw(image, found or nothing, title)


def _opened(video: Path, fps: float, canvas: Image) -> cv2.VideoWriter:
    try:
        video.parent.mkdir(parents=True, exist_ok=True)
        video.open("wb").close()  # OpenCV does not say why it cannot write
    except OSError as err:
        raise UnavailableError(f"cannot write the video: {err.strerror}", file=video) from None
    writer = cv2.VideoWriter(
        str(video), cv2.VideoWriter.fourcc(*"mp4v"), fps, (canvas.shape[1], canvas.shape[0])
    )
    if not writer.isOpened():
        raise UnavailableError("this OpenCV cannot write it", file=video, remedy="name it .mp4")
    return writer


def _decoded(picture: RecordedFrame, seen: LineSet | None) -> Image | None:
    """The picture, in the size in which its lines were measured; None if it is none."""
    image = decoded_jpeg(picture.jpeg)
    if image is None:
        return None
    if seen is not None and (image.shape[1], image.shape[0]) != (seen.width_px, seen.height_px):
        image = cv2.resize(image, (seen.width_px, seen.height_px)).astype(np.uint8, copy=False)
    return image


def _title(t_s: float, status: Status | None) -> str:
    clock = f"{int(t_s // 60)}:{t_s % 60:04.1f}"
    if status is None:
        return clock
    goal = f" to {status.goal}" if status.goal and status.goal != status.node else ""
    return f"{clock}  {status.phase.replace('_', ' ')}  {status.node}{goal}  {status.height_m:.2f} m"
