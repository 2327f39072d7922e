"""A drone that stands and is looked after from the ground: `flightd run` as its service runs it, beside a
simulated vehicle."""

from __future__ import annotations

import json
from importlib import resources
from pathlib import Path

import pytest

from flightd.adapters.ground_link.client import GroundClient
from flightd.adapters.store.sent_profiles import sent_name
from flightd.core.errors import InputError, RunError
from flightd.runtime.within import Within
from tests.rigs.event_loops import in_real_time
from tests.rigs.service import ServiceRig


@pytest.mark.slow
@in_real_time
async def test_a_standing_drone_is_looked_after_from_the_ground(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, ("A2",), fps=5.0)
    text = rig.config.read_text().replace("autostart = true", "autostart = false  # a person starts it")
    text = text.replace("[ground]", f'[ground]\naudit = "{tmp_path / "audit.jsonl"}"')
    rig.config.write_text(text)
    async with rig.world(GUID_TIMEOUT=3.0):
        daemon = await rig.start()
        await rig.until(lambda status: status.vehicle is not None)
        async with GroundClient(rig.address, timeout_s=60.0) as client, Within(240):
            await client.hello()
            report = await client.doctor()
            while all(check.fix != "GUID_TIMEOUT" for check in report.checks):
                report = await client.doctor()  # until it has read them all
            assert not report.fit
            assert {check.name for check in report.checks if check.level == "unseen"} >= {"camera", "delay"}
            assert report.versions.keys() >= {"flightd", "firmware (ardupilot)", "Python", "numpy"}

            report = await client.fix("GUID_TIMEOUT", "ann")
            assert report.outcome.startswith("GUID_TIMEOUT was 3, now reads ")
            assert all(check.fix != "GUID_TIMEOUT" for check in report.checks)
            with pytest.raises(InputError, match="nothing to set right"):
                await client.fix("GUID_TIMEOUT")
            assert any("maintenance: GUID_TIMEOUT was 3" in line for line in report.log)

            stands = await client.settings()
            assert (stands.locked, stands.pending, stands.restarts, stands.versions) == ("", False, True, ())
            with pytest.raises(InputError, match="the service would not start by them"):
                await client.propose(stands.tag, {"recorder.reserve_gb": 90000.0})
            assert rig.config.read_text() == text

            changed = await client.propose(stands.tag, {"mission.height_m": 1.5, "scan.pictures": 4}, "ann")
            assert changed.pending
            assert "# a person starts it" in rig.config.read_text()
            assert changed.table["mission"]["height_m"] == 1.5
            with pytest.raises(RunError, match="changed meanwhile"):
                await client.propose(stands.tag, {"mission.height_m": 1.4})
            profile = (resources.files("flightd.vision.lines") / "profiles" / "white.npz").read_bytes()
            sent = await client.install_profile(changed.tag, "hall", profile, "ann")
            file = sent_name("hall", profile)
            assert (sent.table["vision"]["profile"], (tmp_path / file).read_bytes()) == (file, profile)
            with pytest.raises(InputError, match="not a colour profile"):
                await client.install_profile(sent.tag, "hall", profile[:900])
            await client.restart("ann")
            assert await daemon.wait() == 0
        again = await rig.start()
        await rig.until(lambda status: status.vehicle is not None)
        async with GroundClient(rig.address, timeout_s=60.0) as client, Within(60):
            await client.hello()
            stands = await client.settings()
            assert (stands.pending, [version.person for version in stands.versions]) == (False, ["ann"] * 2)
            keys = [[change.key for change in version.changes] for version in stands.versions]
            assert keys == [["vision.profile"], ["mission.height_m", "scan.pictures"]]
        again.terminate()
        assert await again.wait() == 143
    assert not (tmp_path / ".flightd.toml.proposed").exists()
    audit = [json.loads(line) for line in (tmp_path / "audit.jsonl").read_text().splitlines()]
    assert [(entry["command"], entry["outcome"]) for entry in audit] == [
        ("fix", "accepted"),
        ("fix", "invalid"),
        ("propose", "invalid"),
        ("propose", "accepted"),
        ("propose", "phase"),
        ("install_profile", "accepted"),
        ("install_profile", "invalid"),
        ("restart", "accepted"),
    ]
    assert "by ann" in audit[0]["text"]
