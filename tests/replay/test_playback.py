"""A recorded flight as it is played back, and what a first glance at its log tells."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from flightd.adapters.recorder.mcap_file import CHUNK_BYTES
from flightd.adapters.recorder.recorder import McapRecorder, wait_for_disk
from flightd.core.errors import InputError
from flightd.core.flight_order import ChosenPlan, FlightOrder
from flightd.core.tick import TickOutput
from flightd.core.topics import Document, RecordedFrame, Topic
from flightd.core.tracks import TrackedLine, TrackSet
from flightd.core.types import Demand, Event, EventLevel, GridPose, Phase, Status, VehicleState
from flightd.replay.log import read_log
from flightd.replay.log_skim import skim
from flightd.replay.playback.flight import Leg, Playback
from flightd.replay.playback.legs import legs_of
from flightd.replay.playback.loader import load_playback
from flightd.replay.playback.pictures import find_pictures, read_picture
from flightd.replay.playback.seen_floor import seen_floor
from flightd.replay.report.loader import load_flight
from flightd.site.site_file import parse_site
from tests.replay.synthetic_flight import HEIGHT_M, NS, SITE_TOML, START_NS, write_flight

SITE = parse_site(SITE_TOML, "demo")


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_flight(tmp_path_factory.mktemp("flight"))


@pytest.fixture(scope="module")
def played(log: Path) -> Playback:
    return load_playback(log)


def column(played: Playback, name: str) -> np.ndarray[tuple[int], np.dtype[np.float32]]:
    return played.columns[name][np.isfinite(played.columns[name])]


def test_every_quantity_is_that_of_the_log(played: Playback, log: Path) -> None:
    assert float(np.median(column(played, "height_m"))) == pytest.approx(HEIGHT_M, abs=0.03)
    assert float(column(played, "battery_frac").max()) == pytest.approx(1.0)
    attitudes = [state.attitude for state in read_log(log, {Topic.VEHICLE}).messages(VehicleState)]
    tilt = max(math.hypot(one.roll_rad, one.pitch_rad) for one in attitudes)
    assert float(column(played, "tilt_rad").max()) == pytest.approx(tilt, rel=1e-4)
    totals = [status.latency_ms["total"] for status in read_log(log, {Topic.STATUS}).messages(Status)]
    assert float(column(played, "latency_s").max()) == pytest.approx(max(totals) / 1000, rel=1e-4)


def test_the_estimate_is_beside_the_line_as_far_as_the_truth_but_for_its_noise(played: Playback) -> None:
    own, true = (played.columns[name] for name in ("cross_track_m", "true_cross_track_m"))
    both = np.isfinite(own) & np.isfinite(true)
    assert both.sum() > 1000
    assert float(np.abs(own[both] - true[both]).max()) < 0.05, "6 mm of noise"
    assert 0.0 < played.estimated["cross_track_rms_m"] < 0.2
    assert 0.0 < played.estimated["hover_error_p95_m"] < 0.2


def test_beside_the_line_is_told_while_it_is_followed_only(played: Playback) -> None:
    times = played.grid.times_s()
    follows = np.zeros(times.shape, bool)
    for moment, after in zip(played.moments, played.moments[1:], strict=False):
        if moment.phase is Phase.FOLLOW:
            follows |= (times >= moment.t_s - 0.1) & (times <= after.t_s + 0.1)
    assert np.isnan(played.columns["cross_track_m"][~follows]).all()


def test_moments_begin_with_the_flight_and_end_with_its_last_phase(played: Playback) -> None:
    assert (played.moments[0].t_s, played.moments[0].phase) == (0.0, Phase.PREFLIGHT)
    assert played.moments[-1].phase is Phase.DONE
    assert played.duration_s > played.moments[-1].t_s
    assert [one.t_s for one in played.moments] == sorted(one.t_s for one in played.moments)


def test_a_log_that_was_cut_off_is_played_as_far_as_it_goes(
    log: Path, tmp_path: Path, played: Playback
) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(log.read_bytes()[: log.stat().st_size // 2])
    half = load_playback(cut)
    assert "cut off" in half.damage
    assert 10 < half.duration_s < played.duration_s - 5
    assert half.truth is None, "none lies beside it under that name"
    glance = skim(cut)
    assert not glance.whole
    assert glance.last_status is not None
    assert glance.duration_s == pytest.approx(half.duration_s, abs=1.0)


def test_a_glance_tells_what_reading_all_of_it_tells(log: Path, played: Playback) -> None:
    glance = skim(log)
    assert (glance.whole, glance.site, glance.metadata["vehicle"]) == (True, "demo", "ardupilot")
    assert glance.last_status == read_log(log, {Topic.STATUS}).messages(Status)[-1]
    assert glance.duration_s == pytest.approx(played.duration_s)


def test_a_plan_that_was_chosen_before_the_start_is_what_the_flight_was_to_visit(tmp_path: Path) -> None:
    log = tmp_path / "flight.mcap"
    waits = Event(START_NS, EventLevel.INFO, "wait", "." * CHUNK_BYTES)
    with McapRecorder(log, when_full=wait_for_disk) as recorder:
        recorder.record(Topic.ORDER, START_NS, FlightOrder(pad="home"))
        for chunk in range(12):  # a glance looks at the first of them, and for the status at the last
            recorder.record(Topic.EVENT, START_NS + chunk * NS, waits)
            if chunk in {5, 7}:
                nodes = ("A2", "B1") if chunk == 7 else ("A1",)
                recorder.record(Topic.PLAN, START_NS + chunk * NS, ChosenPlan(f"plan-{chunk}", nodes, (1,)))
    assert skim(log).order == FlightOrder(nodes=("A2", "B1"), pad="home")
    assert load_flight(log).nodes == {"A2", "B1"}
    assert [leg.via for leg in load_playback(log).legs] == [("A2",), ("B1",)]


def test_a_plan_taken_back_leaves_the_order(tmp_path: Path) -> None:
    log = tmp_path / "flight.mcap"
    with McapRecorder(log) as recorder:
        recorder.record(Topic.ORDER, START_NS, FlightOrder(nodes=("A3",)))
        recorder.record(Topic.PLAN, START_NS + 1, ChosenPlan("plan-1", ("A1",)))
        recorder.record(Topic.PLAN, START_NS + 2, ChosenPlan(""))
    order = skim(log).order
    assert order is not None
    assert order.nodes == ("A3",)
    assert load_flight(log).nodes == {"A3"}


@pytest.mark.parametrize("content", [b"", b"no flight log at all"])
def test_what_is_no_log_is_refused_in_a_line(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "odd.mcap"
    path.write_bytes(content)
    for read in (skim, load_playback, find_pictures):
        with pytest.raises(InputError, match=r"\A[^\n]+\Z"):
            read(path)


def test_a_log_of_nonsense_holds_nothing(tmp_path: Path) -> None:
    path = tmp_path / "odd.mcap"
    path.write_bytes(b"\x89MCAP0\r\n" + bytes(range(256)) * 40)
    assert skim(path).last_status is None
    assert load_playback(path).moments == ()
    assert find_pictures(path) == ()


def test_pictures_are_those_of_the_log_with_the_lines_of_their_frames(log: Path) -> None:
    recorded = read_log(log, {Topic.FRAME}).messages(RecordedFrame)
    places = find_pictures(log)
    assert [place.seq for place in places] == [frame.seq for frame in recorded]
    for place, frame in list(zip(places, recorded, strict=True))[::7]:
        picture = read_picture(log, place, None)
        assert (picture.seq, picture.stamp_ns, picture.jpeg) == (frame.seq, frame.stamp_ns, frame.jpeg)
        assert picture.lines, "the aisle's line is in each"
        assert all(-2 < at < 3 for line in picture.lines for point in line.points for at in point)


def test_a_picture_that_is_there_no_more_is_refused(log: Path, tmp_path: Path) -> None:
    place = find_pictures(log)[-1]
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(log.read_bytes()[: place.frame_at[0]])
    with pytest.raises(InputError):
        read_picture(cut, place, None)


def test_the_way_leads_from_goal_to_goal_and_to_those_that_were_never_reached() -> None:
    told = [(0.0, "A2"), (1.0, "A2"), (2.0, "A4"), (5.0, "B6")]
    found = legs_of(SITE, told, ("A2", "A4", "B6", "B5"))
    assert [leg.t_s for leg in found] == [0.0, 2.0, 5.0, None]
    assert found[1].via == ("A3", "A4")
    assert found[2].via == ("A5", "A6", "B6")
    assert found[3] == Leg(None, ("B5",))


def test_a_goal_that_the_map_does_not_have_is_named_all_the_same() -> None:
    told = [(0.0, "A2"), (1.0, "Z9")]
    assert legs_of(SITE, told)[1].via == ("Z9",)
    assert legs_of(None, told)[1].via == ("Z9",)


def decision(stamp_ns: int, seen_ns: int) -> TickOutput:
    pose = GridPose(stamp_ns, "A1", 0.0, 0.0, 0.0, 2.0, 0.5, 0.0, 0.0, 1.5, (0.01,) * 9, 1.0)
    along = TrackedLine(1, -0.5, 0.01, 0.07, seen_ns, 9, -1.0, 1.5)
    across = TrackedLine(2, 1.0, 0.01, 0.07, stamp_ns, 9)
    tracks = TrackSet(stamp_ns, stamp_ns, 0.0, 0.01, 0.0, 0.0, 0.0, 0.0, (across,), (along,))
    return TickOutput(None, Demand.STANDBY, Phase.FOLLOW, "", "A2", 0, 1, pose, tracks)


def test_seen_lines_lie_on_the_map_where_the_drone_took_them_to_be(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    with McapRecorder(path, when_full=wait_for_disk) as recorder:
        for tick in range(100):
            stamp_ns = START_NS + tick * NS // 50
            seen_ns = stamp_ns if tick < 50 else START_NS
            recorder.record(Topic.DECISION, stamp_ns, decision(stamp_ns, seen_ns))
    seen = seen_floor(path, START_NS, 2.0)
    assert len(seen) == pytest.approx(10, abs=1), "five a second are enough"
    assert seen[0].lines[0] == pytest.approx((1.0, 0.0, 3.5, 0.0))
    assert seen[0].lines[1][0] == seen[0].lines[1][2] == pytest.approx(3.0)
    assert len(seen[-1].lines) == 1, "the other one was not seen for a second"


def test_numbers_that_are_none_and_maps_that_are_none_do_not_stop_it(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    with McapRecorder(path, when_full=wait_for_disk) as recorder:
        recorder.record(Topic.MAP, START_NS, Document("[site]\nname = 7\n"))
        recorder.record(Topic.CONFIG, START_NS, Document("{"))
        for tick in range(5):
            stamp_ns = START_NS + (5 - tick) * NS
            wild = GridPose(
                stamp_ns, "", math.nan, 0.0, math.inf, math.nan, 1.0, math.nan, 0.0, 0.0, (), math.nan
            )
            recorder.record(Topic.POSE, stamp_ns, wild)
    played = load_playback(path)
    assert played.site is None
    assert played.map_error
    assert len(played.track.t_s) == 0
    assert skim(path).site == ""
