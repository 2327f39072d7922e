"""A Ctrl-C at the terminal reaches the whole group: children that are still starting leave it alone."""

from __future__ import annotations

import asyncio
import signal
import subprocess
import sys
import threading

import pytest

from flightd.runtime.undisturbed_start import undisturbed
from tests.rigs.event_loops import real

BLOCKED = "import signal; print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))"


def blocked_in_a_child() -> str:
    return subprocess.run(
        [sys.executable, "-c", BLOCKED], capture_output=True, text=True, timeout=60, check=True
    ).stdout.strip()


def test_a_child_is_born_with_the_interrupt_blocked_and_the_parent_is_as_before() -> None:
    with undisturbed():
        assert blocked_in_a_child() == "True"
    assert blocked_in_a_child() == "False"


def test_an_interrupt_meanwhile_comes_when_the_start_is_done() -> None:
    done = False

    def start() -> None:
        nonlocal done
        with undisturbed():
            signal.raise_signal(signal.SIGINT)
            done = True

    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background ignores it
    try:
        with pytest.raises(KeyboardInterrupt):
            start()
    finally:
        signal.signal(signal.SIGINT, before)
    assert done


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_loop_hears_once_of_a_signal_that_another_thread_takes_meanwhile(number: signal.Signals) -> None:
    async def test() -> None:
        came: list[int] = []
        loop, begun = asyncio.get_running_loop(), threading.Event()

        def take() -> None:
            begun.wait()
            signal.raise_signal(number)

        taking = threading.Thread(target=take)
        taking.start()
        loop.add_signal_handler(number, came.append, 1)
        try:
            with undisturbed():
                begun.set()
                taking.join()
            await asyncio.sleep(0.05)
        finally:
            loop.remove_signal_handler(number)
        assert came == [1]

    before = signal.getsignal(number)
    try:
        real(test())
    finally:
        signal.signal(number, before)
