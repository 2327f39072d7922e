"""What the report shows of a count: each location once, nothing better than it is, nothing loaded."""

from __future__ import annotations

import base64
import json
import re
from collections import Counter
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from flightd.adapters.recorder.recorder import McapRecorder
from flightd.cli.main import app
from flightd.core.errors import InputError
from flightd.core.flight_order import FlightOrder
from flightd.core.inventory import LocationRecord, LocationState, Observation, UndecidedCode
from flightd.core.topics import Document, Topic
from flightd.core.types import CodeRead
from flightd.inventory.comparison import ComparisonOutcome
from flightd.replay.report.figures import Figure
from flightd.replay.report.loader import load_flight
from flightd.replay.report.page import render
from flightd.replay.report.racks import racks_section
from flightd.replay.report.stock import WHOLE, CountedStock, CountTask, count_figures, percent, share
from flightd.replay.report.stocktaking import inventory_section
from flightd.site.site import Side, Site
from flightd.studies.counted_stock import counted_beside
from tests.replay.synthetic_count import RUN, site_with_racks, state_of, write_count, write_stock
from tests.replay.synthetic_flight import SITE_TOML, write_flight


@pytest.fixture(scope="module")
def site() -> Site:
    return site_with_racks(SITE_TOML)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, site: Site) -> Path:
    """A flight's folder with a count and the books beside the log."""
    made = tmp_path_factory.mktemp("counted")
    write_flight(made)
    write_count(made, site)
    write_stock(made / "stock.csv", site)
    return made


@pytest.fixture(scope="module")
def count(folder: Path) -> CountedStock:
    found = counted_beside(folder / "flight.mcap", expected=folder / "stock.csv")
    assert found is not None
    return found


@pytest.fixture(scope="module")
def section(count: CountedStock, site: Site) -> str:
    return inventory_section(count, site)


class Cells(HTMLParser):
    """The places drawn: code, classes and text on hover, front by front."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.places: list[tuple[str, set[str], str]] = []
        self.loaded: list[str] = []
        self.feed(page)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.open.append(tag)
        self.loaded += [value for name, value in given.items() if name in {"src", "href"}]
        if tag == "button" and "cell" in given.get("class", "").split():
            self.places.append((given["data-code"], set(given["class"].split()), given["title"]))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_every_location_is_drawn_once_in_its_state(section: str, count: CountedStock) -> None:
    cells = Cells(section)
    drawn = {code: classes for code, classes, _ in cells.places}
    assert len(drawn) == len(cells.places) == len(count.records)
    assert all(record.state.value in drawn[record.code] for record in count.records)
    assert cells.loaded == []


def test_places_differing_from_the_books_are_marked_and_no_others(section: str, count: CountedStock) -> None:
    marked = {code for code, classes, _ in Cells(section).places if "differs" in classes}
    wrong = [
        line
        for line in count.differences or ()
        if line.outcome not in {ComparisonOutcome.MATCH, ComparisonOutcome.UNCOUNTED}
    ]
    assert marked == {line.location for line in wrong} | {line.found_at for line in wrong if line.found_at}
    assert marked


def test_a_place_tells_its_codes_on_hover_and_no_label_becomes_markup(
    section: str, count: CountedStock
) -> None:
    several = next(record for record in count.records if record.state is LocationState.SEVERAL)
    title = next(title for code, _, title in Cells(section).places if code == several.code)
    assert all(text in title for text in several.texts)
    assert re.search(r"BOX <\d+>", title)
    assert not re.search(r"BOX <\d", section)


def test_fronts_are_drawn_as_they_are_seen_from_the_aisle(
    section: str, count: CountedStock, site: Site
) -> None:
    order = [code for code, _, _ in Cells(racks_section(count, site)).places]
    for side, rising in ((Side.LEFT, True), (Side.RIGHT, False)):
        top = [
            site.locations[code]
            for code in order
            if (at := site.locations[code]).aisle == "A" and at.side is side and at.level == 4
        ]
        xs = [at.x_m for at in top]
        assert xs == sorted(xs, reverse=not rising)
    first = [site.locations[code].level for code in order[:12]]
    assert first == [4] * 3 + [3] * 3 + [2] * 3 + [1] * 3


def test_the_exceptions_are_all_that_need_a_person(section: str, count: CountedStock) -> None:
    listed = re.search(r'class="exceptions".*?</table>', section, re.DOTALL)
    assert listed is not None
    codes = re.findall(r'data-code="([^"]+)"', listed[0])
    calm = {LocationState.READ, LocationState.EMPTY}
    assert sorted(codes) == sorted(record.code for record in count.records if record.state not in calm)


def test_differences_are_those_of_the_comparison(section: str, count: CountedStock) -> None:
    listed = re.search(r'class="differences".*?</table>', section, re.DOTALL)
    assert listed is not None
    outcomes = Counter(re.findall(r'class="level error">([^<]+)', listed[0]))
    expected = Counter(line.outcome.replace("_", " ") for line in count.differences or ())
    assert outcomes == Counter({k: n for k, n in expected.items() if k not in {"match", "uncounted"}})


def test_figures_say_what_was_counted(count: CountedStock, site: Site) -> None:
    figures = {figure.label: figure for figure in count_figures(count, 1800.0)}
    states = Counter(state_of(number) for number in range(len(site.locations)))
    looked = len(site.locations) - states[LocationState.NOT_VISITED]
    assert figures["Coverage"].note == f"{looked} of {len(site.locations)} locations looked at"
    assert figures["Coverage"].tone == "bad"
    hidden = states[LocationState.UNREADABLE] + states[LocationState.OCCLUDED]
    assert figures["Places settled"].note.startswith(f"{looked - hidden} of {looked} places, ")
    lines = [line for line in count.differences or () if line.location in {r.code for r in count.records}]
    read = sum(line.outcome in {ComparisonOutcome.MATCH, ComparisonOutcome.MOVED} for line in lines)
    assert figures["Read rate"].note == f"{read} of {read + hidden} labels of the books"
    assert figures["Pace"].value == f"{2 * looked:,}"
    assert 80.0 < float(figures["Confidence"].value) < 99.0
    assert figures["Differences"].tone == "bad"


def record(code: str, node: str, state: LocationState | None, run: str = "now") -> LocationRecord:
    if state is None:
        return LocationRecord(code, node, None)
    reads = (CodeRead("QR Code", code, (), True, 2, 1.0),) if state is LocationState.READ else ()
    return LocationRecord(code, node, Observation(run, code, 1, state, 0.998, reads))


def figures_of(records: list[LocationRecord], task: CountTask = WHOLE) -> dict[str, Figure]:
    return {figure.label: figure for figure in count_figures(CountedStock(records, task=task), None)}


def test_places_without_a_readable_label_are_not_called_labels_that_were_missed() -> None:
    """18 labels read of 18, and four places in doubt: nothing says that those have a label."""
    read = [record(f"R{i}", "A1", LocationState.READ) for i in range(18)]
    doubt = [record(f"U{i}", "A1", LocationState.UNREADABLE) for i in range(4)]
    figures = figures_of([*read, *doubt])
    assert "Read rate" not in figures
    assert (figures["Places settled"].value, figures["Places settled"].tone) == ("81.8", "")
    assert figures["Places settled"].note == "18 of 22 places, 4 unreadable"


def test_coverage_is_of_the_nodes_that_were_asked_for() -> None:
    asked = [record(f"A{i}", "A2", LocationState.READ) for i in range(6)]
    others = [record(f"B{i}", "B2", None) for i in range(34)]
    count = CountedStock([*asked, *others], task=CountTask(frozenset({"A2"}), "now"))
    figure = {figure.label: figure for figure in count_figures(count, None)}["Coverage"]
    assert (figure.value, figure.tone) == ("100", "good")
    assert figure.note == "6 of 6 locations looked at; 34 at other nodes"
    section = inventory_section(count, None)
    assert "None: every location was counted" in section
    assert "34 locations not visited are at nodes that this flight was not to count" in section
    assert figures_of([*asked, *others])["Coverage"].tone == "bad"


def test_what_an_earlier_count_saw_is_no_coverage_of_this_one() -> None:
    records = [
        record("A", "A1", LocationState.READ, "monday"),
        record("B", "A1", LocationState.READ, "tuesday"),
    ]
    figure = figures_of(records, CountTask(run="tuesday"))["Coverage"]
    assert (figure.value, figure.tone) == ("50", "bad")
    assert figure.note == "1 of 2 locations looked at, 1 known from other counts"


def test_the_flight_that_a_log_orders_is_the_one_that_its_report_judges(tmp_path: Path, site: Site) -> None:
    log = tmp_path / "flight.mcap"
    chosen = next(iter(site.locations.values())).node
    with McapRecorder(log, metadata={"run": RUN, "drone": "Kestrel"}) as recorder:
        recorder.record(Topic.ORDER, 1, FlightOrder(nodes=(chosen,)))
    write_count(tmp_path, site)
    flight = load_flight(log)
    page = render(flight, counted_beside(log))
    wanted = sum(place.node == chosen for place in site.locations.values())
    assert flight.nodes == {chosen}
    assert re.search(rf"of {wanted} locations looked at; {len(site.locations) - wanted} at other nodes", page)
    assert "Kestrel" in page
    assert RUN in page


@pytest.mark.parametrize(
    ("config", "nodes"),
    [
        ('[mission]\nnodes = ["A2", "B2"]\n', {"A2", "B2"}),
        ('{"mission": {"nodes": ["A2"]}}', {"A2"}),
        ("[mission]\n", set()),
        ("no table at all", set()),
        ('{"mission": [1]}', set()),
    ],
)
def test_an_older_log_orders_what_its_configuration_does(
    tmp_path: Path, config: str, nodes: set[str]
) -> None:
    log = tmp_path / "flight.mcap"
    with McapRecorder(log) as recorder:
        recorder.record(Topic.CONFIG, 1, Document(config))
    assert load_flight(log).nodes == nodes


def test_a_location_that_only_the_books_know_is_named_with_its_line(folder: Path, tmp_path: Path) -> None:
    books = tmp_path / "books.csv"
    books.write_text("location,code\nA-<1>,PALLET\n")
    count = counted_beside(folder / "flight.mcap", expected=books)
    assert count is not None
    told = inventory_section(count, None)
    assert "Unknown to the count, misspelt or not planned: A-&lt;1&gt; (books.csv, line 2)." in told


@pytest.mark.parametrize(
    ("confidence", "shown"),
    [(1.0, "100 %"), (0.9996, "99.9 %"), (0.998, "99.8 %"), (0.29, "29 %"), (0.0, "0 %")],
)
def test_a_confidence_is_never_rounded_up(confidence: float, shown: str) -> None:
    assert share(confidence) == shown


def test_the_least_confidence_is_not_above_the_mean() -> None:
    figure = figures_of([record("A", "A1", LocationState.READ)])["Confidence"]
    assert (figure.value, figure.note) == ("99.8", "least 99.8 % at A")


@pytest.mark.parametrize(
    ("part", "whole", "shown"),
    [(9_999, 10_000, "99.9"), (10_000, 10_000, "100"), (1, 10_000, "0.1"), (0, 7, "0")],
)
def test_a_share_is_never_rounded_to_all_or_nothing(part: int, whole: int, shown: str) -> None:
    assert percent(part, whole) == shown


def data_of(section: str, name: str) -> dict[str, object]:
    found = re.search(rf'id="{name}">(.*?)</script>', section, re.DOTALL)
    assert found is not None
    document: dict[str, object] = json.loads(found[1])
    return document


def test_a_click_shows_the_evidence_picture(section: str, count: CountedStock) -> None:
    looks, pictures = data_of(section, "counted")["places"], data_of(section, "pictures")
    assert isinstance(looks, dict)
    assert set(looks) == {record.code for record in count.records}
    for record in count.records:
        look = looks[record.code]
        assert isinstance(look, dict)
        if record.observation is None:
            assert "picture" not in look
            continue
        shown = base64.b64decode(str(pictures[look["picture"]]))
        decoded = cv2.imdecode(np.frombuffer(shown, np.uint8), cv2.IMREAD_COLOR)
        assert decoded is not None
        assert decoded.shape == (270, 480, 3)


def records(number: int, state: LocationState) -> list[LocationRecord]:
    looks = [Observation("r", f"L{i}", i, state, 0.0, evidence=f"{i:064x}") for i in range(number)]
    return [LocationRecord(look.location, "", look) for look in looks]


def test_pictures_have_a_budget_and_those_of_exceptions_come_first() -> None:
    noise = np.random.default_rng(1).integers(0, 255, (480, 480, 3), np.uint8)
    jpeg = bytes(cv2.imencode(".jpg", noise, [cv2.IMWRITE_JPEG_QUALITY, 80])[1])
    made = records(150, LocationState.EMPTY)
    odd = Observation("r", "odd", 5, LocationState.UNREADABLE, 0.0, evidence="f" * 64)
    page = inventory_section(CountedStock([*made, LocationRecord("odd", "", odd)], lambda _name: jpeg), None)
    pictures = data_of(page, "pictures")
    assert next(iter(pictures)) == "f" * 64
    assert 10 < len(pictures) < 150
    assert len(page) < 20_000_000


def test_a_place_with_something_undecided_needs_a_person_and_keeps_its_state() -> None:
    seen = CodeRead("QR Code", "BOX-1", (), True, 2, 1.0)
    undecided = UndecidedCode("ITF", "<07>", 1), UndecidedCode("ITF", "12", 2)
    looks = [Observation("r", code, 1, LocationState.READ, 0.9, (seen,)) for code in ("plain", "odd")]
    looks[1] = replace(looks[1], undecided=undecided)
    count = CountedStock([LocationRecord(look.location, "", look) for look in looks], lambda _name: None)
    page = inventory_section(count, None)
    listed = re.search(r'class="exceptions".*?</table>', page, re.DOTALL)
    assert listed is not None
    assert re.findall(r'data-code="([^"]+)"', listed[0]) == ["odd"]
    assert "undecided: &lt;07&gt; (1 look), 12 (2 looks)" in listed[0]
    assert [title for code, _, title in Cells(page).places if "undecided" in title] == [
        "odd · read · BOX-1 · undecided: <07> (1 look), 12 (2 looks) · 90 %"
    ]
    places = data_of(page, "counted")["places"]
    assert isinstance(places, dict)
    assert ["Undecided", "<07> (1 look), 12 (2 looks)"] in places["odd"]["facts"]
    assert (places["odd"]["odd"], places["plain"]["odd"], places["odd"]["texts"]) == (True, False, ["BOX-1"])


@pytest.mark.parametrize("picture", [None, b"no picture"])
def test_evidence_that_is_gone_or_damaged_is_left_out(picture: bytes | None) -> None:
    page = inventory_section(CountedStock(records(2, LocationState.UNREADABLE), lambda _name: picture), None)
    assert data_of(page, "pictures") == {}


def test_locations_that_the_map_does_not_know_are_shown_too(count: CountedStock, site: Site) -> None:
    stray = records(3, LocationState.EMPTY)
    page = racks_section(CountedStock([*count.records, *stray]), site)
    assert "Not on the map" in page
    assert len(Cells(page).places) == len(count.records) + 3


def test_the_page_has_the_inventory_only_where_there_is_one(folder: Path, count: CountedStock) -> None:
    flight = load_flight(folder / "flight.mcap")
    assert 'id="counted"' in render(flight, count)
    assert 'id="counted"' not in render(flight)


def test_a_damaged_inventory_that_nobody_asked_for_does_not_cost_the_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "inventory.db").write_bytes(b"no database at all" * 100)
    assert counted_beside(tmp_path / "flight.mcap") is None
    assert "the report shows the flight alone" in capsys.readouterr().err
    with pytest.raises(InputError):
        counted_beside(tmp_path / "flight.mcap", inventory=tmp_path)


def test_the_command_takes_the_inventory_beside_the_log_and_the_books(folder: Path, tmp_path: Path) -> None:
    log, out = str(folder / "flight.mcap"), tmp_path / "r.html"
    told = CliRunner().invoke(
        app, ["report", log, "--out", str(out), "--expected", str(folder / "stock.csv"), "--json"]
    )
    assert json.loads(told.stdout) == {"report": str(out)}
    assert "Against the expected stock" in out.read_text()
    bare = write_flight(tmp_path / "bare")
    assert counted_beside(bare) is None
    for inventory, expected in ((tmp_path / "none", None), (None, folder / "stock.csv")):
        with pytest.raises(InputError, match=r"inventory\.db"):
            counted_beside(bare, inventory, expected)
