"""What the HTTP server writes to its log: what went wrong in the station, not what strangers send.

A line, let alone a traceback, for each broken message would let anybody fill the journal, and hold up the
station where nobody reads its standard error.
"""

from __future__ import annotations

import logging

_OF_STRANGERS = ("Invalid UTF-8 sequence received from client",)


class _Strangers(logging.Filter):
    def filter(self, record: logging.LogRecord) -> bool:
        return not record.getMessage().startswith(_OF_STRANGERS)


_strangers = _Strangers()


def quiet_log() -> None:
    """Leave out what strangers cause, from now on."""
    logging.getLogger("uvicorn.error").addFilter(_strangers)
