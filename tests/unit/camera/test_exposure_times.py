"""Exposures of a live source by what its driver says, or by arrival where it says nothing."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.adapters.camera.exposure_times import ExposureTimes, TimeSource

MS = 1_000_000
INTERVAL = 33 * MS
DELAY = 20 * MS
WARM_UP = 20
EPOCH = 10**18
"""The driver's clock is of its own."""


def times_of(arrivals: list[int], device: list[int | None]) -> tuple[ExposureTimes, list[int | None]]:
    times = ExposureTimes(latency_ns=DELAY, interval_ns=INTERVAL)
    return times, [times.of(told, arrival) for told, arrival in zip(device, arrivals, strict=True)]


def stalled(arrivals: list[int], at: int, for_frames: int) -> list[int]:
    """Nobody reads meanwhile, then all that waited is read at once."""
    until = arrivals[at + for_frames] - MS
    return [max(arrival, until + MS * (n - at)) if n >= at else arrival for n, arrival in enumerate(arrivals)]


def test_frames_that_waited_are_told_by_the_driver_when_they_were_exposed() -> None:
    exposed = [n * INTERVAL for n in range(60)]
    arrivals = stalled([at + DELAY for at in exposed], 30, 12)
    times, stamps = times_of(arrivals, [at + EPOCH for at in exposed])
    assert times.source is TimeSource.DEVICE
    assert None not in stamps[WARM_UP:]
    assert stamps[WARM_UP:] == pytest.approx(exposed[WARM_UP:], abs=0.2 * MS)


@given(delays=st.lists(st.integers(0, 200), min_size=40, max_size=80))
def test_what_the_reading_is_late_by_does_not_show(delays: list[int]) -> None:
    exposed = [n * INTERVAL for n in range(WARM_UP + len(delays))]
    late = [0] * WARM_UP + delays
    arrivals = [at + DELAY + delay * MS for at, delay in zip(exposed, late, strict=True)]
    _, stamps = times_of(arrivals, [at + EPOCH for at in exposed])
    known = [(at, stamp) for at, stamp in zip(exposed, stamps, strict=True) if stamp is not None]
    assert len(known) >= len(delays)
    assert all(abs(stamp - at) < MS for at, stamp in known)


def test_what_waited_before_a_stream_was_opened_is_not_delivered() -> None:
    """Two seconds come at once, then the stream is live."""
    exposed = [n * INTERVAL for n in range(100)]
    opened = 60 * INTERVAL
    arrivals = [max(at + DELAY, opened + n * MS) for n, at in enumerate(exposed)]
    _, stamps = times_of(arrivals, [at + EPOCH for at in exposed])
    assert set(stamps[:60]) == {None}
    known = [(at, stamp) for at, stamp in zip(exposed, stamps, strict=True) if stamp is not None]
    assert len(known) >= 25
    assert all(abs(stamp - at) < MS for at, stamp in known)


def test_what_waited_before_a_stream_was_opened_again_is_not_delivered_either() -> None:
    """Its device counts anew, and a second comes at once."""
    first = [n * INTERVAL for n in range(60)]
    gap = 60 * INTERVAL
    again = [first[-1] + gap + n * INTERVAL for n in range(80)]
    opened = again[30]
    arrivals = [at + DELAY for at in first] + [max(at + DELAY, opened + n * MS) for n, at in enumerate(again)]
    device = [at + EPOCH for at in first] + [at - again[0] for at in again]
    _, stamps = times_of(arrivals, list(device))
    delivered = [(at, stamp) for at, stamp in zip(again, stamps[60:], strict=True) if stamp is not None]
    assert len(delivered) >= 25
    assert all(abs(stamp - at) < MS for at, stamp in delivered)


@pytest.mark.parametrize("told", [None, 0, 7])
def test_without_the_drivers_time_frames_that_may_have_waited_are_refused(told: int | None) -> None:
    exposed = [n * INTERVAL for n in range(60)]
    arrivals = stalled([at + DELAY for at in exposed], 30, 12)
    times, stamps = times_of(arrivals, [told] * 60)
    assert times.source is TimeSource.ARRIVAL
    known = [(at, stamp) for at, stamp in zip(exposed, stamps, strict=True) if stamp is not None]
    assert all(abs(stamp - at) < MS for at, stamp in known)
    assert all(a < b for (_, a), (_, b) in pairwise(known))
    assert len(known) >= 40


def test_a_camera_slower_than_configured_is_believed_after_some_frames() -> None:
    arrivals = [n * 3 * INTERVAL for n in range(40)]
    _, stamps = times_of(arrivals, [None] * 40)
    assert stamps[20:] == [arrival - DELAY for arrival in arrivals[20:]]
