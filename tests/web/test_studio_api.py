"""What the station answers to the page Studio: pictures, marks, masks, training, scores, profiles."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
import pytest

from flightd.core.errors import InputError, RunError
from flightd.ground.access.roles import Role
from flightd.ground.flights.flights import Flights
from flightd.ground.reading_process import ReadingProcess
from flightd.ground.studio import studio as studio_module
from flightd.ground.studio.lessons import Outcome, get_ready
from flightd.ground.studio.picture_sets import PictureSets
from flightd.ground.studio.studio import Studio, missing_training
from flightd.ground.studio.verdict import Judged, Verdict
from flightd.runtime.within import Within
from flightd.studies.train import train_colour
from flightd.vision.lines.colour_profile import classify, grow, load_profile, save_profile
from flightd.vision.lines.sampling import grid_for, sample
from flightd.vision.training.labelled_frames import read_labels
from tests.rigs.event_loops import in_real_time
from tests.web.people_rig import audited, with_people
from tests.web.served import JSON, Station, served
from tests.web.studio_rig import flight_of, flown_folder, got, head_of, marked_set, marks_of, post, trained

pytestmark = pytest.mark.skipif(missing_training() != "", reason=missing_training())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return flown_folder(tmp_path_factory.mktemp("studio"))


@in_real_time
async def test_a_colour_is_learnt_scored_installed_and_taken_back(folder: Path, tmp_path: Path) -> None:
    """First as it should be, then with paint and floor mistaken for each other, then with too little."""
    async with served(folder=folder) as station:
        files = await marked_set(station, "hall", "yellow", 9)
        flight, _ = await flight_of(station)
        at = "/api/studio/sets/hall"

        head, png = await head_of(station, f"{at}/pictures/{files[0]}/mask?by=strokes")
        mask = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED)
        assert mask is not None
        assert mask.shape[2] == 4
        assert 0.02 < head["share"] < 0.4
        assert len(head["lines"]) >= 1

        # the set is a dataset that the commands read
        _, labels = read_labels(folder / "studio" / "hall")
        assert {label.line_colour for label in labels.images} == {"yellow"}
        assert all(label.lines and label.complete for label in labels.images)
        learnt = train_colour([folder / "studio" / "hall"], "yellow", tmp_path / "hand.npz", "hand", 0)
        assert learnt.pictures == 9

        known = await trained(station, "hall", [flight])
        outcome = known["outcome"]
        assert outcome["trained_on"] == 6
        assert len(outcome["held_back"]) == 3
        assert [one["name"] for one in outcome["scores"]] == ["new", "shipped yellow"]
        new = outcome["scores"][0]
        assert new["pictures"]["paint_kept"] > 0.95 * new["pictures"]["paint"] > 100
        assert new["pictures"]["lines_found"] == new["pictures"]["lines"] > 0
        assert new["logs"]["lines"] > 20
        assert outcome["verdict"]["judged"] in {"same", "better"}

        seen = outcome["training_hash"]
        code, text = await station.ask("GET", f"/api/studio/flights/{flight}/sensors", within_s=90.0)
        assert (code, "mission: is missing" in json.loads(text)["refused"]) == (404, True), text
        code, text = await station.ask("GET", "/api/studio/flights/nothing/sensors")
        assert (code, json.loads(text)["refused"]) == (404, "there is no such flight")

        code, said = await post(station, f"{at}/install", {"training_hash": "another", "who": "Ann"})
        assert (code, "trained anew" in said["refused"]) == (409, True)
        code, shelved = await post(station, f"{at}/install", {"training_hash": seen, "who": "Ann"})
        assert (code, shelved["current"]) == (200, 1)
        flies = folder / "profiles" / "hall.npz"
        profile = load_profile(flies)
        assert (profile.name, profile.colour, profile.training_hash) == ("hall", "yellow", seen)
        assert shelved["file"] == str(flies)
        assert (await post(station, f"{at}/install", {"training_hash": seen, "who": "Bo"}))[1] == shelved

        # the mask is the detector's own, not another one
        bgr = cv2.imread(str(folder / "studio" / "hall" / files[1]))
        assert bgr is not None
        head, _ = await head_of(station, f"{at}/pictures/{files[1]}/mask?by=installed")
        own = grow(classify(sample(np.asarray(bgr, np.uint8), grid_for(640, 360)), profile)) > 0
        assert head["share"] == pytest.approx(own.mean(), abs=1e-3)

        for picture in known["pictures"]:
            regions = [one | {"paint": not one["paint"]} for one in picture["regions"]]
            path = f"{at}/pictures/{picture['file']}"
            assert (await post(station, path, {"regions": regions}, "PUT"))[0] == 200
        worse = (await trained(station, "hall", [flight]))["outcome"]
        assert [one["name"] for one in worse["scores"]] == ["new", "shipped yellow", "installed 1"]
        assert worse["verdict"]["judged"] == "worse"
        assert any("logs" in reason for reason in worse["verdict"]["reasons"])
        order = {"training_hash": worse["training_hash"], "who": "Bo"}
        code, said = await post(station, f"{at}/install", order)
        assert code == 409
        assert "it is worse than what flies" in said["refused"]
        assert "second time" in said["refused"]
        assert load_profile(flies).training_hash == seen
        code, shelved = await post(station, f"{at}/install", order | {"again": True})
        assert (code, shelved["current"]) == (200, 2)
        assert load_profile(flies).training_hash == worse["training_hash"]
        code, back = await post(station, "/api/studio/profiles/hall/back", {"version": 1})
        assert (code, back["current"], [one["who"] for one in back["versions"]]) == (200, 1, ["Ann", "Bo"])
        assert load_profile(flies).training_hash == seen

        for file in files[3:]:
            assert (await post(station, f"{at}/pictures/{file}", {}, "PUT"))[0] == 200
        refused = (await trained(station, "hall", []))["training"]["refused"]
        assert "paint is marked in 3 pictures; 7 are needed" in refused


def with_outcome(folder: Path, name: str) -> None:
    """A set whose training has come to the shipped profile."""
    PictureSets(folder).make(name, "yellow")
    profile = load_profile("yellow")
    save_profile(profile, folder / "studio" / name / "trained.npz")
    outcome = Outcome(profile.training_hash, 6, (), 1.0, 1.0, (), Verdict(Judged.ALONE))
    (folder / "studio" / name / "trained.json").write_bytes(msgspec.json.encode(outcome))


@in_real_time
async def test_an_operator_learns_and_an_admin_installs_under_his_own_name(tmp_path: Path) -> None:
    keys = with_people(tmp_path)
    with_outcome(tmp_path, "hall")
    at = "/api/studio/sets"
    install = {"training_hash": load_profile("yellow").training_hash, "who": "somebody else"}
    async with served(folder=tmp_path, state=tmp_path, login=True) as station:

        async def status(role: Role, path: str, said: object) -> tuple[int, str]:
            headers = {"Authorization": f"Bearer {keys[role]}", **JSON}
            return await station.ask("POST", path, headers, json.dumps(said).encode())

        new = {"name": "new", "paint": "#7A3FA0"}
        assert (await status(Role.VIEWER, at, new))[0] == 403
        assert (await status(Role.OPERATOR, at, new))[0] == 200
        assert PictureSets(tmp_path).read("new").paint == "#7a3fa0"
        for path, said in (
            (f"{at}/hall/install", install),
            ("/api/studio/profiles/hall/back", {"version": 1}),
        ):
            assert (await status(Role.OPERATOR, path, said))[0] == 403
            code, text = await status(Role.ADMIN, path, said)
            assert code == 200, text
            assert [one["who"] for one in json.loads(text)["versions"]] == ["program-admin"]
    lines = [(line["person"], line["outcome"], line["text"]) for line in audited(tmp_path)]
    assert ("program-operator", "accepted", "made the set new; HTTP 200") in lines
    assert ("program-admin", "accepted", "version 1 installed, alone; HTTP 200") in lines
    assert ("program-admin", "accepted", "version 1 taken back; HTTP 200") in lines


class Hasty(Studio):
    """What was trained is replaced by the shipped white: `at_once`, when its score was read, or once the file
    was read, too."""

    def __init__(self, folder: Path, *, at_once: bool) -> None:
        super().__init__(folder, Flights(None))
        self.at_once = at_once

    async def outcome_of(self, name: str) -> Outcome | None:
        outcome = await super().outcome_of(name)
        trained = self.sets.folder_of(name) / "trained.npz"
        if self.at_once:
            save_profile(load_profile("white"), trained)
        else:
            reads = self.disk.run

            async def replaced(function: Any, *args: Any) -> Any:
                got = await reads(function, *args)
                save_profile(load_profile("white"), trained)
                return got

            setattr(self.disk, "run", replaced)  # noqa: B010 - a method, for once
        return outcome


@in_real_time
async def test_who_looks_round_has_the_code_read_that_looks_at_pictures(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = asyncio.Event()
    run = ReadingProcess.run

    async def watched(self: ReadingProcess, function: Any, *args: Any) -> Any:
        answer = await run(self, function, *args)
        if function is get_ready:
            done.set()
        return answer

    monkeypatch.setattr(ReadingProcess, "run", watched)
    async with served(folder=folder) as station:
        await got(station, "/api/studio")
        async with Within(120.0):
            await done.wait()


@in_real_time
async def test_no_profile_is_installed_under_the_score_of_another(tmp_path: Path) -> None:
    yellow = load_profile("yellow").training_hash
    for at_once in (True, False):
        name, flies = f"hall-{at_once}".lower(), tmp_path / "profiles" / f"hall-{at_once}.npz".lower()
        with_outcome(tmp_path, name)
        studio = Hasty(tmp_path, at_once=at_once)
        running = asyncio.ensure_future(studio.run())
        try:
            if at_once:
                with pytest.raises(RunError, match="trained anew meanwhile"):
                    await studio.install(name, yellow, "Ann", again=False)
                assert not flies.exists()
                (tmp_path / "studio" / name / "trained.npz").write_bytes(b"PK spoilt")
                studio.at_once = False
                with pytest.raises(InputError, match=r"trained\.npz: not a colour profile"):
                    await studio.install(name, yellow, "Ann", again=False)
            else:
                await studio.install(name, yellow, "Ann", again=False)
                assert load_profile(flies).training_hash == yellow
        finally:
            running.cancel()
            await asyncio.wait([running])


@in_real_time
async def test_spoilt_versions_of_one_profile_leave_the_others_alone(tmp_path: Path) -> None:
    install = {"training_hash": load_profile("yellow").training_hash, "who": "Ann"}
    async with served(folder=tmp_path) as station:
        for name in ("good", "spoilt"):
            with_outcome(tmp_path, name)
            assert (await post(station, f"/api/studio/sets/{name}/install", install))[0] == 200
        (tmp_path / "profiles" / "spoilt" / "versions.json").write_bytes(b'[{"number": 1')
        profiles = (await got(station, "/api/studio"))["profiles"]
        assert [(one["name"], one["current"], bool(one["trouble"])) for one in profiles] == [
            ("good", 1, False),
            ("spoilt", None, True),
        ]
        assert profiles[1]["trouble"].startswith("profiles/spoilt/versions.json: ")
        assert (await got(station, "/api/studio/sets/spoilt"))["profile"] == profiles[1]
        assert (await post(station, "/api/studio/sets/good/install", install))[1]["current"] == 1
        for path, said in (("sets/spoilt/install", install), ("profiles/spoilt/back", {"version": 1})):
            code, answer = await post(station, f"/api/studio/{path}", said)
            assert (code, answer["refused"]) == (400, profiles[1]["trouble"])


class TwoSites(Flights):
    def site_of(self, log_id: str) -> str:
        return log_id[:1]


def test_flights_of_one_site_are_scored_on(tmp_path: Path) -> None:
    studio = Studio(tmp_path, TwoSites(None))
    with pytest.raises(InputError, match=r"flights of several sites \(a, b\); take those of one"):
        studio.order_training("hall", ("b1", "a1", "a2"))
    assert studio.training_of("hall") is None
    studio.order_training("hall", ("a1", "a2"))
    assert studio.training_of("hall") is not None


async def photographs_are_taken_in(station: Station) -> None:
    """What is none is refused; a set of them is looked through for a board."""
    headers = {"Content-Type": "application/octet-stream"}
    await post(station, "/api/studio/sets", {"name": "photos", "paint": "orange"})
    at = "/api/studio/sets/photos/uploads"
    own = {"Origin": station.origin, **headers}
    picture = cv2.imencode(".png", np.full((90, 160, 3), 120, np.uint8))[1].tobytes()
    code, text = await station.ask("POST", at, own, picture, 90.0)
    assert code == 200
    path = f"/api/studio/sets/photos/pictures/{json.loads(text)['file']}"
    known = await got(station, "/api/studio/sets/photos")
    assert [(one["width"], one["height"]) for one in known["pictures"]] == [(160, 90)]
    for data in (b"", b"no picture", picture[:40]):
        code, text = await station.ask("POST", at, own, data, 90.0)
        assert code == 400, text
        assert "picture" in json.loads(text)["refused"]
    study = await got(station, "/api/studio/sets/photos/boards?columns=9&rows=6")
    assert (study["pictures"], study["boards"]) == (1, [])
    assert "8 are needed" in study["refused"]
    for sides in ("columns=2&rows=6", "columns=9", "columns=0040000&rows=6", "columns=x&rows=6"):
        code, text = await station.ask("GET", f"/api/studio/sets/photos/boards?{sides}")
        assert (code, "3 to 40 inner corners" in text) == (404, True)
    assert (await post(station, path, None, "DELETE"))[0] == 200
    assert (await got(station, "/api/studio/sets/photos"))["pictures"] == []


@in_real_time
async def test_bad_input_gets_one_clear_line(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async with served(folder=folder) as station:
        files = await marked_set(station, "bad", "yellow", 1, marks=False)
        at, flight = "/api/studio/sets", (await flight_of(station))[0]
        one = f"{at}/bad/pictures/{files[0]}"
        stroke = {"paint": True, "stroke": [[0, 0]] * 5001}
        for method, path, said, status, words in (
            ("POST", at, {"name": "../x", "paint": "yellow"}, 400, "no name of a set"),
            ("POST", at, {"name": "bad", "paint": "yellow"}, 400, "already"),
            ("POST", at, {"name": "x", "paint": "mauve"}, 400, "#rrggbb"),
            ("POST", at, {"name": "x"}, 400, "not a new set"),
            ("POST", f"{at}/none/pictures", {"flight": flight, "place": 0}, 400, "no set"),
            ("POST", f"{at}/bad/pictures", {"flight": "nothing", "place": 0}, 400, "no such flight"),
            ("POST", f"{at}/bad/pictures", {"flight": flight, "place": 10**6}, 400, "no such picture"),
            ("PUT", f"{at}/bad/pictures/labels.json", {}, 400, "no such picture"),
            ("PUT", one, {"regions": [{"paint": True, "box": [0, 0, 1e9, 1]}]}, 400, "outside"),
            ("PUT", one, {"regions": [{"paint": True, "width": float("nan")}]}, 400, "not marks"),
            ("PUT", one, {"lines": [{"x1": 0, "y1": 0, "x2": 0, "y2": 0}]}, 400, "without length"),
            ("PUT", one, {"regions": [stroke]}, 400, "5000 points"),
            ("POST", f"{at}/bad/install", {"training_hash": "x", "who": "Ann"}, 400, "nothing was trained"),
            ("POST", f"{at}/bad/install", {"training_hash": "x", "who": " "}, 400, "say who you are"),
            ("POST", "/api/studio/profiles/bad/back", {"version": 3}, 400, "no version 3"),
        ):
            code, answer = await post(station, path, said, method)
            assert (code, words in answer["refused"]) == (status, True), (path, said, answer)
        code, text = await station.ask("GET", f"{one}/mask?by=mauve")
        assert (code, json.loads(text)["refused"]) == (404, "there is no profile 'mauve'")
        code, text = await station.ask("GET", f"{one}/mask?by=strokes", within_s=90.0)
        assert code == 404
        code, text = await station.ask("PUT", one, JSON, b"{}")
        assert code == 403  # without the page's own origin
        code, text = await station.ask("GET", f"{at}/bad/pictures/..%2Flabels.json")
        assert code == 404
        monkeypatch.setattr(studio_module, "missing_training", lambda: "training needs scikit-learn")
        code, answer = await post(station, f"{at}/bad/train", {})
        assert code == 503
        assert "extra train" in answer["refused"]
        assert "pip install" in answer["refused"]
        await photographs_are_taken_in(station)


def test_marks_of_a_line_lie_on_it_and_beside_it() -> None:
    """The rig's own promise."""
    told = marks_of([{"points": [[0.5, 0.0], [0.5, 1.0]]}])
    assert told["regions"][0]["stroke"] == [[320.0, 0.0], [320.0, 360.0]]
    assert told["regions"][1]["stroke"] == [[230.0, 0.0], [230.0, 108.0]]
