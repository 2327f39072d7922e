"""The routes of the page Site, asked as a browser would and as none should."""

from __future__ import annotations

import json
import stat
import threading
from pathlib import Path
from typing import Any

import pytest

from flightd.core.errors import FlightdError, InputError, RunError
from flightd.ground.site_page.site_files import VERSIONS, SiteFiles
from flightd.site.site_file import load_site
from tests.rigs.event_loops import real
from tests.web.served import JSON, Station, served

CONFIGS = Path(__file__).parents[2] / "configs"
TEXT = (CONFIGS / "site-racks-small.toml").read_text()
CAMERA = {"fov_deg": 25.0, "width_px": 1280, "exposure_ms": 2.0, "module_mm": 3.0, "speed_mps": 0.3}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "north").mkdir()
    (tmp_path / "north" / "hall.toml").write_text(TEXT)
    return tmp_path


async def sent(
    station: Station, path: str, message: Any, verb: str = "POST", **headers: str
) -> tuple[int, dict[str, Any]]:
    body = message if isinstance(message, bytes) else json.dumps(message).encode()
    status, text = await station.ask(
        verb, f"/api/site{path}", {"Origin": station.origin, **JSON, **headers}, body
    )
    return status, json.loads(text)


async def opened(station: Station, name: str = "north/hall.toml") -> dict[str, Any]:
    """A file as the page opens it.  The first question starts the working process, which may take a while."""
    host = station.origin.removeprefix("http://")
    request = f"GET /api/site/file?name={name} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n"
    answer = await station.say(request.encode(), within_s=60.0)
    told: dict[str, Any] = json.loads(answer.partition(b"\r\n\r\n")[2])
    return told


def test_a_map_is_listed_opened_checked_and_saved_over_its_own_version_only(folder: Path) -> None:
    (folder / "sim.toml").write_text('[mission]\nsite = "hall.toml"\n')
    (folder / "link.toml").symlink_to(folder / "north" / "hall.toml")
    file = folder / "north" / "hall.toml"
    file.chmod(0o640)

    async def go() -> None:
        async with served(folder=folder) as station:
            _, text = await station.ask("GET", "/api/site")
            assert [one["name"] for one in json.loads(text)["sites"]] == ["north/hall.toml"]
            told = await opened(station)
            draft = told["draft"]
            status, checked = await sent(station, "/check", {"draft": draft, "camera": CAMERA})
            assert status == 200
            assert checked["sound"]
            assert checked["facts"]["locations"] == 48
            assert checked["coverage"]["unseen"] == len(checked["coverage"]["lost"]) == 48
            gaps = [one for one in checked["findings"] if one.get("aisle") == "B"]
            assert gaps
            assert gaps[0]["kind"] == "problem"
            draft["lists"]["aisle"][1]["values"]["y_m"] = 2
            draft["lists"]["rack"][0]["values"]["levels_m"] = ["low"]
            _, checked = await sent(station, "/check", {"draft": draft})
            assert {(one["table"], one["index"], one["field"]) for one in checked["findings"]} == {
                ("rack", 0, "levels_m")
            }
            status, refused = await sent(
                station, "/file?name=north/hall.toml", {"draft": draft, "stamp": told["stamp"]}, "PUT"
            )
            assert status == 400
            assert "not saved: rack[0].levels_m[0]" in refused["refused"]
            del draft["lists"]["rack"][0]
            _, checked = await sent(station, "/check", {"draft": draft})
            assert checked["findings"][0]["index"] == 1, "it is aisle B that lies too near"
            draft["lists"]["aisle"][1]["values"]["y_m"] = 4
            save = {"draft": draft, "stamp": told["stamp"]}
            status, saved = await sent(station, "/file?name=north/hall.toml", save, "PUT")
            assert status == 200
            assert saved["stamp"] != told["stamp"]
            assert "y_m = 4.0" in file.read_text()
            assert stat.S_IMODE(file.stat().st_mode) == 0o640
            status, again = await sent(station, "/file?name=north/hall.toml", save, "PUT")
            assert status == 409
            assert "changed by somebody else" in again["refused"]
            version = saved["versions"][0]
            _, text = await station.ask("GET", f"/api/site/version?name=north/hall.toml&version={version}")
            assert json.loads(text)["draft"]["text"] == TEXT

    real(go())
    assert load_site(file).aisles[1].y_m == 4.0
    kept = list((folder / "north" / VERSIONS / "hall.toml").iterdir())
    assert [path.read_text() for path in kept] == [TEXT]
    assert not list(folder.rglob("*.new"))


def test_maps_come_in_and_go_out_and_a_new_one_begins(folder: Path) -> None:
    async def go() -> None:
        async with served(folder=folder) as station:
            draft = (await opened(station))["draft"]
            for kind, back in (("lif", "lif"), ("csv", "csv"), ("toml", "toml")):
                _, out = await station.ask(
                    "POST",
                    f"/api/site/export?kind={kind}",
                    {"Origin": station.origin, **JSON},
                    json.dumps(draft).encode(),
                )
                status, told = await sent(station, f"/import?kind={back}", out.encode())
                assert status == 200, told
                assert [one["values"]["id"] for one in told["draft"]["lists"]["aisle"]] == ["A", "B"]
                status, checked = await sent(station, "/check", {"draft": told["draft"]})
                assert checked["sound"]
            new = {"name": "n", "aisles": 3, "nodes": 4, "spacing_m": [1.5], "pitch_m": 2.0}
            status, told = await sent(station, "/new", new)
            assert status == 400
            assert "their shelves need 2.4 m" in told["refused"]
            status, told = await sent(station, "/new", {**new, "pitch_m": 3})
            assert status == 200
            status, told = await sent(station, "/file?name=new.toml", {"draft": told["draft"]}, "PUT")
            assert status == 200
            status, told = await sent(station, "/file?name=new.toml", {"draft": told["draft"]}, "PUT")
            assert status == 409
            assert "new.toml is there already" in told["refused"]

    real(go())
    assert len(load_site(folder / "new.toml").aisles) == 3


def test_what_is_no_map_and_what_is_no_name_is_refused_in_a_line(folder: Path) -> None:
    (folder / "bad.toml").write_text("[site]\nname = \n[[aisle]]\n")
    (folder / "odd.toml").write_bytes(b"[site]\n[[aisle]]\n\xff")

    async def go() -> None:
        async with served(folder=folder) as station:
            own = {"Origin": station.origin, **JSON}
            other = {**own, "Origin": "http://evil"}
            good = (await opened(station))["draft"]
            for path in ("file?name=../x.toml", "file?name=", "file?name=bad.toml", "file?name=odd.toml",
                         "version?name=north/hall.toml&version=../../hall", "version?name=x"):  # fmt: skip
                status, text = await station.ask("GET", f"/api/site/{path}")
                assert status == 404, path
                assert json.loads(text)["refused"], path
            bad = {**good, "lists": {"aisle": [{"values": {"id": "A"}, "at": 7}]}}
            for path, message in (
                ("/check", b"{"), ("/check", {"draft": 3}), ("/check", {"draft": good, "camera": {}}),
                ("/check", {"draft": {**good, "lists": {"other": []}}}), ("/new", {"name": ""}),
                ("/new", {"name": "x", "aisles": 2, "nodes": 2, "spacing_m": [], "pitch_m": 3}),
                ("/export?kind=dwg", good), ("/export?kind=toml", bad), ("/export?kind=lif", bad),
                ("/import?kind=lif", b"[[" * 100_000), ("/import?kind=lif", b"\xff"),
                ("/import?kind=csv", b"\0"),
                ("/import?kind=dwg", b""), ("/import?kind=toml", b"[" * 5_000),
            ):  # fmt: skip
                status, told = await sent(station, path, message)
                assert status == 400, (path, told)
                assert "\n" not in told["refused"]
            for name in ("", "..toml", "a/b.toml", ".hidden.toml", "x.txt", "x\0.toml", "n" * 90 + ".toml"):
                status, told = await sent(
                    station, f"/file?name={name.replace(chr(0), '%00')}", {"draft": good}, "PUT"
                )
                assert status == 400, name
                assert "no name for a site file" in told["refused"]
            status, _ = await station.ask("POST", "/api/site/check", {"Origin": station.origin}, b"{}")
            assert status == 400
            status, _ = await station.ask("PUT", "/api/site/file?name=y.toml", other, b"{}")
            assert status == 403
            status, text = await station.ask("POST", "/api/site/check", own, b" " * 4_000_001)
            assert "more than 4 MB" in text

    real(go())
    assert sorted(path.name for path in folder.iterdir()) == ["bad.toml", "north", "odd.toml"]


def test_a_station_without_a_folder_says_where_it_cannot_save() -> None:
    files = SiteFiles(None)
    assert files.names() == []
    with pytest.raises(RunError, match="give it --folder DIR"):
        files.create("n.toml", TEXT)


def test_of_many_who_save_at_once_one_wins_and_no_version_is_lost(folder: Path) -> None:
    files = SiteFiles(folder)
    stamp = files.open("north/hall.toml").stamp
    outcomes: list[str] = []

    def save(number: int) -> None:
        try:
            files.save("north/hall.toml", stamp, f"{TEXT}# {number}\n")
            outcomes.append(f"saved {number}")
        except RunError:
            outcomes.append("refused")

    threads = [threading.Thread(target=save, args=(number,)) for number in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    (winner,) = [outcome for outcome in outcomes if outcome != "refused"]
    assert files.open("north/hall.toml").text.endswith(f"# {winner.split()[1]}\n")
    assert [files.version("north/hall.toml", one) for one in files.versions("north/hall.toml")] == [TEXT]


def test_old_versions_are_kept_up_to_a_hundred_and_links_are_not_followed(
    folder: Path, tmp_path: Path
) -> None:
    files = SiteFiles(folder)
    now = files.open("north/hall.toml")
    for number in range(103):
        now = files.save("north/hall.toml", now.stamp, f"{TEXT}# {number}\n")
    versions = files.versions("north/hall.toml")
    assert len(versions) == 100
    assert files.version("north/hall.toml", versions[0]).endswith("# 101\n")
    with pytest.raises(InputError):
        files.save("north/hall.toml", now.stamp, "#" * 1_000_001)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (folder / "b.toml").write_text(TEXT)
    (folder / VERSIONS).symlink_to(elsewhere)
    with pytest.raises(FlightdError, match="no plain folder"):
        files.save("b.toml", files.open("b.toml").stamp, f"{TEXT}#\n")
    assert (folder / "b.toml").read_text() == TEXT
