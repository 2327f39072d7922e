"""A bound on how long a task may wait, whether it was cancelled before or not."""

from __future__ import annotations

import asyncio
import contextlib

import pytest

from flightd.runtime.within import Within
from tests.rigs.event_loops import in_real_time

FOREVER_S = 3600.0


@in_real_time
async def test_what_takes_too_long_is_a_timeout_and_the_task_goes_on() -> None:
    with pytest.raises(TimeoutError):
        async with Within(0.01):
            await asyncio.sleep(FOREVER_S)
    async with Within(FOREVER_S):
        await asyncio.sleep(0)
    task = asyncio.current_task()
    assert task is not None
    assert task.cancelling() == 0


@in_real_time
async def test_a_time_that_is_over_ends_the_first_wait() -> None:
    with pytest.raises(TimeoutError):
        async with Within(-1.0):
            await asyncio.sleep(0)


@pytest.mark.parametrize("inner_s", [0.0, FOREVER_S])
@in_real_time
async def test_an_outer_bound_is_not_taken_for_an_inner_one(inner_s: float) -> None:
    did = list[str]()

    async def work() -> None:
        async with Within(0.0):
            with contextlib.suppress(TimeoutError):
                async with Within(inner_s):
                    await asyncio.sleep(FOREVER_S)
            did.append("what follows the inner one")

    with pytest.raises(TimeoutError):
        await work()
    assert not did


@in_real_time
async def test_a_task_that_was_cancelled_cleans_up_after_what_takes_too_long() -> None:
    did = list[str]()

    async def work() -> None:
        try:
            await asyncio.sleep(FOREVER_S)
        finally:
            try:
                async with Within(0.01):
                    await asyncio.sleep(FOREVER_S)
            except TimeoutError:
                did.append("it took too long")
            await asyncio.sleep(0)
            did.append("the rest")

    task = asyncio.ensure_future(work())
    await asyncio.sleep(0)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert did == ["it took too long", "the rest"]


@in_real_time
async def test_who_is_cancelled_meanwhile_is_cancelled() -> None:
    async def work() -> None:
        async with Within(FOREVER_S):
            await asyncio.sleep(FOREVER_S)

    task = asyncio.ensure_future(work())
    await asyncio.sleep(0)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task


@pytest.mark.parametrize("turns", [1, 2], ids=["before", "after"])
@in_real_time
async def test_who_is_cancelled_in_the_turn_in_which_it_takes_too_long_is_cancelled(turns: int) -> None:
    async def work() -> None:
        async with Within(0.0):
            await asyncio.sleep(FOREVER_S)

    task = asyncio.ensure_future(work())
    for _ in range(turns):
        await asyncio.sleep(0)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task


@in_real_time
async def test_an_error_of_the_body_is_what_comes_out() -> None:
    with pytest.raises(ValueError, match="its own"):
        async with Within(FOREVER_S):
            raise ValueError("its own")


@in_real_time
async def test_an_error_of_the_body_comes_out_where_it_took_too_long_too() -> None:
    async def work() -> None:
        async with Within(0.0):
            try:
                await asyncio.sleep(FOREVER_S)
            finally:
                raise ValueError("its own")

    with pytest.raises(ValueError, match="its own"):
        await work()
    task = asyncio.current_task()
    assert task is not None
    assert task.cancelling() == 0
