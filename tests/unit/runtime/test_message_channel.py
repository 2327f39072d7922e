"""Messages come whole, however they are cut up on their way; nobody waits for what a child does."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
from typing import Any

import pytest

from flightd.runtime.child_process import LinkedProcess
from flightd.runtime.message_channel import Channel, ChildEnd
from flightd.runtime.within import Within
from tests.rigs.event_loops import in_real_time
from tests.rigs.waiting import until

LARGE = 8 << 20


class Taker:
    """What a channel told."""

    def __init__(self, channel: Channel) -> None:
        self.messages: list[Any] = []
        self.ends: list[str] = []
        channel.listen(self.messages.append, self.ends.append)


def wire_form(message: object) -> bytes:
    """The message as it goes over the wire."""
    ours, theirs = socket.socketpair()
    with ours, theirs:
        ChildEnd(theirs).send(message)
        return ours.recv(1 << 16)


@in_real_time
async def test_messages_cut_anywhere_come_whole_and_in_order() -> None:
    channel = Channel()
    with channel.theirs as theirs:
        taker = Taker(channel)
        wire = b"".join(wire_form(("message", number)) for number in range(3))
        for at in range(len(wire)):
            theirs.send(wire[at : at + 1])
            await asyncio.sleep(0)
        theirs.send(wire)
        await until(lambda: len(taker.messages) == 6)
        channel.close()
    assert taker.messages == [("message", number) for number in (0, 1, 2, 0, 1, 2)]
    assert not taker.ends, "who closed it knows"


@in_real_time
async def test_a_message_that_is_too_long_ends_the_channel_before_it_is_taken_in() -> None:
    channel = Channel(most_bytes=1000)
    with channel.theirs as theirs:
        taker = Taker(channel)
        theirs.sendall(wire_form(b"x" * 2000)[:10])
        await until(lambda: taker.ends)
    assert "sent a message of" in taker.ends[0]
    assert not taker.messages


@in_real_time
async def test_a_child_that_goes_in_the_middle_of_a_message_is_told_once() -> None:
    channel = Channel()
    with channel.theirs as theirs:
        taker = Taker(channel)
        theirs.sendall(wire_form("half a message")[:-3])
    await until(lambda: taker.ends)
    assert taker.ends == ["the process died"]
    assert not taker.messages
    assert not channel.send("into the void")


@in_real_time
async def test_a_child_that_takes_nothing_is_given_up_not_waited_for() -> None:
    channel = Channel()
    with channel.theirs:
        sent = 0
        while channel.send(b"x" * 1000):
            sent += 1
            assert sent < 100_000
    assert sent > 10


def echo(parent: ChildEnd, first: str) -> None:
    parent.send(first)
    while True:
        message = parent.receive()
        if message == "stop":
            os.kill(os.getpid(), signal.SIGSTOP)
        parent.send(message)


@in_real_time
async def test_a_process_that_is_stopped_and_sent_ever_more_is_killed() -> None:
    told: list[Any] = []
    ends: list[str] = []
    process = LinkedProcess(echo, ("here",), told.append, ends.append)
    await until(lambda: told == ["here"])
    assert process.send("back")
    await until(lambda: told == ["here", "back"])
    process.send("stop")
    await until(lambda: not process.send(b"x" * 1000))
    assert ends == ["the process takes no messages"]
    await asyncio.to_thread(process.join, 10.0)


def flood(parent: ChildEnd) -> None:
    parent.send(b"x" * LARGE)


@in_real_time
async def test_the_loop_turns_while_a_large_message_comes() -> None:
    told: list[bytes] = []
    turns = 0
    process = LinkedProcess(flood, (), told.append, lambda _: None)
    async with Within(30.0):
        while not told:
            turns += 1
            await asyncio.sleep(0)
    process.kill()
    await asyncio.to_thread(process.join, 10.0)
    assert len(told[0]) == LARGE
    assert turns > 100, "one turn for each piece at least"


@pytest.mark.parametrize("message", [None, "", b"", (1, "two", 3.0), {"four": [5]}])
@in_real_time
async def test_what_is_sent_is_received(message: object) -> None:
    channel = Channel()
    with channel.theirs as theirs:
        taker = Taker(channel)
        child = ChildEnd(theirs)
        assert channel.send(message)
        assert child.has_news()
        assert child.receive() == message
        assert not child.has_news()
        child.send(message)
        await until(lambda: taker.messages)
        assert taker.messages == [message]
        channel.close()
        assert child.has_news()
        with pytest.raises(EOFError):
            child.receive()
