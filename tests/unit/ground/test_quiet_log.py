"""What the HTTP server's log leaves out, and what it does not."""

from __future__ import annotations

import asyncio
import logging

import pytest

from flightd.ground.quiet_log import quiet_log


def test_only_what_went_wrong_in_the_station_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    quiet_log()
    log = logging.getLogger("uvicorn.error")
    for error in (asyncio.CancelledError("the station ends"), ValueError("a mistake of ours")):
        log.error("Exception in ASGI application\n", exc_info=error)
    log.error("Invalid UTF-8 sequence received from client.")
    log.error("something else")
    said = [(record.getMessage(), record.exc_info and record.exc_info[0]) for record in caplog.records]
    assert said == [("Exception in ASGI application\n", ValueError), ("something else", None)]
