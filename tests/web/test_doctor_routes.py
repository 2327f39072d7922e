"""What the station answers to the page Doctor without a drone, and what it judges by itself."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import msgspec
import pytest

from flightd.adapters.ground_link.client import Address
from flightd.adapters.ground_link.maintenance_rules import changes_something
from flightd.adapters.ground_link.messages.maintenance import Maintenance, SettingsAnswer
from flightd.adapters.ground_link.peer import Peer
from flightd.adapters.ground_link.protocol import Answer
from flightd.app.maintenance.settings import key_reports, new_errors
from flightd.core.errors import RunError, UnavailableError
from flightd.core.types import Phase
from flightd.ground.access.roles import Role
from flightd.ground.doctor.known_settings import KnownSettings
from flightd.ground.studio.profile_shelf import ProfileShelf
from flightd.runtime.within import Within
from tests.rigs.event_loops import in_real_time
from tests.rigs.ground_link import address_of, local, serving, telling
from tests.rigs.waiting import until
from tests.web.people_rig import audited, sign_in, with_people
from tests.web.served import JSON, served

NOBODY = ("demo", Address("127.0.0.1", 1, 1))
PROPOSAL = {"base": "x", "changes": {"mission.height_m": 1.5}, "person": "Ann"}


def told(tag: str) -> SettingsAnswer:
    return SettingsAnswer(
        request="12345678",
        file="flightd.toml",
        tag=tag,
        table={"mission": {"site": "site.toml"}},
        keys=key_reports(),
        sections={},
        versions=(),
        pending=False,
        locked="",
        restarts=False,
    )


class NotingDrone:
    """Answers each request with its settings, and keeps what is to be changed."""

    def __init__(self) -> None:
        self.changed: list[tuple[str, str]] = []

    async def serve(self, request: Maintenance, peer: Peer) -> Answer:
        if changes_something(request):
            self.changed.append((type(request).__name__, request.person))  # type: ignore[union-attr]
        settings = told("now")
        camera = {"url": "stream:rtsp://eye:secret@10.0.0.2/down"}
        table = {**settings.table, "camera": camera}
        return msgspec.structs.replace(settings, request=request.id, table=table)


@in_real_time
async def test_everybody_looks_and_an_admin_changes_under_his_own_name(tmp_path: Path) -> None:
    keys, drone = with_people(tmp_path), NotingDrone()
    shelved = ProfileShelf(tmp_path).install("hall", b"a profile", "ann", "yellow", ("", "alone"))
    file_hash = shelved.versions[0].file_hash
    async with (
        serving(local(), maintainer=drone) as link,
        served(("demo", address_of(link)), folder=tmp_path, state=tmp_path, login=True) as station,
        telling(link, Phase.PREFLIGHT),
    ):
        await until(lambda: link.requests > 2)
        bears = {role: {"Authorization": f"Bearer {keys[role]}", **JSON} for role in Role}
        bodies: dict[str, dict[str, object]] = {
            "settings": {"base": "now", "changes": {"mission.height_m": 1.5}, "person": "ann"},
            "take-back": {"base": "now", "version": 1, "person": "ann"},
            "profile": {"base": "now", "profile": "hall", "file_hash": file_hash, "person": "ann"},
        }
        for role in Role:
            status, text = await station.ask("GET", "/api/doctor/demo/settings", bears[role])
            is_shown = "eye:secret@" in text
            assert (status, is_shown) == (200, role is Role.ADMIN)
            assert json.loads(text)["table"]["camera"]["url"].endswith("@10.0.0.2/down")
            typed = json.dumps({"base": "now", "changes": {"mission.height_m": 50}}).encode()
            status, text = await station.ask("POST", "/api/doctor/demo/check", bears[role], typed)
            assert (status, "outside" in json.loads(text)["complaint"]) == (200, True)
            for path in ("fix", "settings", "take-back", "profile", "restart"):
                if role is Role.ADMIN and path not in bodies:
                    continue
                body = json.dumps(bodies.get(path, {})).encode()
                status, _ = await station.ask("POST", f"/api/doctor/demo/{path}", bears[role], body)
                assert (status == 403) == (role is not Role.ADMIN), (role, path)
        for wrong, code, words in (
            ({"file_hash": "00"}, 409, "another version was installed meanwhile"),
            ({"profile": "attic"}, 400, "no profile attic is installed"),
            ({"profile": "../hall"}, 400, "not a profile to be sent"),
        ):
            body = json.dumps({**bodies["profile"], **wrong}).encode()
            status, text = await station.ask("POST", "/api/doctor/demo/profile", bears[Role.ADMIN], body)
            assert (status, words in json.loads(text)["refused"]) == (code, True), text
        own = {"Cookie": await sign_in(station, "ada"), "Origin": station.origin, **JSON}
        body = json.dumps(bodies["settings"]).encode()
        assert (await station.ask("POST", "/api/doctor/demo/settings", own, body))[0] == 200
    assert drone.changed == [
        ("ProposeSettings", "program-admin"),
        ("TakeSettingsBack", "program-admin"),
        ("InstallProfile", "program-admin"),
        ("ProposeSettings", "ada"),
    ]
    lines = [line for line in audited(tmp_path) if line["target"].startswith("/api/doctor")]
    assert {line["outcome"] for line in lines if line["role"] != "admin"} == {"refused"}
    assert lines[-1]["text"] == "mission.height_m; HTTP 200"


@in_real_time
async def test_what_no_page_of_ours_asks_is_refused_in_words() -> None:
    async with served(NOBODY) as station:
        own = {"Origin": station.origin, **JSON}

        async def post(path: str, body: bytes, headers: dict[str, str] = own) -> tuple[int, str]:
            return await station.ask("POST", f"/api/doctor/demo/{path}", headers, body)

        body = json.dumps(PROPOSAL).encode()
        assert (await post("settings", body))[0] == 503, "no drone is there"
        assert (await post("settings", body, JSON))[0] == 403, "no Origin"
        assert (await post("settings", body, {"Origin": "http://evil.example", **JSON}))[0] == 403
        assert (await post("settings", body, {"Origin": station.origin}))[0] == 400, "a form of another site"
        for wrong in (b"", b"[]", b'{"base":1}', body[:-1], b'{"base":"x","changes":{"a":{}}}', b"x" * 9000):
            status, text = await post("settings", wrong)
            assert status == 400
            assert json.loads(text)["refused"]
        assert (await post("check", json.dumps({"base": "x", "changes": {}}).encode()))[0] == 409
        assert (await station.ask("GET", "/api/doctor/nobody/report"))[0] == 404
        assert (await station.ask("GET", "/api/doctor/demo/report"))[0] == 503
        assert (await station.ask("PUT", "/api/doctor/demo/settings", own, body))[0] == 405
        status, text = await station.ask("GET", "/api/doctor")
        assert status == 200
        assert json.loads(text)["versions"].keys() >= {"flightd", "Python", "starlette"}
        assert json.loads(text)["audit_lost"] == 0


@in_real_time
async def test_lines_of_the_audit_that_the_disk_refuses_are_told(tmp_path: Path) -> None:
    (tmp_path / "audit.jsonl").symlink_to("/dev/full")
    async with served(NOBODY, state=tmp_path) as station:
        for at in range(3):
            assert (await station.act("demo", id=f"stop-{at}-of-3", command="stop"))[0] == 503

        async def lost() -> int:
            return int(json.loads((await station.ask("GET", "/api/doctor"))[1])["audit_lost"])

        async with Within(20):
            while await lost() < 3:  # noqa: ASYNC110 - its thread tells nobody
                await asyncio.sleep(0.02)


def test_what_is_typed_is_judged_against_what_the_drone_told_last() -> None:
    known = KnownSettings()
    known.note("demo", told("now"))
    assert known.complaint("demo", "now", {"mission.height_m": 1.5}) == ""
    said = known.complaint("demo", "now", {"mission.height_m": 50})
    assert said == "mission.height_m: 50 is outside 0.5 to 20 m"
    assert "on the drone itself" in known.complaint("demo", "now", {"ground.listen": ""})
    for drone, tag in (("demo", "before"), ("other", "now")):
        with pytest.raises(RunError, match="changed meanwhile"):
            known.complaint(drone, tag, {"mission.height_m": 1.5})


def test_only_errors_that_a_proposal_brings_speak_against_it() -> None:
    checks = [
        {"name": name, "level": level, "text": "so it is"}
        for name, level in (("disk", "error"), ("ground", "error"), ("memory", "error"), ("cpu", "warning"))
    ]
    assert new_errors(json.dumps({"checks": checks}).encode(), {"memory"}) == ["disk: so it is"]
    for nothing in (b"", b"{}", b"[1]", b'{"checks": [{}]}'):
        with pytest.raises(UnavailableError):
            new_errors(nothing, set())
