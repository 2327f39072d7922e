"""What the HTTP server writes to its log: what went wrong in the station, not what strangers send, nor that a
request was given up because the station ends.

A line, let alone a traceback, for each broken message would let anybody fill the journal, and hold up the
station where nobody reads its standard error.
"""

from __future__ import annotations

import asyncio
import logging

_OF_STRANGERS = ("Invalid UTF-8 sequence received from client",)


class _Unasked(logging.Filter):
    def filter(self, record: logging.LogRecord) -> bool:
        error = record.exc_info[1] if record.exc_info else None
        given_up = isinstance(error, asyncio.CancelledError)
        return not given_up and not record.getMessage().startswith(_OF_STRANGERS)


_unasked = _Unasked()


def quiet_log() -> None:
    """Leave that out, from now on."""
    logging.getLogger("uvicorn.error").addFilter(_unasked)
