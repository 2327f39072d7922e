"""Between the drones and the browsers: newest values on their way out, acts on their way in."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import asynccontextmanager, contextmanager
from functools import partial
from typing import Any, Protocol

from flightd import __version__
from flightd.adapters.ground_link.client import Address
from flightd.ground.browser import Browser, Topic
from flightd.ground.drone_link import DroneLink
from flightd.ground.free_name import free_name
from flightd.ground.messages import LinkPicture, PageMessage, PictureKey, picture_message, topic_message

MOST_BROWSERS = 64
"""More pages than this are refused: each costs memory and time."""


class Viewer(Protocol):
    """Looks on beside the pages, and attends nothing.  None of it may wait: it is called in the station's
    loop."""

    def attach(self, wake: Callable[[], object] | None) -> None:
        """`wake` is to be called, by whatever thread, when other pictures are wanted; None: no more."""
        ...

    def tell(self, drone: str, topic: str, value: Any) -> None:
        """A topic's newest value."""
        ...

    def show(self, key: PictureKey, picture: LinkPicture) -> None:
        """A camera's newest picture, wanted or not."""
        ...

    def has_use_for(self, key: PictureKey) -> bool:
        """A new picture of this camera is wanted now."""
        ...


class Hub:
    """Runs one task per drone and keeps what each topic says last, so that a page that is opened, or opened
    again, has everything at once.

    A drone is attended while the page of anybody is open who may fly, and no longer: closing the last one is
    losing the ground.  A station that flies them itself `attends` as long as it runs."""

    def __init__(
        self, drones: Sequence[tuple[str, Address]], viewers: Sequence[Viewer] = (), *, attends: bool = False
    ) -> None:
        self._attends = attends
        self._viewers = tuple(viewers)
        self._latest: dict[Topic, Any] = {}
        self._browsers: set[Browser] = set()
        self._looking = asyncio.Event()
        self.drones = {name: DroneLink(name, address, self) for name, address in drones}
        self._each: list[Callable[[DroneLink], None]] = []
        self._tell_station()

    async def run(self) -> None:
        """Serve until cancelled."""
        loop = asyncio.get_running_loop()
        for viewer in self._viewers:
            viewer.attach(partial(loop.call_soon_threadsafe, self._looking.set))
        try:
            async with asyncio.TaskGroup() as tasks:
                for name, drone in self.drones.items():
                    tasks.create_task(drone.run(), name=f"drone {name}")
                await asyncio.Event().wait()  # a station may have no drone at all
        finally:
            for viewer in self._viewers:
                viewer.attach(None)

    def for_each(self, prepare: Callable[[DroneLink], None]) -> None:
        """Do it to every drone, and to those that join, before they are heard."""
        self._each.append(prepare)
        for drone in self.drones.values():
            prepare(drone)

    def free_name(self, name: str) -> str:
        """The name, or one like it where a drone has it already."""
        return free_name(name, self.drones)

    @asynccontextmanager
    async def joined(self, name: str, address: Address) -> AsyncIterator[None]:
        """A drone more meanwhile, under a name that none has (`free_name`); afterwards it is forgotten."""
        drone = self.drones[name] = DroneLink(name, address, self)
        for prepare in self._each:
            prepare(drone)
        self._tell_station()
        try:
            async with asyncio.TaskGroup() as tasks:
                running = tasks.create_task(drone.run(), name=f"drone {name}")
                try:
                    yield
                finally:
                    running.cancel()
        finally:
            del self.drones[name]
            self._latest = {topic: value for topic, value in self._latest.items() if topic[0] != name}
            self._tell_station()

    @property
    def browsers(self) -> int:
        """Pages that are open now."""
        return len(self._browsers)

    @property
    def is_attended(self) -> bool:
        """Some page is open of a person who may fly, who only looks on being no ground for the flight; or the
        station flies them itself."""
        return self._attends or any(browser.attends for browser in self._browsers)

    @property
    def is_full(self) -> bool:
        """No more pages are taken."""
        return len(self._browsers) >= MOST_BROWSERS

    @contextmanager
    def opened(self, attends: bool) -> Iterator[Browser]:
        """A page is open meanwhile, told at once what each topic says last; `attends`: its person may fly."""
        browser = Browser(attends)
        for topic in sorted(self._latest, key=lambda topic: topic[1] == "link"):  # how old the rest is: last
            browser.offer(topic, topic_message(*topic, self._latest[topic]))
        self._browsers.add(browser)
        self._tell_station()
        try:
            yield browser
        finally:
            self._browsers.discard(browser)
            self._tell_station()
            self._looking.set()

    def hear(self, browser: Browser, message: PageMessage) -> None:
        """What a page says."""
        browser.hear(message)
        self._looking.set()

    def keep(self, drone: str, topic: str, value: Any) -> None:
        """Tell a topic's newest value to the pages that are opened from now on."""
        self._latest[drone, topic] = value
        for viewer in self._viewers:
            viewer.tell(drone, topic, value)

    def tell(self, drone: str, topic: str, value: Any) -> None:
        """Tell every page a topic's newest value, and those that are opened later."""
        self.keep(drone, topic, value)
        if not self._browsers:
            return
        message = topic_message(drone, topic, value)
        for browser in self._browsers:
            browser.offer((drone, topic), message)

    def show(self, key: PictureKey, picture: LinkPicture) -> None:
        """Show a picture to every page that wants it."""
        for viewer in self._viewers:
            viewer.show(key, picture)
        if not self._browsers:
            return
        message = picture_message(key, picture)
        for browser in self._browsers:
            browser.offer_picture(key, message)

    async def wanted(self, key: PictureKey) -> None:
        """Wait until some page has use for a picture of that camera."""
        while not self._has_use_for(key):
            self._looking.clear()
            await self._looking.wait()

    def _has_use_for(self, key: PictureKey) -> bool:
        return any(browser.has_use_for(key) for browser in self._browsers) or any(
            viewer.has_use_for(key) for viewer in self._viewers
        )

    def _tell_station(self) -> None:
        self.tell(
            "",
            "station",
            {"version": __version__, "drones": tuple(self.drones), "browsers": len(self._browsers)},
        )
