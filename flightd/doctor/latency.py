"""Are setpoints made soon enough after the exposure of what they are made from?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flightd.adapters.store.learnt_sensors import load_learnt
from flightd.config.schema import Config
from flightd.core.errors import InputError
from flightd.core.learnt import estimate_of
from flightd.core.tick import CLOSEST_TICKS_S
from flightd.doctor.camera import Pictures, look
from flightd.doctor.check import Check, error, ok, warning
from flightd.tracking.delay_by_tilt import DelayByTilt
from flightd.vision.line_detector import Detector

NAME = "latency"
_NEAR = 0.8
"""Of the latency that is allowed: what is measured here is not the slowest picture of a flight."""


@dataclass(frozen=True, slots=True)
class Stages:
    """What was measured: by how much the slowest picture came later than `camera.latency_s` has it, and how
    long the detector usually looks, s."""

    late_s: float
    detector_s: float


@dataclass(frozen=True, slots=True)
class KnownDelay:
    """The camera's delay from mid-exposure to arrival, s, and how it is known."""

    delay_s: float
    source: str


def measure_stages(config: Config, detector: Detector, found: Pictures) -> Stages | None:
    """None without a picture.  A stamp is the arrival less what is configured, so pictures alone tell no
    more of the camera's delay than how it changes."""
    if found.picture is None or not found.delays_s:
        return None
    detector_s, _ = look(detector, found.picture)
    return Stages(max(found.delays_s) - config.camera.latency_s, detector_s)


def delay_before_a_flight(config: Config) -> KnownDelay:
    """As the last flights have learnt it, where that is kept; else as configured."""
    configured_s = config.camera.latency_s
    try:
        learnt = load_learnt(config.tracking.learnt, config) if config.tracking.learnt else None
    except InputError:  # the line of what was learnt says so
        learnt = None
    if learnt is None:
        return KnownDelay(configured_s, "as camera.latency_s has it, unmeasured: --rock 20 measures it")
    seen = estimate_of(learnt)
    source = f"as learnt in flight, sigma {seen.delay_sigma_s * 1e3:.0f}: --rock 20 measures it"
    return KnownDelay(configured_s - seen.delay_s, source)


def delay_as_measured(config: Config, told: DelayByTilt) -> KnownDelay:
    """As rocking the drone told it."""
    source = f"as measured by rocking it, sigma {told.sigma_s * 1e3:.1f}"
    return KnownDelay(config.camera.latency_s - told.delay_s, source)


def judge_latency(config: Config, stages: Stages, known: KnownDelay) -> Check:
    """The whole way from exposure to setpoint, as far as it is known on the ground."""
    most_s, camera_s = config.hazards.latency_s, max(known.delay_s + stages.late_s, 0.0)
    whole_s = camera_s + stages.detector_s + CLOSEST_TICKS_S
    text = (
        f"{whole_s * 1000:.0f} ms from exposure to setpoint: camera {camera_s * 1000:.0f} ({known.source}),"
        f" detector {stages.detector_s * 1000:.0f}, up to {CLOSEST_TICKS_S * 1000:.0f} until the next tick;"
        " what other work on this computer, the tick itself and the line to the vehicle take is not in it"
    )
    remedy = (
        f"hazards.latency_s allows {most_s * 1000:.0f} ms: a camera with less delay (camera.latency_s is its"
        " share), smaller pictures, a faster computer"
    )
    if whole_s > most_s:
        return error(NAME, text, remedy)
    return warning(NAME, text, remedy) if whole_s > _NEAR * most_s else ok(NAME, text)


def with_latency(checks: Sequence[Check], latency: Check) -> list[Check]:
    """The checks with this one in the place of what was said of it before."""
    return [latency if check.name == NAME else check for check in checks]
