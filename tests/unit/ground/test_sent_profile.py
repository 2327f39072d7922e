"""A colour profile that the ground sends to a drone: beside its settings, named there, and taken back."""

from __future__ import annotations

import hashlib
import tomllib
from importlib import resources
from pathlib import Path
from typing import Any

import msgspec
import pytest

from flightd.adapters.ground_link.messages.base import VERSION
from flightd.adapters.ground_link.messages.maintenance import InstallProfile, TakeSettingsBack
from flightd.adapters.store.sent_profiles import sent_name
from flightd.adapters.store.settings_file import SettingsFile, tag_of
from flightd.app.maintenance.settings import DroneSettings
from flightd.config.schema import load_config
from flightd.core.errors import InputError, RunError
from tests.rigs.event_loops import in_real_time

SITE = Path(__file__).parents[3] / "configs" / "site-demo.toml"
YELLOW, RED = (
    (resources.files("flightd.vision.lines") / "profiles" / f"{paint}.npz").read_bytes()
    for paint in ("yellow", "red")
)


class Checked(DroneSettings):
    """Whose check as a whole finds what it is told to, and whether the profile's file lies there by then."""

    finds: InputError | None = None

    async def _check_whole(self, text: str) -> None:
        profile = tomllib.loads(text)["vision"]["profile"]
        assert profile == "red" or (self._file.path.parent / profile).is_file()
        if self.finds is not None:
            raise self.finds


class Drone:
    def __init__(self, folder: Path) -> None:
        (folder / SITE.name).write_text(SITE.read_text())
        self.folder = folder
        self.file = folder / "flightd.toml"
        self.file.write_text(
            f'[mission]\nsite = "{SITE.name}"\n\n[camera]\nurl = "device:/dev/video0"\nfx_px = 400.0\n'
            'fy_px = 400.0\n\n[vehicle]\nurl = "udpin://127.0.0.1:14550"\n\n[vision]\n'
            'profile = "red"  # by hand\n'
        )
        kept = SettingsFile(self.file)
        self.settings = Checked(kept, kept.read(), restarts=True, unfit=tuple)

    async def send(self, content: bytes, **wrong: Any) -> str:
        request = InstallProfile(
            version=VERSION,
            id="send-00001",
            base=tag_of(self.file.read_text()),
            name="hall",
            content=content,
            file_hash=hashlib.sha256(content).hexdigest(),
            person="Ann",
        )
        return await self.settings.install_profile(msgspec.structs.replace(request, **wrong), "station")

    @property
    def profile(self) -> str:
        return str(tomllib.loads(self.file.read_text())["vision"]["profile"])

    @property
    def sent(self) -> list[str]:
        return sorted(path.name for path in self.folder.glob("*.npz"))


@in_real_time
async def test_a_profile_is_flown_by_from_the_next_start_and_taken_back(tmp_path: Path) -> None:
    drone = Drone(tmp_path)
    first, second = sent_name("hall", YELLOW), sent_name("hall", RED)
    assert await drone.send(YELLOW) == f"settings changed: vision.profile red -> {first}"
    assert (drone.profile, (tmp_path / first).read_bytes()) == (first, YELLOW)
    assert "# by hand" in drone.file.read_text()
    assert load_config(drone.file).vision.profile == str(tmp_path / first)
    assert await drone.send(YELLOW) == f"vision.profile is {first} already"
    await drone.send(RED)
    assert drone.sent == sorted([first, second])

    told = await drone.settings.answer("look-0001")
    assert [(one.number, one.person) for one in told.versions] == [(2, "Ann"), (1, "Ann")]
    back = TakeSettingsBack(version=VERSION, id="back-0001", base=told.tag, version_kept=2, person="Ann")
    await drone.settings.take_back(back, "station")
    assert load_config(drone.file).vision.profile == str(tmp_path / first)
    told = await drone.settings.answer("look-0002")
    back = msgspec.structs.replace(back, base=told.tag, version_kept=1)
    await drone.settings.take_back(back, "station")
    assert drone.profile == "red"


@in_real_time
async def test_what_is_refused_leaves_neither_file_nor_setting(tmp_path: Path) -> None:
    drone = Drone(tmp_path)
    before = drone.file.read_text()
    for kind, words, content, wrong in (
        (RunError, "changed meanwhile", YELLOW, {"base": "another"}),
        (InputError, "not the one of its hash", YELLOW, {"file_hash": "00"}),
        (InputError, "profile hall: not a colour profile", YELLOW[:900], {}),
        (InputError, "profile hall: not a colour profile", b"", {}),
    ):
        with pytest.raises(kind, match=words):
            await drone.send(content, **wrong)
    drone.settings.finds = InputError("the site has gone")
    with pytest.raises(InputError, match="the site has gone"):
        await drone.send(YELLOW)
    assert (drone.file.read_text(), drone.sent) == (before, [])
