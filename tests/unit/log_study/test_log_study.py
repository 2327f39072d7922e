"""Many logs through today's code: each by itself, on whatever engine; no worker's death changes a word."""

from __future__ import annotations

import contextlib
import itertools
import json
import multiprocessing
import os
import re
import shutil
import sqlite3
import threading
from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

from flightd import __version__
from flightd.adapters.recorder.archive import FlightArchive
from flightd.adapters.recorder.recorder import McapRecorder, wait_for_disk
from flightd.adapters.store.sqlite import SqliteStore
from flightd.app.log_study import ray_cluster, ray_engine
from flightd.app.log_study.engines import Work, run_local, study_source
from flightd.app.log_study.finding import LogFindings, Outcome, Study
from flightd.app.log_study.ray_engine import run_ray
from flightd.app.log_study.sources import LogSource, log_sources
from flightd.config.schema import load_config
from flightd.core.errors import FlightdError, InputError, UnavailableError
from flightd.core.inventory import CountPose, LocationState, PlannedLocation, UndecidedCode
from flightd.core.topics import Document, RecordedFrame, Topic
from flightd.replay.log import read_log
from tests.command import Command
from tests.replay.synthetic_flight import write_flight
from tests.rigs.extras import of_extra
from tests.rigs.somebody_else import as_somebody_else
from tests.unit.log_study.dying_work import always_dies, dies_once, fails, works_alone
from tests.web.stock_rig import code, look, picture_of

CONFIGS = Path(__file__).parents[3] / "configs"
STUDIES = (Study.DETECT, Study.JUDGE)


@pytest.fixture(scope="module")
def flights(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four flights, one of them cut to nothing."""
    folder = tmp_path_factory.mktemp("flights")
    (folder / "a").mkdir()
    (folder / "raw").mkdir()
    raw = write_flight(folder / "raw", seed=3)
    with McapRecorder(folder / "a" / "flight.mcap", when_full=wait_for_disk) as recorder:
        recorder.record(Topic.CONFIG, 0, Document(load_config(CONFIGS / "sim.toml").model_dump_json()))
        for entry in read_log(raw).entries:
            if entry.topic == Topic.FRAME and isinstance(entry.message, RecordedFrame):
                recorder.image(Topic.FRAME, entry.stamp_ns, entry.message.seq, entry.message.jpeg)
            elif entry.topic != Topic.CONFIG:
                recorder.record(entry.topic, entry.stamp_ns, entry.message)
    for name in ("truth.mcap", "summary.json"):
        shutil.move(folder / "raw" / name, folder / "a")
    shutil.rmtree(folder / "raw")
    for name in "bc":
        shutil.copytree(folder / "a", folder / name)
    (folder / "c" / "summary.json").unlink()
    (folder / "d").mkdir()
    (folder / "d" / "flight.mcap").write_bytes(b"no log at all")
    return folder


def of_format_8(folder: Path) -> dict[str, bytes]:
    """Make the inventory there one of an earlier release's, which would not read it as one of today's; its
    files."""
    with contextlib.closing(sqlite3.connect(folder / "inventory.db")) as database:
        database.execute("DROP TABLE site")
        database.execute("PRAGMA user_version = 8")
    return inventory_files(folder)


def inventory_files(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in folder.glob("inventory.db*")}


def told(sources: list[LogSource], found: Iterator[tuple[int, LogFindings]]) -> str:
    by_number = dict(found)
    assert by_number.keys() == set(range(len(sources)))
    return "\n".join(json.dumps(by_number[number].document()) for number in range(len(sources)))


@pytest.fixture(scope="module")
def alone(flights: Path) -> str:
    """What is found in them in one process, one after the other."""
    sources = log_sources([str(flights)])
    return told(sources, ((number, study_source(one, STUDIES)) for number, one in enumerate(sources)))


def test_each_log_is_studied_and_a_bad_one_costs_the_others_nothing(
    flightd: Command, flights: Path, tmp_path: Path
) -> None:
    out = tmp_path / "found.jsonl"
    ended = flightd(
        "study", flights, "--with", "detect,replay,judge,codes", "--out", out, "--json", "--workers", 2
    )
    assert ended.returncode == 1
    assert ended.stderr.splitlines() == ["flightd: 4 of 4 logs differ or could not be studied"]
    document: dict[str, Any] = json.loads(ended.stdout)
    assert [json.loads(line) for line in out.read_text().splitlines()] == document["logs"]
    a, b, c, d = (log["studies"] for log in document["logs"])
    assert a == b
    assert a["replay"] == {"outcome": "nothing", "text": "holds no ticks to replay", "figures": {}}
    assert a["codes"]["outcome"] == "nothing"
    assert a["judge"]["outcome"] == "failed"
    assert "holds no scenario" in a["judge"]["text"]
    assert c["judge"] == {"outcome": "nothing", "text": "no truth of a simulator beside it", "figures": {}}
    assert c["detect"]["outcome"] in {"same", "different"}
    assert {finding["outcome"] for finding in d.values()} == {"failed", "nothing"}
    assert document["outcomes"]["codes"] == {"nothing": 4}


def test_a_flight_of_today_is_seen_decided_and_judged_as_it_was(
    flightd: Command, recorded_flight: Path, tmp_path: Path
) -> None:
    ended = flightd("study", recorded_flight, "--with", "replay,judge,calibrate", "--json", "--workers", 1)
    (log,) = json.loads(ended.stdout)["logs"]
    assert (log["studies"]["replay"]["outcome"], log["studies"]["judge"]["outcome"]) == ("same", "same")
    assert log["studies"]["judge"]["figures"]["differing"] == {}
    other = tmp_path / "flight"
    shutil.copytree(recorded_flight, other)
    with SqliteStore(other):
        pass
    before = of_format_8(other)
    summary = json.loads((other / "summary.json").read_text())
    summary["cross_track_rms_m"] += 0.01
    (other / "summary.json").write_text(json.dumps(summary))
    ended = flightd("study", other / "flight.mcap", "--with", "judge")
    assert ended.returncode == 1
    assert "cross_track_rms_m" in ended.stdout
    assert inventory_files(other) == before
    shutil.copyfile(other / "flight.mcap", other / "another.mcap")
    ended = flightd("study", other / "another.mcap", "--with", "judge", "--json")
    assert json.loads(ended.stdout)["outcomes"]["judge"] == {"nothing": 1}, "it is judged by its own truth"


def test_a_flights_labels_are_those_of_its_own_run_wherever_its_inventory_is(
    flightd: Command, tmp_path: Path
) -> None:
    archive = FlightArchive(tmp_path / "flights", 1 << 30)
    with SqliteStore(tmp_path / "inventory") as inventory:
        for day, (run, told) in enumerate({"monday": "PAL-1", "tuesday": "PAL-2", "wednesday": ""}.items()):
            log = archive.begin(datetime(2026, 11, 23 + day, tzinfo=UTC))
            with McapRecorder(log, metadata={"run": run}, when_full=wait_for_disk):
                pass
            if told:
                kept = inventory.keep_evidence(picture_of("PAL-1"))
                seen = look("A-1", LocationState.READ, code(told), run=run, at_s=day, evidence=kept)
                inventory.commit(seen)
    before = of_format_8(tmp_path / "inventory")
    studied = ("study", tmp_path / "flights", "--with", "codes", "--json", "--workers", 1)
    ended = flightd(*studied, "--inventory", tmp_path / "inventory")
    told_of = [log["studies"]["codes"] for log in json.loads(ended.stdout)["logs"]]
    assert [(told["outcome"], told["text"]) for told in told_of] == [
        ("same", ""),
        ("different", "1 places read otherwise, first A-1"),
        ("nothing", "the inventory has no confirmed look of its run wednesday"),
    ]
    assert json.loads(flightd(*studied).stdout)["outcomes"]["codes"] == {"nothing": 3}
    assert inventory_files(tmp_path / "inventory") == before


def test_a_places_own_label_and_a_neighbours_goods_in_its_picture_are_no_difference(
    flightd: Command, tmp_path: Path
) -> None:
    with McapRecorder(tmp_path / "flight.mcap", metadata={"run": "monday"}, when_full=wait_for_disk):
        pass
    shown = {
        "A-1": ("PAL-1", "a-1"),
        "A-2": ("PAL-2", "A-2", "PAL-1"),
        "A-3": ("A-3", "PAL-2"),
        "A-4": ("A-4",),
    }
    counted = {"A-1": "PAL-1", "A-2": "PAL-2", "A-3": "", "A-4": "PAL-4"}
    with SqliteStore(tmp_path) as inventory:
        inventory.plan(PlannedLocation(place, "A1") for place in shown)
        for place, texts in shown.items():
            kept = inventory.keep_evidence(picture_of(*texts))
            told = (code(counted[place]),) if counted[place] else ()
            state = LocationState.READ if told else LocationState.EMPTY
            inventory.commit(look(place, state, *told, run="monday", evidence=kept))
    ended = flightd("study", tmp_path, "--with", "codes", "--json", "--workers", 1)
    (log,) = json.loads(ended.stdout)["logs"]
    figures = log["studies"]["codes"]["figures"]
    assert figures["same"] == 2
    assert (figures["otherwise"], figures["newly_read"]) == ([], 0)
    assert figures["lost"] == ["A-4"], "its own label alone is no goods"
    assert figures["left_out"] == 2


def test_what_is_told_elsewhere_hides_no_difference(flightd: Command, tmp_path: Path) -> None:
    with McapRecorder(tmp_path / "flight.mcap", metadata={"run": "monday"}, when_full=wait_for_disk):
        pass
    far = CountPose("C1", 20.0, 0.0, 1.6, 0.0)
    with SqliteStore(tmp_path) as inventory:
        kept = {text: inventory.keep_evidence(picture_of(text)) for text in ("PAL-1", "PAL-7", "PAL-9")}
        unsure = look("A-1", LocationState.UNREADABLE, run="monday", evidence=kept["PAL-7"])
        seen = [
            replace(unsure, undecided=(UndecidedCode("QR Code", "PAL-7", 1),)),
            look("B-1", LocationState.READ, code("PAL-12"), run="monday", evidence=kept["PAL-1"]),
            look("B-2", LocationState.READ, code("PAL-1"), run="monday", evidence=kept["PAL-1"]),
            look("B-3", LocationState.READ, code("PAL-3"), run="monday", evidence=kept["PAL-9"]),
            replace(look("C-1", LocationState.READ, code("PAL-9"), run="monday"), pose=far),
        ]
        inventory.plan(PlannedLocation(one.location, f"{one.location[0]}1") for one in seen)
        for one in seen:
            inventory.commit(one)
    (log,) = json.loads(flightd("study", tmp_path, "--with", "codes", "--json", "--workers", 1).stdout)[
        "logs"
    ]
    figures = log["studies"]["codes"]["figures"]
    assert figures["newly_read"] == 1, "what was too little to count is read now"
    assert figures["otherwise"] == ["B-1", "B-3"], (
        "a part of its code, and goods of the other end of the hall"
    )
    assert (figures["same"], figures["lost"]) == (1, [])


@pytest.mark.parametrize("work", [dies_once, always_dies])
def test_a_worker_that_dies_costs_time_alone(flights: Path, alone: str, tmp_path: Path, work: Work) -> None:
    shutil.copytree(flights, tmp_path / "flights")
    sources = log_sources([str(tmp_path / "flights")])
    right = alone.replace(str(flights), str(tmp_path / "flights"))
    (tmp_path / "flights" / "b" / work.__name__.replace("_", " ")).touch()
    found = dict(run_local(sources, STUDIES, 2, work))
    if work is dies_once:
        assert told(sources, iter(found.items())) == right
        return
    assert {finding.text for finding in found.pop(1).findings.values()} == {"its worker died 3 times"}
    rest = [json.dumps(found[number].document()) for number in sorted(found)]
    assert rest == [line for number, line in enumerate(right.splitlines()) if number != 1]


def test_what_is_unforeseen_is_told_of_its_log_and_ends_no_study(
    recorded_flight: Path, tmp_path: Path
) -> None:
    shutil.copytree(recorded_flight, tmp_path / "old")
    truth = tmp_path / "old" / "truth.mcap"
    entries = read_log(truth).entries
    with McapRecorder(truth, when_full=wait_for_disk) as recorder:
        for entry in entries:
            message = entry.message
            if entry.topic == Topic.TRUTH and isinstance(message, dict):
                message = {name: value for name, value in message.items() if name != "yaw_rate_radps"}
            recorder.record(entry.topic, entry.stamp_ns, message)
    (source,) = log_sources([str(tmp_path / "old" / "flight.mcap")])
    found = study_source(source, (Study.JUDGE, Study.CODES)).findings
    assert found[Study.JUDGE].outcome is Outcome.FAILED
    assert re.fullmatch(r"KeyError: 'yaw_rate_radps' \(judgement\.py, line \d+\)", found[Study.JUDGE].text)
    assert found[Study.CODES].outcome is not Outcome.FAILED


def test_work_that_fails_in_its_worker_costs_its_log_alone(flights: Path, alone: str, tmp_path: Path) -> None:
    shutil.copytree(flights, tmp_path / "flights")
    sources = log_sources([str(tmp_path / "flights")])
    (tmp_path / "flights" / "b" / "fails").touch()
    found = dict(run_local(sources, STUDIES, 2, fails))
    texts = {finding.text for finding in found.pop(1).findings.values()}
    assert len(texts) == 1
    assert texts.pop().startswith("ZeroDivisionError: division by zero")
    right = alone.replace(str(flights), str(tmp_path / "flights")).splitlines()
    assert [json.dumps(found[number].document()) for number in (0, 2, 3)] == [right[0], *right[2:]]


def test_a_worker_that_is_killed_while_nobody_waits_for_it_costs_time_alone(
    flights: Path, alone: str
) -> None:
    found: dict[int, LogFindings] = {}
    others = {*multiprocessing.active_children()}, {*threading.enumerate()}
    for number, one in run_local(log_sources([str(flights)]), STUDIES, 1):
        if not found:
            for worker in {*multiprocessing.active_children()} - others[0]:
                worker.kill()
            for keeper in {*threading.enumerate()} - others[1]:
                if "QueueFeeder" not in keeper.name:  # the pool's own, which ends once it has seen that
                    keeper.join()
        found[number] = one
    assert told(log_sources([str(flights)]), iter(found.items())) == alone


def test_who_stops_asking_ends_the_workers(flights: Path) -> None:
    others = {*multiprocessing.active_children()}
    running = run_local(log_sources([str(flights)]), STUDIES, 2)
    next(running)
    assert {*multiprocessing.active_children()} - others
    running.close()
    assert not {*multiprocessing.active_children()} - others


def test_logs_are_fetched_from_wherever_fsspec_finds_them(flights: Path) -> None:
    here = log_sources([str(flights)])
    there = log_sources([f"file://{flights}"])
    assert [source.name for source in there] == [f"file://{source.place}" for source in here]
    near, far = study_source(here[0], STUDIES), study_source(there[0], STUDIES)
    assert near.findings == far.findings
    assert near.findings[Study.DETECT].outcome is not Outcome.FAILED


def test_of_a_folder_of_many_logs_only_what_belongs_to_one_is_fetched(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from fsspec.implementations.memory import MemoryFileSystem

    files, read = MemoryFileSystem(), list[str]()
    beside = {"summary.json", "truth.mcap", "inventory.db", "inventory.db-wal", "evidence/ab/abcd.jpg"}
    opened = MemoryFileSystem.open

    def noted(self: Any, path: str, mode: str = "rb", **how: Any) -> Any:
        read.extend([path] if mode == "rb" else [])
        return opened(self, path, mode, **how)

    logs = {f"{n} [north].mcap" for n in range(5)}
    for name in (*logs, *beside, "notes.txt", "a/flight.mcap", "a/summary.json"):
        files.pipe_file(f"/flat/{name}", f"what is in {name}".encode())
    monkeypatch.setattr(MemoryFileSystem, "open", noted)
    inventory = {"inventory.db", "inventory.db-wal"}
    judged = {"summary.json", "truth.mcap", *inventory}
    reads: tuple[tuple[str, tuple[Study, ...], set[str]], ...] = (
        ("", (Study.DETECT, Study.REPLAY, Study.CALIBRATE), set()),
        ("", (Study.JUDGE,), judged),
        ("", (Study.CODES,), {"evidence/ab/abcd.jpg", *inventory}),
        ("", (Study.CODES, Study.JUDGE), beside),
        ("/another", (Study.CODES, Study.REPLAY), set()),
        ("/another", (Study.CODES, Study.JUDGE), judged),
    )
    try:
        sources = log_sources(["memory://flat"])
        assert len(sources) == 6
        assert read == []
        for source, (another, studies, wanted) in itertools.product(sources, reads):
            read.clear()
            with replace(source, inventory=another).fetched(studies) as log:
                here = {str(path.relative_to(log.parent)) for path in log.parent.rglob("*") if path.is_file()}
                assert log.read_text() == "what is in " + source.place.removeprefix("memory:///flat/")
            there = {"summary.json"} if source.place.endswith("/a/flight.mcap") else beside
            assert here == {log.name} | (wanted & there)
            assert len(read) == len(here)
    finally:
        files.rm("/flat", recursive=True)


def test_what_ray_prints_meanwhile_stays_out_of_the_document(
    flightd: Command, flights: Path, alone: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def told_by_ray(
        sources: Sequence[LogSource], studies: tuple[Study, ...], workers: int | None, *, address: str
    ) -> Iterator[tuple[int, LogFindings]]:
        for number, one in run_local(sources, studies, 1):
            print("(raylet) A worker died or was killed")
            yield number, one

    monkeypatch.setattr(ray_engine, "run_ray", told_by_ray)
    done = flightd("study", str(flights), "--with", ",".join(STUDIES), "--engine", "ray", "--json")
    assert json.loads(done.stdout)["logs"] == [json.loads(line) for line in alone.splitlines()]
    assert done.stderr.count("(raylet)") == 4


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--with", "replay,guess"), "--with guess: no such study; choose of detect, replay, codes"),
        (("--with", ","), "--with: names no study"),
        (("--address", "ray://x:1"), "--address: is for --engine ray alone"),
        (("--inventory", "."), "--inventory: is for the study codes alone; add it: --with codes"),
        (
            ("--with", "codes", "--inventory", "."),
            "--inventory: holds no inventory.db that can be read; give the folder",
        ),
    ],
)
def test_what_is_not_there_is_one_line(
    flightd: Command, flights: Path, arguments: tuple[str, ...], said: str
) -> None:
    ended = flightd("study", flights, *arguments)
    assert (ended.returncode, ended.stdout) == (2, "")
    assert said in ended.stderr
    assert len(ended.stderr.splitlines()) == 1


def test_a_place_without_a_log_is_named(flightd: Command, tmp_path: Path) -> None:
    assert "holds no flight log" in flightd("study", tmp_path).stderr
    assert "is neither a log nor a folder" in flightd("study", tmp_path / "nowhere").stderr
    assert "cannot be opened" in flightd("study", "nonsense://x/y").stderr


def test_a_folder_that_cannot_be_looked_through_is_named() -> None:
    with TemporaryDirectory() as made:
        hall, closed = Path(made), Path(made) / "b" / "closed"
        for folder in (hall / "a", closed):
            folder.mkdir(parents=True)
            (folder / "flight.mcap").touch()
        hall.chmod(0o755)
        closed.chmod(0)
        for asked, named in ((hall, closed), (closed, closed), (closed / "flight.mcap",) * 2):
            with pytest.raises(InputError) as refused, as_somebody_else():
                log_sources([str(asked)])
            assert str(refused.value).startswith(f"{named}: cannot be looked through: Permission denied; ")
        assert len(log_sources([str(hall / "a")])) == 1
        closed.chmod(0o700)


def test_a_folder_that_can_be_listed_and_not_entered_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Path, "is_file", os.path.isfile)  # as from Python 3.14 on
    monkeypatch.setattr(Path, "is_dir", os.path.isdir)
    with TemporaryDirectory() as made:
        hall, listed = Path(made), Path(made) / "listed"
        for folder in (hall / "a", listed):
            folder.mkdir()
            (folder / "flight.mcap").touch()
        (hall / "a" / "gone.mcap").symlink_to("nowhere")
        (hall / "a" / "round.mcap").symlink_to("round.mcap")
        hall.chmod(0o755)
        listed.chmod(0o444)
        for asked in (hall, listed, listed / "flight.mcap"):
            with pytest.raises(InputError) as refused, as_somebody_else():
                log_sources([str(asked)])
            told = f"{listed}/flight.mcap: cannot be looked through: Permission denied; "
            assert str(refused.value).startswith(told)
        assert len(log_sources([str(hall / "a")])) == 1
        listed.chmod(0o700)


@pytest.fixture(scope="module")
def on_ray(
    flights: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[list[LogSource], list[tuple[int, LogFindings]]]]:
    """What a study on a Ray that was begun for it found though a worker was killed; it is there still."""
    of_extra("ray", "ray")
    folder = tmp_path_factory.mktemp("ray")
    shutil.copytree(flights, folder, dirs_exist_ok=True)
    (folder / "b" / "dies once").touch()
    sources = log_sources([str(folder)])
    with contextlib.closing(run_ray(sources, STUDIES, 2, dies_once)) as running:
        yield sources, [next(running) for _ in sources]


def on_cluster(sources: list[LogSource], work: Work = study_source, workers: int | None = None) -> list[str]:
    """What is found as if somebody else had begun the Ray that is there."""
    found = dict(run_ray(sources, (Study.CODES,), workers, work, address="ray://head:10001"))
    return [found[number].findings[Study.CODES].text for number in range(len(sources))]


def test_ray_finds_the_same_byte_for_byte_though_a_worker_is_killed(
    on_ray: tuple[list[LogSource], list[tuple[int, LogFindings]]], flights: Path, alone: str
) -> None:
    sources, found = on_ray
    assert told(sources, iter(found)) == alone.replace(str(flights), str(Path(sources[0].place).parents[1]))


@pytest.mark.usefixtures("on_ray")
def test_each_node_is_asked_first_for_its_flightd_and_for_what_is_read_there_by_its_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refusal(kind: type[FlightdError], source: LogSource) -> str:
        with pytest.raises(kind) as refused:
            on_cluster([source])
        return str(refused.value)

    for name in "ab":
        (tmp_path / name).mkdir()
        (tmp_path / name / "flight.mcap").write_bytes(b"no log at all")
    (tmp_path / "b" / "fails").touch()
    sources = log_sources([str(tmp_path)])
    assert on_cluster(sources, fails) == [
        "no inventory beside it; say where it is: --inventory FOLDER", "ZeroDivisionError: division by zero",
    ]  # fmt: skip

    gone = LogSource("gone", f"{tmp_path}/gone.mcap")
    assert refusal(InputError, gone).startswith(f"{tmp_path}/gone.mcap: is not on node ")
    for source in (sources[0], LogSource("far", "memory://far/flight.mcap")):
        said = refusal(InputError, replace(source, inventory=f"{tmp_path}/stock"))
        assert said.startswith(f"{tmp_path}/stock/inventory.db: --inventory: is not on node "), said
    monkeypatch.setattr(ray_cluster, "__version__", "9.0")
    said = refusal(UnavailableError, gone)
    assert re.match(rf"--address ray://head:10001: node \S+ has flightd {__version__}; install", said)


@pytest.mark.usefixtures("on_ray")
def test_a_node_that_is_gone_when_it_is_asked_is_none_that_works() -> None:
    ray = of_extra("ray", "ray")
    (node,) = ray.nodes()
    gone = {**node, "NodeID": "0" * len(node["NodeID"]), "NodeManagerAddress": "gone"}
    looks = list(ray_cluster.node_looks(ray, [gone, node], ["/"], "--engine ray"))
    assert looks == [ray_cluster.NodeLook(node["NodeManagerAddress"], __version__, "")]


@pytest.mark.usefixtures("on_ray")
def test_no_more_logs_are_worked_on_at_a_time_than_was_asked_for(tmp_path: Path) -> None:
    sources = [LogSource(str(number), str(tmp_path / "flight.mcap")) for number in range(6)]
    (tmp_path / "flight.mcap").touch()
    assert on_cluster(sources, works_alone, workers=1) == [""] * len(sources)
