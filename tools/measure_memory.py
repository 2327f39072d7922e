"""Whether the memory of what flies and records stays flat over a simulated hour.

Mission after mission in one process, by ideal sight: the pilot (tracks, localisation, mission, control),
the black box, the metrics and the latency book, each fed at every tick as the daemon does.  Printed: the
resident set after the first missions and at the end.

python -m tools.measure_memory [--seconds 3600]
"""

from __future__ import annotations

import argparse
import gc
import json
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

from flightd.adapters.metrics.metrics import MetricsBook
from flightd.adapters.recorder.recorder import McapRecorder, wait_for_disk
from flightd.app.build import pilot_of
from flightd.app.detection.detector_pool import Detection
from flightd.app.detection.latency import LatencyBook
from flightd.config.schema import load_config
from flightd.core.snapshot import Snapshot
from flightd.core.tick import TickInput, TickOutput
from flightd.core.topics import Topic
from flightd.core.types import LineSet
from flightd.runtime.frame_ring import FrameTicket
from flightd.site.site_file import load_site
from tests.sim.ideal.ideal_flight import IdealFlight

ROOT = Path(__file__).parents[1]
Step: TypeAlias = Callable[[TickInput], TickOutput]
WARM_UP_S = 400.0
"""Libraries and allocators take their share in the first missions."""


class Watched:
    """A pilot's step with all that the daemon does around it."""

    def __init__(self, recorder: McapRecorder, book: MetricsBook, latency: LatencyBook) -> None:
        self._recorder, self._book, self._latency = recorder, book, latency
        self.ticks = 0

    def around(self, step: Step) -> Step:
        """The step of one mission's pilot, with the rest of the daemon around it."""
        return lambda tick: self._watch(tick, step(tick))

    def _watch(self, tick: TickInput, output: TickOutput) -> TickOutput:
        self.ticks += 1
        for lines in tick.lines:
            self._latency.taken(_detection(lines), tick.now_ns)
            self._recorder.record(Topic.LINES, lines.stamp_ns, lines)
        if output.setpoint is not None:
            self._latency.sent(tick.now_ns)
        self._recorder.record(Topic.TICK, tick.now_ns, tick)
        self._recorder.record(Topic.DECISION, tick.now_ns, output)
        if self.ticks % 5 == 0:
            latencies_ms = self._latency.drain()
            self._book.tell(
                Snapshot(tick, output, fps=30.0, tick_late_s=(0.001,) * 5, latencies_ms=latencies_ms)
            )
        return output


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--seconds", type=float, default=3600.0, help="simulated time")
    options = parser.parse_args()
    config = load_config(ROOT / "configs" / "sim.toml")
    site = load_site(ROOT / "configs" / "site-demo.toml")
    flown_s, missions, first_mb = 0.0, 0, 0.0
    with (
        tempfile.TemporaryDirectory() as folder,
        McapRecorder(Path(folder) / "f.mcap", when_full=wait_for_disk) as recorder,
    ):
        watched = Watched(recorder, MetricsBook(), LatencyBook())
        while flown_s < options.seconds:
            missions += 1
            flight = IdealFlight(site, config, seed=missions)
            flight.pilot = pilot_of(config, site)
            flight.pilot.step = watched.around(flight.pilot.step)  # type: ignore[method-assign, assignment]
            flight.fly()
            flown_s = watched.ticks * 0.02
            del flight
            gc.collect()
            if not first_mb and flown_s > min(WARM_UP_S, options.seconds / 3):
                first_mb = rss_mb()
            print(json.dumps({"simulated_s": round(flown_s), "rss_mb": round(rss_mb(), 1)}), flush=True)
    growth = rss_mb() / first_mb - 1.0
    print(json.dumps({"missions": missions, "first_mb": round(first_mb, 1), "growth": round(growth, 4)}))


def rss_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def _detection(lines: LineSet) -> Detection:
    at_ns = lines.stamp_ns
    ticket = FrameTicket("flightd-0-0", 0, 8, lines.frame_seq, at_ns, at_ns + 60_000_000, 640, 360)
    return Detection(ticket, lines, at_ns + 60_000_000, at_ns + 68_000_000)


if __name__ == "__main__":
    main()
