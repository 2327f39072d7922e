"""A picture as the ground link tells it."""

from __future__ import annotations

from flightd.adapters.ground_link.messages.answers import PictureAnswer, PictureArea, PictureLine
from flightd.core.preview import Preview


def picture_answer(preview: Preview, request_id: str) -> PictureAnswer:
    """What goes before the JPEG."""
    return PictureAnswer(
        request=request_id,
        seq=preview.seq,
        stamp_ns=preview.stamp_ns,
        camera=preview.camera,
        lines=tuple(PictureLine(line.points, line.width) for line in preview.lines),
        areas=tuple(PictureArea(area.kind, area.text, area.corners) for area in preview.areas),
    )
