"""The processes of `tools.bench_station`: a flight, a station, the pages; none of them outlives it."""

from __future__ import annotations

import contextlib
import json
import os
import re
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

from flightd.core.topics import Topic
from flightd.replay.log import FlightLog, read_log
from tools.measure_daemon import family_of

ROOT = Path(__file__).parents[1]
_T = TypeVar("_T")
_DRONE = "demo"
_PLAIN, _STALLED, _CHROMIUM = 13, 5, 2
_ANSWER_S = 150.0
"""Longer than the crowd itself waits for anything."""
_READY_S = 60.0
_ENDING_S = 10.0
_LOOK_S = 0.5


class Started:
    """A process of ours with all that it starts; `end` leaves none of them."""

    def __init__(self, words: Sequence[str], log: Path, nice: int = 0, **streams: Any) -> None:
        prefix = ["nice", "-n", str(nice)] if nice else []
        self._log = log.open("w")
        streams = {"stdout": self._log, "stderr": self._log, **streams}
        self.process: subprocess.Popen[str] = subprocess.Popen(  # noqa: S603
            [*prefix, *words], cwd=ROOT, text=True, start_new_session=True, **streams
        )

    @property
    def pids(self) -> list[int]:
        """Its own, and those of all that descend from it."""
        return family_of(self.process.pid)

    def pin(self, core: int, pids: Sequence[int] | None = None) -> None:
        for pid in self.pids if pids is None else pids:
            with contextlib.suppress(OSError):
                for thread in Path(f"/proc/{pid}/task").iterdir():
                    os.sched_setaffinity(int(thread.name), {core})

    def renice(self, nice: int) -> None:
        """All of them: a browser gives its own processes what it likes."""
        for pid in self.pids:
            with contextlib.suppress(OSError):
                for thread in Path(f"/proc/{pid}/task").iterdir():
                    os.setpriority(os.PRIO_PROCESS, int(thread.name), nice)

    def end(self, number: signal.Signals = signal.SIGKILL) -> None:
        """At once, or so that it may end in order first; within a bound in any case."""
        pids = self.pids
        if number is not signal.SIGKILL and self.process.poll() is None:
            self.process.send_signal(number)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(_ENDING_S)
        for pid in pids:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(_ENDING_S)
        self._log.close()


class CrowdProcess(Started):
    """The pages; `say` gives an order and returns what they have seen.  TimeoutError where none answers."""

    def __init__(self, folder: Path, nice: int) -> None:
        words = [sys.executable, "-m", "tools.station_crowd"]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        super().__init__(words, folder / "crowd.log", nice, **pipes)
        self._nice = nice

    def say(self, do: str, **order: Any) -> dict[str, Any]:
        sink, source = self.process.stdin, self.process.stdout
        assert sink is not None
        assert source is not None
        sink.write(json.dumps({"do": do, **order}) + "\n")
        sink.flush()
        if not select.select([source], [], [], _ANSWER_S)[0]:
            raise TimeoutError(f"the pages do not answer to {do}")
        answer: dict[str, Any] = json.loads(source.readline() or '{"error": "the pages have ended"}')
        if "error" in answer:
            raise RuntimeError(f"{do}: {answer['error']}")
        return answer

    def open(self, url: str, **more: Any) -> None:
        """These pages, in place of those before."""
        self.say("open", url=url, **more)
        self.renice(self._nice)

    def open_all(self, url: str, **more: Any) -> None:
        self.open(url, plain=_PLAIN, stalled=_STALLED, chromium=_CHROMIUM, **more)


class Station(Started):
    """`flightd ground` with one drone, at any free port."""

    def __init__(self, folder: Path, ports: Sequence[int], nice: int) -> None:
        words = [sys.executable, "-m", "flightd", "ground", "--listen", "127.0.0.1:0"]
        words += ["--drone", f"{_DRONE}=127.0.0.1:{ports[0]}/{ports[1]}", "--state", str(folder / "state")]
        self._said = folder / "station.log"
        super().__init__(words, self._said, nice)
        found = until(lambda: re.search(r"http://[0-9.]+:\d+", self._said.read_text()), _READY_S)
        assert found is not None
        self.url = found.group()

    @property
    def rss_mb(self) -> float:
        """Resident set of the station's processes together."""
        pages = 0
        for pid in self.pids:
            with contextlib.suppress(OSError):
                pages += int(Path(f"/proc/{pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


class SimulatedFlight(Started):
    """`flightd sim` by the clock, with a ground link."""

    def __init__(self, folder: Path, ports: Sequence[int], nice: int, *settings: str) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        settings = (
            "ground.listen=127.0.0.1", f"ground.status_port={ports[0]}", f"ground.command_port={ports[1]}",
            "ground.picture_fps=5", *settings,
        )  # fmt: skip
        words = [sys.executable, "-m", "flightd", "sim", "--speed", "1", "--json", "--out", str(folder)]
        words += [word for setting in settings for word in ("--set", setting)]
        self._summary = (folder / "summary.out").open("w+")
        super().__init__(words, folder / "sim.log", nice, stdout=self._summary)

    def over(self, patience_s: float) -> tuple[FlightLog, dict[str, Any]]:
        """Its log and summary, once it is over, or was ended because it flew for longer."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(patience_s)
        self.end(signal.SIGINT)
        self._summary.seek(0)
        text = self._summary.read()
        self._summary.close()
        log = read_log(self.folder / "flight.mcap", {Topic.SETPOINT, Topic.EVENT, Topic.STATUS})
        return log, json.loads(text) if text.startswith("{") else {}


def until(condition: Callable[[], _T], within_s: float) -> _T:
    """What the condition gives once that is true.  TimeoutError where it does not become so."""
    end_s = time.monotonic() + within_s
    while not (found := condition()):
        if time.monotonic() > end_s:
            raise TimeoutError(f"not within {within_s:.0f} s")
        time.sleep(_LOOK_S)
    return found


@contextlib.contextmanager
def ending() -> Iterator[Any]:
    """What is handed to `started` is ended in the end, newest first."""
    with contextlib.ExitStack() as stack:

        def started(one: Any) -> Any:
            stack.callback(one.end)
            return one

        yield started
