"""How late what is flown by is, frames that were dropped on the way included."""

from __future__ import annotations

import gc

import pytest

from flightd.app.detection.detector_pool import Detection
from flightd.app.detection.latency import LatencyBook
from flightd.core.types import LineSet
from flightd.runtime.frame_ring import FrameTicket

FRAME_NS = 33_000_000
WAY_NS = 80_000_000


def fly(book: LatencyBook, seq: int, way_ns: int = WAY_NS, *, sends: bool = True) -> int:
    """Fly by frame `seq` of a steady camera, so long after its exposure."""
    stamp_ns = 1_000_000_000 + seq * FRAME_NS
    ticket = FrameTicket("ring", 0, 4, seq, stamp_ns, stamp_ns + 10_000_000, 64, 36)
    lines = LineSet(seq, stamp_ns, 64, 36, (), (), "combined", {})
    now_ns = stamp_ns + way_ns
    book.taken(Detection(ticket, lines, stamp_ns + 12_000_000, stamp_ns + 20_000_000), now_ns)
    if sends:
        book.sent(now_ns)
    return now_ns


def test_where_every_frame_is_flown_by_it_is_their_way() -> None:
    book = LatencyBook()
    for seq in range(20):
        now_ns = fly(book, seq)
    assert book.recent_p99_s(now_ns) == pytest.approx(WAY_NS * 1e-9)


def test_frames_that_were_dropped_count_until_the_one_that_overtook_them() -> None:
    book = LatencyBook()
    fly(book, 0)
    now_ns = fly(book, 10)
    assert book.recent_p99_s(now_ns) == pytest.approx((WAY_NS + 9 * FRAME_NS) * 1e-9)
    assert book.quantiles_ms()["p99"] == pytest.approx(WAY_NS * 1e-6), "that of the frames themselves"


def test_setpoints_that_are_made_and_never_sent_leave_nothing_behind() -> None:
    book = LatencyBook()
    for seq in range(1000):
        fly(book, seq, sends=False)
    kept = sum(type(one) is Detection for one in gc.get_objects())  # of proxies nothing is asked
    assert kept <= 2, "of the newest tick, and what came right before it"
    assert book.recent_p99_s(fly(book, 1010)) == pytest.approx(WAY_NS * 1e-9)


def test_a_time_without_set_points_is_no_delay() -> None:
    book = LatencyBook()
    fly(book, 0)
    book.forget()
    now_ns = fly(book, 2000)
    assert book.recent_p99_s(now_ns) == pytest.approx(WAY_NS * 1e-9)


def test_it_forgets_after_a_second() -> None:
    book = LatencyBook()
    now_ns = fly(book, 0)
    assert book.recent_p99_s(now_ns + 1_100_000_000) == 0.0


def test_a_camera_that_counts_anew_is_no_drop() -> None:
    book = LatencyBook()
    fly(book, 100)
    now_ns = fly(book, 3)
    assert book.recent_p99_s(now_ns) == pytest.approx(WAY_NS * 1e-9)


def test_the_cameras_own_delay_is_told_apart() -> None:
    book = LatencyBook()
    for seq in range(100):
        fly(book, seq, WAY_NS if seq % 10 else WAY_NS + 15_000_000)
    assert book.quantiles_ms() == {"p50": 80.0, "p99": 95.0}
    assert book.arrival_to_wire_ms() == {"p50": 70.0, "p99": 85.0}
