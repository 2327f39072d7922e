"""The daemon's numbers as Prometheus metrics, named after Prometheus' own rules: base units, `_total`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, Info
from prometheus_client.core import CounterMetricFamily
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector

from flightd import __version__
from flightd.core.snapshot import Snapshot
from flightd.core.types import Event, Phase

_STAGE_S = (0.001, 0.002, 0.005, 0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.08, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0)
_LATE_S = (0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5)


class MetricsBook:
    """`ports.Monitor` that keeps the numbers; a scrape reads `registry`, from a thread of its own."""

    def __init__(self) -> None:
        registry = self.registry = CollectorRegistry(auto_describe=False)
        Info("flightd", "version of the daemon", registry=registry).info({"version": __version__})
        self._stages = Histogram(
            "flightd_stage_seconds",
            "time of each stage of a frame, mid-exposure to the setpoint on the wire",
            ["stage"],
            buckets=_STAGE_S,
            registry=registry,
        )
        self._late = Histogram(
            "flightd_tick_late_seconds",
            "how late a control tick came",
            buckets=_LATE_S,
            registry=registry,
        )
        self._phase = Gauge(
            "flightd_phase", "1 for the phase the mission is in, else 0", ["phase"], registry=registry
        )
        self._events = Counter("flightd_events", "events", ["level", "name"], registry=registry)
        self._gauges = {
            name: Gauge(f"flightd_{name}", text, registry=registry)
            for name, text in (
                ("armed", "1 while the motors may turn"),
                ("in_control", "1 while the vehicle obeys flightd"),
                ("battery_ratio", "charge, 0 to 1"),
                ("battery_volts", "of the battery"),
                ("height_meters", "above the floor"),
                ("frames_per_second", "frames used in the last second"),
                ("nodes_done", "planned nodes visited"),
                ("nodes_planned", "nodes of the plan"),
                ("telemetry_age_seconds", "age of the newest attitude"),
                ("heartbeat_age_seconds", "age of the vehicle's newest heartbeat"),
                ("ground_silent_seconds", "since an attending ground station was heard; 0: none attends"),
            )
        }
        self._counts = _Counts()
        registry.register(self._counts)

    def tell(self, snapshot: Snapshot) -> None:
        for late_s in snapshot.tick_late_s:
            self._late.observe(max(late_s, 0.0))
        for stages in snapshot.latencies_ms:
            for stage, ms in stages.items():
                self._stages.labels(stage).observe(ms * 1e-3)
        for phase in Phase:
            self._phase.labels(phase.value).set(phase is snapshot.phase)
        self._counts.take(snapshot)
        values = {
            "height_meters": snapshot.height_m,
            "frames_per_second": snapshot.fps,
            "nodes_done": snapshot.nodes_done,
            "nodes_planned": snapshot.nodes_planned,
            "ground_silent_seconds": snapshot.ground_silent_s,
        }
        if (vehicle := snapshot.vehicle) is not None:
            values |= {
                "armed": vehicle.armed,
                "in_control": vehicle.in_control,
                "battery_ratio": vehicle.battery_frac,
                "battery_volts": vehicle.battery_v,
                "telemetry_age_seconds": (snapshot.stamp_ns - vehicle.attitude.stamp_ns) * 1e-9,
                "heartbeat_age_seconds": (snapshot.stamp_ns - vehicle.heartbeat_ns) * 1e-9,
            }
        for name, value in values.items():
            self._gauges[name].set(value if math.isfinite(value) else math.nan)

    def event(self, event: Event) -> None:
        self._events.labels(event.level.value, event.name).inc()

    def over(self) -> None:
        """The newest values stay."""


class _Counts(Collector):
    """Counters that are kept elsewhere and only passed on."""

    def __init__(self) -> None:
        self._newest: Snapshot | None = None

    def take(self, snapshot: Snapshot) -> None:
        self._newest = snapshot

    def collect(self) -> Iterable[Metric]:
        snapshot = self._newest
        if snapshot is None:
            return
        yield _counter("flightd_frames", "frames delivered by the camera", {"": snapshot.frames}, "")
        yield _counter("flightd_dropped", "what a queue or a lost worker cost", snapshot.dropped, "queue")
        yield _counter("flightd_restarts", "processes that died and were replaced", snapshot.restarts, "part")
        text = "setpoints level and straight because no tick made one"
        yield _counter("flightd_repeated_level", text, {"": snapshot.repeated_level}, "")


def _counter(name: str, text: str, values: Mapping[str, float], label: str) -> Metric:
    family = CounterMetricFamily(name, text, labels=[label] if label else None)
    for key, value in values.items():
        family.add_metric([key] if label else [], value)
    return family
