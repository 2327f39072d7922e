"""What is not critical is started again, whatever it failed by; only what a person has to mend is not."""

from __future__ import annotations

import asyncio

import pytest

from flightd.core.errors import TransientError, UnavailableError
from flightd.runtime.supervisor import restarted
from tests.rigs.event_loops import virtual


def failing(*errors: Exception) -> list[str]:
    """What is told of a part that fails by one after the other, and then runs."""
    told: list[str] = []
    left = list(errors)

    async def part() -> None:
        if left:
            raise left.pop(0)
        await asyncio.Event().wait()

    async def test() -> None:
        running = asyncio.ensure_future(restarted(part, lambda err: told.append(str(err))))
        await asyncio.wait([running], timeout=60.0)
        assert not left or running.done()
        running.cancel()
        await running

    with pytest.raises((asyncio.CancelledError, UnavailableError)):
        virtual(test())
    return told


def test_an_error_that_nobody_foresaw_is_told_and_the_part_started_again() -> None:
    errors = TransientError("the link is gone"), OSError(12, "no memory"), ValueError("a fault")
    told = failing(*errors)
    assert told == ["the link is gone", "OSError: [Errno 12] no memory", "ValueError: a fault"]


def test_what_a_person_has_to_mend_is_the_callers() -> None:
    assert failing(UnavailableError("the port is taken"), ValueError("never reached")) == []
