"""The picture behind a ticket, copied before its slot is written again."""

from __future__ import annotations

from flightd.core.errors import TransientError, UnavailableError
from flightd.core.types import Image
from flightd.runtime.frame_ring import FrameRing, FrameTicket


def picture_of(ticket: FrameTicket) -> Image | None:
    """None when it is gone already."""
    try:
        ring = FrameRing.attach(ticket.ring, ticket.slots, ticket.width_px, ticket.height_px)
    except UnavailableError:
        return None
    try:
        picture = ring.pixels(ticket.slot).copy()
        ring.check(ticket.slot, ticket.seq)
    except TransientError:
        return None
    finally:
        ring.close()
    return picture
