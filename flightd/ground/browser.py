"""One browser: a slot for the newest value of each topic, and one picture on its way at most."""

from __future__ import annotations

import asyncio
from typing import TypeAlias

from flightd.core.errors import InputError
from flightd.ground.latest_slots import LatestSlots
from flightd.ground.messages import Drawn, Echo, PageMessage, PictureKey, Want, topic_message

MOST_ACTS_OF_A_PAGE = 64
"""So many acts of one page may wait for their answer at once: more than anybody orders."""
_ANSWER = "answer "

Topic: TypeAlias = tuple[str, str]
"""Drone and topic."""


class Browser:
    """What one page is sent and wants.  Nobody who offers ever waits for it: what it does not take in time
    is replaced by what is newer, and counted."""

    def __init__(self, attends: bool = True) -> None:
        self.attends = attends
        self._topics: LatestSlots[Topic, str] = LatestSlots()
        self._pictures: LatestSlots[PictureKey, bytes] = LatestSlots()
        self._wanted: frozenset[PictureKey] = frozenset()
        self._drawing = False
        self._acting = 0
        self._changed = asyncio.Event()

    @property
    def dropped(self) -> int:
        """Values that were replaced before this browser took them."""
        return self._topics.dropped

    @property
    def pictures_dropped(self) -> int:
        """Pictures that were replaced before this browser took them."""
        return self._pictures.dropped

    @property
    def waiting(self) -> int:
        """Messages that wait to be taken: never more than there are topics, and answers to acts."""
        return len(self._topics) + len(self._pictures)

    def begin_act(self) -> None:
        """An act of this page waits for its answer from now on.  InputError where so many wait that no person
        can have given them."""
        untaken = sum(topic.startswith(_ANSWER) for _, topic in self._topics.topics())
        if self._acting + untaken >= MOST_ACTS_OF_A_PAGE:
            raise InputError(f"{MOST_ACTS_OF_A_PAGE} acts of this page wait for their answer already")
        self._acting += 1

    def answer_act(self, number: int, message: str) -> None:
        """The answer to an act that began; no other one takes its place."""
        self._acting -= 1
        self.offer(("", f"{_ANSWER}{number}"), message)

    def offer(self, topic: Topic, message: str) -> None:
        """A topic's newest value."""
        self._topics.put(topic, message)
        self._changed.set()

    def offer_picture(self, key: PictureKey, message: bytes) -> None:
        """A camera's newest picture; left out where this page does not show it."""
        if key in self._wanted:
            self._pictures.put(key, message)
            self._changed.set()

    def has_use_for(self, key: PictureKey) -> bool:
        """It shows this camera, and would draw a new picture of it at once."""
        return key in self._wanted and not self._drawing and key not in self._pictures

    def hear(self, message: PageMessage) -> None:
        """What the page says."""
        match message:
            case Want(pictures):
                self._wanted = frozenset(pictures)
                for key in self._pictures.topics():
                    if key not in self._wanted:
                        self._pictures.forget(key)
            case Drawn():
                self._drawing = False
                self._changed.set()
            case Echo(number):
                value = {
                    "number": number,
                    "dropped": self.dropped,
                    "pictures_dropped": self.pictures_dropped,
                }
                self.offer(("", "echo"), topic_message("", "echo", value))

    async def next(self) -> str | bytes:
        """The next message to send: topics before pictures, a picture only once the last one is drawn."""
        while True:
            told = self._topics.take()
            if told is not None:
                return told[1]
            if not self._drawing and (shown := self._pictures.take()) is not None:
                self._drawing = True
                return shown[1]
            self._changed.clear()
            await self._changed.wait()
