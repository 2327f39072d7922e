from __future__ import annotations

import base64
import itertools
import json
import math
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from flightd.adapters.recorder.recorder import McapRecorder
from flightd.core.errors import InputError, UnavailableError
from flightd.core.topics import Document, Topic
from flightd.core.tracks import NOT_SEEN, SensorEstimate
from flightd.core.types import Event, EventLevel, GridPose, Phase, Status
from flightd.replay.report.charts import ChartLine, ChartStrip
from flightd.replay.report.figures import key_figures, outcome
from flightd.replay.report.flight import RecordedFlight
from flightd.replay.report.loader import load_flight
from flightd.replay.report.markup import clock, number, path_data, thin, ticks
from flightd.replay.report.page import render, write_report
from flightd.site.site_file import parse_site
from tests.command import Command
from tests.replay.synthetic_flight import NS, SITE_TOML, SUMMARY, legs, write_flight

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A whole flight with truth and summary beside it."""
    return write_flight(tmp_path_factory.mktemp("flight"))


@pytest.fixture(scope="module")
def bare_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same flight as a drone brings it home: no truth, no summary."""
    return write_flight(tmp_path_factory.mktemp("bare"), truth=False, summary=False)


@pytest.fixture(scope="module")
def flight(log: Path) -> RecordedFlight:
    return load_flight(log)


@pytest.fixture(scope="module")
def page(flight: RecordedFlight) -> str:
    return render(flight)


class _Outline(HTMLParser):
    """Checks that every element is closed, and gathers what the page would load."""

    VOID = frozenset({"meta", "img", "br", "link", "input", "hr"})
    DRAWN = frozenset({"rect", "line", "path", "circle"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.loaded: list[str] = []
        self.text: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.loaded += [value or "" for name, value in attrs if name in {"src", "href", "srcset", "data"}]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.loaded += [value or "" for name, value in attrs if name in {"src", "href"}]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text.append(data)


def _outline(page: str) -> _Outline:
    outline = _Outline()
    outline.feed(page)
    assert outline.open == []
    return outline


def test_the_page_is_whole_and_loads_nothing_from_anywhere(page: str) -> None:
    outline = _outline(page)
    assert outline.loaded
    assert all(source.startswith("data:image/jpeg;base64,") for source in outline.loaded)
    without_pictures = re.sub(r"data:image/jpeg;base64,[\w+/=]+", "", page)
    assert not re.search(r"https?:|//[a-z]|@import|url\(|<link", without_pictures)


def test_the_page_shows_what_the_flight_was(page: str) -> None:
    for part in (
        "Mission completed",
        "demo",
        "Cross-track",
        "Height",
        "Battery",
        "p99",
        "gusts up to 1.9 m/s",
    ):
        assert part in page
    assert page.count('class="shot"') == 6
    assert page.count('class="alarm warning"') == 2
    assert 'class="centre vertical"' in page
    assert 'class="flown truth"' in page
    assert 'class="flown estimate"' in page


def test_every_stop_is_in_the_list_in_order(flight: RecordedFlight) -> None:
    planned = [leg.node for leg in legs(parse_site(SITE_TOML, "demo")) if leg.phase == Phase.HOVER]
    assert [visit.node for visit in flight.visits] == planned
    assert all(2.3 < visit.dwell_s < 2.7 for visit in flight.visits)
    assert all(visit.true_error_m < 0.15 for visit in flight.visits)


def test_a_stop_with_a_scan_is_one_visit_measured_while_it_hovers_over_the_node(tmp_path: Path) -> None:
    flight = load_flight(write_flight(tmp_path, summary=False, scans=True))
    planned = [leg.node for leg in legs(parse_site(SITE_TOML, "demo")) if leg.phase == Phase.HOVER]
    assert [visit.node for visit in flight.visits] == planned
    assert all(2.3 < visit.dwell_s < 2.7 for visit in flight.visits)
    assert all(visit.true_error_m < 0.15 for visit in flight.visits), "the view itself is 0.3 m aside"


def test_time_starts_with_the_flight_not_with_its_papers(flight: RecordedFlight) -> None:
    assert flight.phases[0].start_s == 0.0
    assert flight.duration_s == pytest.approx(flight.phases[-1].end_s, abs=0.05)


def test_phases_cover_the_flight_without_gaps(flight: RecordedFlight) -> None:
    phases = flight.phases
    assert phases[0].phase == Phase.PREFLIGHT
    assert phases[-1].phase == Phase.DONE
    assert all(a.end_s == b.start_s for a, b in itertools.pairwise(phases))


def test_the_summary_decides_the_key_figures(flight: RecordedFlight) -> None:
    figures = {figure.label: figure for figure in key_figures(flight)}
    assert figures["Cross-track"].value == "2.1"
    assert figures["Landing error"].value == "6.1"
    assert 0.5 < float(figures["Position error"].value) < 3.0  # the noise of the made-up estimate
    assert figures["Codes read"].tone == "good"
    assert (figures["Nodes visited"].value, figures["Nodes visited"].tone) == ("12", "good")


def test_what_was_found_wrong_with_the_sensors_is_told_with_its_sigmas(flight: RecordedFlight) -> None:
    seen = SensorEstimate(
        delay_s=-0.012,
        delay_sigma_s=0.003,
        mount_roll_rad=math.radians(1.0),
        mount_pitch_rad=math.radians(-0.5),
        mount_sigma_rad=math.radians(0.2),
        tilt_roll_rad=math.radians(0.7),
        tilt_pitch_rad=math.radians(-0.4),
        tilt_sigma_rad=math.radians(0.3),
        scale_share=0.02,
        scale_sigma=0.004,
        mount_yaw_rad=math.radians(2.0),
        mount_yaw_sigma_rad=math.radians(0.1),
        height_share=0.03,
        height_sigma=0.005,
    )
    told = {figure.label: figure for figure in key_figures(replace(flight, sensors=seen))}
    delay, tilt, height = told["Camera delay"], told["Tilt bias"], told["Height"]
    assert (delay.value, delay.note.partition(",")[0]) == ("+12", "± 3")
    assert "1 / -0.5° ± 0.2 off in roll and pitch, 2° ± 0.1 in yaw" in delay.note
    assert (tilt.value, tilt.note.partition(",")[0]) == ("0.7 / -0.4", "± 0.3")
    assert (height.value, height.note.partition(",")[0]) == ("+3.0", "± 0.5")
    assert "focal length -2 % ± 0.4 more than configured" in height.note
    before = {figure.label for figure in key_figures(replace(flight, sensors=NOT_SEEN))}
    assert before.isdisjoint({"Camera delay", "Tilt bias", "Height"})


def test_a_log_alone_makes_a_report_too(bare_log: Path) -> None:
    flight = load_flight(bare_log)
    page = render(flight)
    _outline(page)
    assert 'class="flown truth"' not in page
    figures = {figure.label: figure for figure in key_figures(flight)}
    assert "estimated" in figures["Cross-track"].note
    assert 0.5 < float(figures["Cross-track"].value) < 10
    assert "Landing error" not in figures
    assert "Position error" not in figures
    assert outcome(flight).headline == "Mission completed"


def test_an_aborted_mission_says_so_and_why(bare_log: Path) -> None:
    summary = bare_log.with_name("summary.json")
    summary.write_text(json.dumps(SUMMARY | {"mission": "aborted", "reason": "line lost for 5 s"}))
    try:
        ending = outcome(load_flight(bare_log))
    finally:
        summary.unlink()
    assert (ending.headline, ending.detail, ending.tone) == ("Mission aborted", "line lost for 5 s", "bad")


def test_an_empty_log_makes_a_page_that_says_so(tmp_path: Path) -> None:
    McapRecorder(tmp_path / "flight.mcap").close()
    page = render(load_flight(tmp_path / "flight.mcap"))
    _outline(page)
    assert "No flight in this log" in page


def test_a_log_of_one_status_makes_a_page(tmp_path: Path) -> None:
    status = Status(5, Phase.TAKE_OFF, "", "", "", 0, 3, 0.9, 0.1, 0, 0, 0.0, {})
    with McapRecorder(tmp_path / "flight.mcap") as recorder:
        recorder.record(Topic.STATUS, 5, status)
    flight = load_flight(tmp_path / "flight.mcap")
    _outline(render(flight))
    assert outcome(flight).detail == "the log ends in phase take off"


def test_a_log_cut_off_in_flight_makes_a_page_that_says_so(log: Path, tmp_path: Path) -> None:
    content = log.read_bytes()
    (tmp_path / "flight.mcap").write_bytes(content[: len(content) // 2])
    flight = load_flight(tmp_path / "flight.mcap")
    page = render(flight)
    _outline(page)
    assert "cut off" in page
    assert outcome(flight).tone == "open"


def test_hostile_text_stays_text(tmp_path: Path) -> None:
    attack = '</script><script>alert(1)</script><img src="x">'
    with McapRecorder(tmp_path / "flight.mcap", metadata={"vehicle": attack}) as recorder:
        recorder.record(Topic.EVENT, 1, Event(1, EventLevel.ERROR, attack, attack))
        recorder.record(Topic.CONFIG, 1, Document(attack))
    (tmp_path / "summary.json").write_text(
        json.dumps({"mission": "aborted", "reason": attack, attack: attack})
    )
    page = render(load_flight(tmp_path / "flight.mcap"))
    _outline(page)
    assert attack not in page
    assert page.count("<script>") == 1


def test_a_map_that_cannot_be_read_costs_the_map_alone(tmp_path: Path) -> None:
    with McapRecorder(tmp_path / "flight.mcap") as recorder:
        recorder.record(Topic.MAP, 1, Document("[site]\n"))
        recorder.record(Topic.EVENT, 1, Event(1, EventLevel.INFO, "armed", "armed"))
    page = render(load_flight(tmp_path / "flight.mcap"))
    assert "the recorded map: site.name: missing" in page
    assert "armed" in page


def test_a_picture_that_is_none_is_left_out(tmp_path: Path) -> None:
    with McapRecorder(tmp_path / "flight.mcap") as recorder:
        recorder.image(Topic.FRAME, 1, 1, b"this is no JPEG")
    page = render(load_flight(tmp_path / "flight.mcap"))
    assert base64.b64encode(b"this is no JPEG").decode() not in page


@pytest.mark.parametrize(
    ("goal", "x_m", "y_m", "expected_m"),
    [
        ("A2", (0.0, 1.0, 2.0), (0.1, 0.1, 0.1), 0.1),
        ("B1", (0.05, 0.05, 0.05), (0.6, 1.5, 2.4), 0.05),
        ("B3", (0.05, 0.05, 0.05), (0.6, 1.5, 2.4), 0.05),
        ("A4", (1.0, 1.5, 2.0), (3.0, 3.0, 3.0), 3.0),
    ],
    ids=["along", "across", "round a corner", "the wrong aisle"],
)
def test_cross_track_is_measured_from_the_way_that_is_flown(
    tmp_path: Path, goal: str, x_m: tuple[float, ...], y_m: tuple[float, ...], expected_m: float
) -> None:
    with McapRecorder(tmp_path / "flight.mcap") as recorder:
        recorder.record(Topic.MAP, 0, Document(SITE_TOML))
        for index, (x, y) in enumerate(zip(x_m, y_m, strict=True)):
            stamp_ns = index * 1_000_000_000
            status = Status(stamp_ns, Phase.FOLLOW, "", "A1", goal, 0, 1, 1.0, 1.0, 0, 0, 0.0, {})
            pose = GridPose(stamp_ns, "A1", x, y, 0.0, x, y, 0.0, 0.0, 1.0, (0.0,) * 9, 1.0)
            recorder.record(Topic.STATUS, stamp_ns, status)
            recorder.record(Topic.POSE, stamp_ns, pose)
    flight = load_flight(tmp_path / "flight.mcap")
    assert flight.cross_track_m(flight.estimate) == pytest.approx([expected_m] * 3)


def test_where_a_shelf_is_looked_at_from_is_no_cross_track(tmp_path: Path) -> None:
    """A view half a metre beside its node, between two legs."""
    phases = (Phase.FOLLOW, Phase.CLIMB, Phase.SCAN, Phase.FOLLOW)
    with McapRecorder(tmp_path / "flight.mcap") as recorder:
        recorder.record(Topic.MAP, 0, Document(SITE_TOML))
        for index, phase in enumerate(phases):
            stamp_ns, y_m = (index + 1) * NS, 0.1 if phase is Phase.FOLLOW else 0.5
            status = Status(stamp_ns, phase, "", "A1", "A2", 0, 1, 1.0, 1.0, 0, 0, 0.0, {})
            pose = GridPose(stamp_ns + 1, "A1", 1.5, y_m, 0.0, 1.5, y_m, 0.0, 0.0, 1.0, (0.0,) * 9, 1.0)
            recorder.record(Topic.STATUS, stamp_ns, status)
            recorder.record(Topic.POSE, stamp_ns + 1, pose)
        recorder.record(Topic.STATUS, 5 * NS, replace(status, stamp_ns=5 * NS))
    flight = load_flight(tmp_path / "flight.mcap")
    found = flight.cross_track_m(flight.estimate)
    assert found == pytest.approx([0.1, math.nan, math.nan, 0.1], nan_ok=True)


def test_thinning_keeps_every_peak() -> None:
    t_s = np.linspace(0, 100, 50_000)
    values = np.sin(t_s)
    values[12_345] = 40.0
    values[23_456] = -40.0
    thin_t, thin_values = thin(t_s, values)
    assert len(thin_t) <= 1_800
    assert thin_values.max() == 40.0
    assert thin_values.min() == -40.0
    assert (np.diff(thin_t) > 0).all()


def test_a_gap_lifts_the_pen() -> None:
    nan = float("nan")
    assert path_data([0, 1, 2, 3, 4], [1, 2, nan, 4, 5]) == "M0,1L1,2M3,4L4,5"


def test_ticks_are_round_and_inside() -> None:
    assert ticks(-1.3, 1.3, 4) == [-1.0, 0.0, 1.0]
    assert ticks(0.0, 1.62, 4) == [0.0, 0.5, 1.0, 1.5]
    assert ticks(3.0, 3.0, 4) == [3.0]


def test_numbers_are_short() -> None:
    assert [number(value) for value in (1.0, 0.125, -0.001, 1200.0)] == ["1", "0.12", "0", "1200"]
    assert [clock(value) for value in (0.0, 65.2, 3600.0)] == ["0:00", "1:05", "60:00"]


def test_a_strip_shows_all_of_its_values() -> None:
    line = ChartLine("x", "plain", np.arange(3.0), np.array([-0.5, float("nan"), 3.0]))
    for strip in (
        ChartStrip("a", "m", (line,)),
        ChartStrip("b", "m", (line,), symmetric=True),
        ChartStrip("c", "m", (line,), zero=True, least_span=10.0),
    ):
        low, high = strip.range()
        assert low <= -0.5
        assert high >= 3.0


def test_a_summary_that_is_no_json_is_told(tmp_path: Path) -> None:
    McapRecorder(tmp_path / "flight.mcap").close()
    (tmp_path / "summary.json").write_text("{")
    with pytest.raises(InputError, match=r"summary\.json: not a readable summary"):
        load_flight(tmp_path / "flight.mcap")


def test_a_page_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    McapRecorder(tmp_path / "flight.mcap").close()
    (tmp_path / "file").write_text("")
    with pytest.raises(UnavailableError, match="cannot write the report"):
        write_report(tmp_path / "flight.mcap", tmp_path / "file" / "report.html")


def test_a_report_takes_the_place_of_an_earlier_one_and_of_nothing_else(tmp_path: Path) -> None:
    log = write_flight(tmp_path)
    before, page = log.read_bytes(), tmp_path / "report.html"
    with pytest.raises(InputError, match="is there already, and no report; give the name of a new file"):
        write_report(log, log)
    assert log.read_bytes() == before
    write_report(log, page)
    write_report(log, page)
    assert page.read_text().startswith("<!doctype html>")


def test_the_command_writes_the_page_and_tells_where(flightd: Command, tmp_path: Path) -> None:
    McapRecorder(tmp_path / "flight.mcap").close()
    result = flightd("report", tmp_path / "flight.mcap", "--json")
    assert (result.returncode, result.stderr) == (0, "")
    assert json.loads(result.stdout) == {"report": str(tmp_path / "report.html")}
    assert (tmp_path / "report.html").read_text().startswith("<!doctype html>")


@pytest.mark.parametrize("content", [None, b"", b"\x00" * 100, b"PK\x03\x04 not a log"])
def test_a_bad_file_is_one_line_and_exit_2(flightd: Command, tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "flight.mcap"
    if content is not None:
        path.write_bytes(content)
    result = flightd("report", path)
    assert result.returncode == 2
    assert result.stdout == ""
    assert len(result.stderr.splitlines()) == 1
    assert str(path) in result.stderr
