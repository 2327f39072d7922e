"""Pages that look on at a ground station, in a process of their own, for `tools.bench_station`.

Plain pages are WebSockets that say what the page says, stalled ones take the socket and never read from it,
the others are pages of a real headless Chromium.  All clocks of one machine are one: how old a status or a
picture is, is told by its own stamp.  Orders come as a line of JSON on standard input, each is answered by
one on standard output.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
import sys
import time
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException
from websockets.typing import Origin

from flightd.runtime.within import Within
from tools.slow_line import SlowLine
from tools.system_browser import system_browser

if TYPE_CHECKING:
    from playwright.async_api import Browser, Page

CAMERAS = ("down", "front")
ANSWER_S = 60.0
"""Nothing is waited for longer than this."""
_ECHO_S = 1.0
_AGAIN_S = 0.7
_HANGS_S = 9.0
_MOST_AGES = 200_000
_RELOAD_S = 60.0
_SHARES = (("p50", 0.5), ("p99", 0.99), ("max", 1.0))
_FLAGS = ("--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run",
          "--disable-renderer-backgrounding", "--disable-backgrounding-occluded-windows")  # fmt: skip
_HOOK = """(() => {
  const seen = (window.seen = { statuses: [], pictures: [], ready: null, closed: 0 });
  let head = null;
  const note = (list, stamp) => list.length < 20000 && list.push([stamp / 1e6, performance.now()]);
  const Plain = window.WebSocket;
  window.WebSocket = class extends Plain {
    constructor(...words) {
      super(...words);
      this.addEventListener("close", () => { seen.closed += 1; });
      this.addEventListener("message", ({ data }) => {
        if (typeof data === "string") {
          const said = JSON.parse(data);
          if (said.topic !== "status") return;
          requestAnimationFrame(() => setTimeout(() => {  // the page draws in the frame before
            note(seen.statuses, said.value.stamp_ns);
            seen.ready ??= performance.now();
          }));
        } else {
          const length = new DataView(data).getUint32(0);
          head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
        }
      });
    }
  };
  const draw = CanvasRenderingContext2D.prototype.drawImage;
  CanvasRenderingContext2D.prototype.drawImage = function (...words) {
    draw.apply(this, words);
    if (head !== null) note(seen.pictures, head.stamp_ns);
    head = null;
  };
})()"""

_LOADED = """() => performance.getEntries().filter((entry) => "encodedBodySize" in entry)
  .reduce((sum, entry) => sum + entry.encodedBodySize, 0)"""


@dataclass
class Seen:
    """How old, ms, each status and picture was when a page had it; how often a page was closed."""

    statuses: list[float] = field(default_factory=list)
    pictures: list[float] = field(default_factory=list)
    closed: int = 0
    phase: str = ""
    browsers: int = 0

    def clear(self) -> None:
        self.statuses.clear()
        self.pictures.clear()
        self.closed = 0

    def told(self) -> dict[str, Any]:
        return {
            "status_age_ms": quantiles(self.statuses),
            "picture_age_ms": quantiles(self.pictures),
            "closed": self.closed,
        }


def quantiles(values: list[float]) -> dict[str, float]:
    """p50, p99, the highest and how many; only how many where there are none."""
    if not values:
        return {"count": 0}
    ordered = sorted(values)
    at = {name: ordered[min(int(share * len(ordered)), len(ordered) - 1)] for name, share in _SHARES}
    return {**{name: round(value, 2) for name, value in at.items()}, "count": len(ordered)}


class PlainPage:
    """Speaks as the page does."""

    def __init__(self, url: str, seen: Seen, port: int) -> None:
        """`port`: where the way to the station begins."""
        self._url, self._seen, self._port = url, seen, port

    async def run(self) -> None:
        while True:
            try:
                async with connect(
                    self._url.replace("http", "ws", 1) + "/live",
                    host="127.0.0.1",
                    port=self._port,
                    origin=Origin(self._url),
                    proxy=None,
                    max_size=None,
                    open_timeout=ANSWER_S,
                    close_timeout=0.3,
                    ping_interval=None,
                ) as page:
                    await self._look_on(page)
            except (OSError, TimeoutError, WebSocketException):
                self._seen.closed += 1
            await asyncio.sleep(_AGAIN_S)

    async def _look_on(self, page: ClientConnection) -> None:
        echo_s = 0.0
        while True:
            message = await page.recv()
            now_s = time.monotonic()
            if now_s - echo_s > _ECHO_S:
                echo_s = now_s
                await page.send(json.dumps({"say": "echo", "number": now_s}))
            if isinstance(message, str):
                said = json.loads(message)
                if said["topic"] == "welcome":
                    wanted = [{"drone": said["drone"], "camera": camera} for camera in CAMERAS]
                    await page.send(json.dumps({"say": "want", "pictures": wanted}))
                elif said["topic"] == "station":
                    self._seen.browsers = said["value"]["browsers"]
                elif said["topic"] == "status":
                    self._seen.phase = said["value"]["phase"]
                    _note(self._seen.statuses, now_s * 1e3 - said["value"]["stamp_ns"] / 1e6)
            else:
                head = json.loads(message[4 : 4 + int.from_bytes(message[:4])])
                _note(self._seen.pictures, now_s * 1e3 - head["stamp_ns"] / 1e6)
                await page.send('{"say":"drawn"}')


class StalledPage:
    """Opens its WebSocket and never reads from it.  The station has cut it off after `_HANGS_S`, of which it
    hears nothing behind all that it has not read: then another one comes."""

    def __init__(self, url: str, seen: Seen) -> None:
        host, _, port = url.removeprefix("http://").rpartition(":")
        self._at, self._url, self._seen = (host, int(port)), url, seen

    async def run(self) -> None:
        while True:
            with contextlib.suppress(OSError, TimeoutError), socket.socket() as hung:
                await self._hang(hung)
            self._seen.closed += 1

    async def _hang(self, hung: socket.socket) -> None:
        lines = (
            "GET /live HTTP/1.1", f"Host: {self._at[0]}:{self._at[1]}", f"Origin: {self._url}",
            "Connection: Upgrade", "Upgrade: websocket", "Sec-WebSocket-Version: 13",
            "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==", "", "",
        )  # fmt: skip
        hung.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        hung.setblocking(False)
        loop = asyncio.get_running_loop()
        async with Within(ANSWER_S):
            await loop.sock_connect(hung, self._at)
            await loop.sock_sendall(hung, "\r\n".join(lines).encode())
            await loop.sock_recv(hung, 32)
        await asyncio.sleep(_HANGS_S)


class ChromiumPages:
    """Pages of one headless Chromium, each loaded with nothing in store."""

    def __init__(self, browser: Browser, url: str, count: int) -> None:
        self._browser, self._url, self._count = browser, url, count
        self._pages: list[Page] = []

    async def open(self) -> None:
        for _ in range(self._count):
            context = await self._browser.new_context(viewport={"width": 1400, "height": 900})
            await context.add_init_script(_HOOK)
            page = await context.new_page()
            self._pages.append(page)
            await page.goto(self._url, timeout=ANSWER_S * 1e3, wait_until="commit")

    async def close(self) -> None:
        pages, self._pages = self._pages, []
        for page in pages:
            await page.context.close()

    async def clear(self) -> None:
        for page in self._pages:
            await page.evaluate("() => { seen.statuses = []; seen.pictures = []; seen.closed = 0; }")

    async def told(self) -> dict[str, Any]:
        """Ages; when each page first showed a status, ms after it was asked for; how many bytes it loaded."""
        seen, ready_ms, loaded = Seen(), [], []
        for page in self._pages:
            behind_ms = await _behind_ms(page)
            told = await page.evaluate("() => seen")
            seen.statuses += [now_ms + behind_ms - stamp_ms for stamp_ms, now_ms in told["statuses"]]
            seen.pictures += [now_ms + behind_ms - stamp_ms for stamp_ms, now_ms in told["pictures"]]
            seen.closed += told["closed"]
            ready_ms.append(None if told["ready"] is None else round(told["ready"]))
            loaded.append(await page.evaluate(_LOADED))
        return {**seen.told(), "ready_ms": ready_ms, "loaded_bytes": loaded}


async def _behind_ms(page: Page) -> float:
    """The page's clock behind this process's, by the quickest of some questions."""
    quickest = (1e9, 0.0)
    for _ in range(8):
        asked_s = time.monotonic()
        now_ms: float = await page.evaluate("() => performance.now()")
        came_s = time.monotonic()
        quickest = min(quickest, (came_s - asked_s, (asked_s + came_s) / 2 * 1e3 - now_ms))
    return quickest[1]


class Crowd:
    """All of them: `do` carries one order out, and tells what they have seen since `clear`."""

    def __init__(self) -> None:
        self._plain, self._stalled = Seen(), Seen()
        self._pages: list[asyncio.Task[None]] = []
        self._churning: asyncio.Task[None] | None = None
        self._chromium: ChromiumPages | None = None
        self._browsers: dict[str, Browser] = {}
        self._line: SlowLine | None = None
        self._started: Any = None
        self._loading = asyncio.Lock()
        self.reloads = 0

    async def do(self, order: dict[str, Any]) -> dict[str, Any]:
        async with Within(2 * ANSWER_S):
            match order.pop("do"):
                case "open":
                    await self._close()
                    await self._open(**order)
                case "clear":
                    await self._clear()
                case "close":
                    await self._close()
            async with self._loading:
                return await self._told()

    async def _open(
        self,
        url: str,
        plain: int = 0,
        stalled: int = 0,
        chromium: int = 0,
        mbit: float = 0,
        churn_s: float = 0,
    ) -> None:
        """`mbit`: over a line of so much, 0: none.  Every `churn_s` a plain page goes and another comes; 0:
        they stay."""
        port, rule = int(url.rpartition(":")[2]), ""
        if mbit:
            self._line = SlowLine(port, mbit)
            near = await self._line.open()
            rule = f"--host-resolver-rules=MAP localhost:{port} 127.0.0.1:{near}"
            url, port = f"http://localhost:{port}", near
        pages = [PlainPage(url, self._plain, port) for _ in range(plain)]
        hung = [StalledPage(url, self._stalled) for _ in range(stalled)]
        self._pages = [asyncio.create_task(page.run(), name="page") for page in pages]
        self._pages += [asyncio.create_task(page.run(), name="stalled page") for page in hung]
        if chromium:
            self._chromium = ChromiumPages(await self._browser(rule), url, chromium)
            await self._chromium.open()
        if churn_s:
            self._churning = asyncio.create_task(self._churn(pages, churn_s), name="churn")

    async def _clear(self) -> None:
        self._plain.clear()
        self._stalled.clear()
        if self._chromium is not None:
            async with self._loading:
                await self._chromium.clear()

    async def _churn(self, pages: list[PlainPage], churn_s: float) -> None:
        loop = asyncio.get_running_loop()
        loaded_s = loop.time()
        while True:
            for index, page in enumerate(pages):
                await asyncio.sleep(churn_s)
                self._pages[index].cancel()
                self._pages[index] = asyncio.create_task(page.run(), name="page")
                if self._chromium is not None and loop.time() - loaded_s > _RELOAD_S:
                    loaded_s = loop.time()
                    await self._load_again(self._chromium)

    async def _load_again(self, chromium: ChromiumPages) -> None:
        from playwright.async_api import Error  # noqa: PLC0415 - only where it is wanted

        try:
            async with self._loading, Within(ANSWER_S):
                await chromium.close()
                await chromium.open()
            self.reloads += 1
        except (Error, TimeoutError) as err:
            print(f"not loaded again: {err}", file=sys.stderr, flush=True)

    async def _browser(self, rule: str) -> Browser:
        if rule not in self._browsers:
            from playwright.async_api import async_playwright  # noqa: PLC0415 - only where it is wanted

            if self._started is None:
                self._started = await async_playwright().start()
            flags = [*_FLAGS, *filter(None, [rule])]
            self._browsers[rule] = await self._started.chromium.launch(
                executable_path=system_browser(), args=flags
            )
        return self._browsers[rule]

    async def _close(self) -> None:
        leaving = [*self._pages, *filter(None, [self._churning])]
        for task in leaving:
            task.cancel()
        if leaving:
            await asyncio.wait(leaving, timeout=ANSWER_S)
        self._pages, self._churning = [], None
        if self._chromium is not None:
            await self._chromium.close()
            self._chromium = None
        if self._line is not None:
            self._line.close()
            self._line = None

    async def _told(self) -> dict[str, Any]:
        """`churning`: pages come and go still, or none were to."""
        return {
            "plain": self._plain.told(),
            "chromium": None if self._chromium is None else await self._chromium.told(),
            "stalled_again": self._stalled.closed,
            "phase": self._plain.phase,
            "browsers": self._plain.browsers,
            "reloads": self.reloads,
            "churning": self._churning is None or not self._churning.done(),
        }


def _note(ages: list[float], age_ms: float) -> None:
    if len(ages) < _MOST_AGES:
        ages.append(age_ms)


async def _lines() -> AsyncIterator[bytes]:
    reader = asyncio.StreamReader()
    await asyncio.get_running_loop().connect_read_pipe(
        lambda: asyncio.StreamReaderProtocol(reader), sys.stdin
    )
    async for line in reader:
        yield line


async def _serve() -> None:
    crowd = Crowd()
    async for line in _lines():
        try:
            answer = await crowd.do(json.loads(line))
        except Exception as err:  # noqa: BLE001 - whoever asked is told, and ends this
            answer = {"error": f"{type(err).__name__}: {err}"}
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    asyncio.run(_serve())
