"""What goes to one browser: newest wins, drops are counted, one picture on its way."""

from __future__ import annotations

import asyncio

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.core.errors import InputError
from flightd.core.preview import CameraName
from flightd.ground.browser import Browser
from flightd.ground.latest_slots import LatestSlots
from flightd.ground.messages import (
    MAX_PAGE_MESSAGE_BYTES,
    Drawn,
    Echo,
    PictureKey,
    Want,
    read_act,
    read_page_message,
)
from tests.rigs.event_loops import virtual

DOWN = PictureKey("demo", CameraName.DOWN)
FRONT = PictureKey("demo", CameraName.FRONT)


@given(st.lists(st.tuples(st.integers(0, 4), st.integers())))
def test_the_newest_of_each_topic_is_left_and_every_other_is_counted(puts: list[tuple[int, int]]) -> None:
    slots: LatestSlots[int, int] = LatestSlots()
    for topic, value in puts:
        slots.put(topic, value)
    left = {}
    while (taken := slots.take()) is not None:
        left[taken[0]] = taken[1]
    assert left == dict(puts)
    assert slots.dropped == len(puts) - len(left)


def test_a_topic_that_is_put_often_does_not_keep_others_waiting() -> None:
    slots: LatestSlots[str, int] = LatestSlots()
    slots.put("a", 1)
    slots.put("b", 1)
    for value in range(100):
        slots.put("a", value)
    assert (slots.take(), slots.take(), slots.take()) == (("a", 99), ("b", 1), None)


def test_a_browser_that_takes_nothing_holds_one_message_per_topic() -> None:
    browser = Browser()
    browser.hear(Want((DOWN, FRONT)))
    for i in range(1000):
        browser.offer(("demo", f"topic {i % 7}"), str(i))
        browser.offer_picture(DOWN, b"picture")
        browser.offer_picture(FRONT, b"picture")
    assert browser.waiting == 9
    assert (browser.dropped, browser.pictures_dropped) == (993, 1998)


def test_the_next_picture_comes_when_the_last_is_drawn_and_words_do_not_wait_for_it() -> None:
    async def taken() -> list[str | bytes]:
        browser = Browser()
        browser.hear(Want((DOWN,)))
        browser.offer_picture(FRONT, b"not wanted")
        browser.offer_picture(DOWN, b"first")
        seen = [await browser.next()]
        assert not browser.has_use_for(DOWN), "one is on its way"
        browser.offer_picture(DOWN, b"second")
        browser.offer_picture(DOWN, b"third")
        browser.offer(("demo", "status"), "words")
        seen.append(await browser.next())
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(browser.next(), 60)
        browser.hear(Drawn())
        seen.append(await browser.next())
        browser.hear(Want(()))
        assert not browser.has_use_for(DOWN)
        return seen

    assert virtual(taken()) == [b"first", "words", b"third"]


def test_an_echo_says_what_was_left_out() -> None:
    browser = Browser()
    for _ in range(3):
        browser.offer(("demo", "status"), "words")
    browser.hear(Echo(17.5))

    async def both() -> list[str | bytes]:
        return [await browser.next(), await browser.next()]

    words, echo = virtual(both())
    assert words == "words"
    assert '"number":17.5,"dropped":2,"pictures_dropped":0' in str(echo)


@pytest.mark.parametrize(
    "text",
    [
        "", "{", "[]", "null", '{"say":"shout"}', '{"say":"want"}',
        '{"say":"want","pictures":[{"drone":"a"}]}',
        '{"say":"want","pictures":[{"drone":"a","camera":"rear"}]}', '{"say":"drawn","more":1}',
        '{"say":"echo","number":"1"}', '{"say":"echo","number":1}' + " " * MAX_PAGE_MESSAGE_BYTES,
        '{"say":"want","pictures":[' + "[" * 2000 + "]", b"\xff\xfe",
    ],
)  # fmt: skip
def test_what_no_page_says_is_refused(text: str | bytes) -> None:
    with pytest.raises(InputError, match="not a message of the page"):
        read_page_message(text)


@pytest.mark.parametrize(
    "body",
    [
        b"", b"{}", b'{"id":"12345678"}', b'{"id":"1","command":"stop"}',
        b'{"id":"12345678","command":"fall"}',
        b'{"id":"12345678","command":"stop","now":true}', b'{"id":"12345678","command":"goto"}',
        b'{"id":"12345678","command":"stop","node":"A1"}', b'{"id":1,"command":"stop"}', b"\x00",
    ],
)  # fmt: skip
def test_what_is_no_act_is_refused(body: bytes) -> None:
    with pytest.raises(InputError):
        read_act(body)
