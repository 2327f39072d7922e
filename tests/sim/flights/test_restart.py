"""Killed in the air: what the vehicle does, what the daemon does when it is started anew, what is lost.

In real time, by processes: nothing less shows it."""

from __future__ import annotations

import asyncio
import contextlib
import math
import os
import signal
import time
from pathlib import Path

import pytest

from flightd.adapters.recorder.mcap_repair import is_whole
from flightd.core.topics import Topic
from flightd.core.types import Event, Phase
from flightd.replay.log import read_log
from flightd.runtime.within import Within
from tests.rigs.event_loops import in_real_time
from tests.rigs.service import ServiceRig

_UP = {Phase.ACQUIRE, Phase.TURN, Phase.FOLLOW, Phase.HOVER, Phase.HOLD}
_FIT = "waiting for the start command"
"""In spite of autostart: what is started anew starts no flight."""
_GUIDED_TIMEOUT_S = 3.0
"""After which the simulated autopilot levels by itself."""


@pytest.mark.realtime
@in_real_time
async def test_killed_in_the_air_the_vehicle_levels_and_the_restart_lands_it(tmp_path: Path) -> None:
    """By an autopilot that somebody has told in flight to wait long for its companion."""
    rig = ServiceRig(tmp_path, ("A3",))
    async with rig.world():
        first = await rig.start()
        await rig.until(lambda status: status.phase in _UP, 120)
        assert [message for message in rig.said if message.get("READY") == "1"]
        assert [message for message in rig.said if message.get("WATCHDOG") == "1"]
        armed = rig.folder / "run" / "armed"
        assert armed.exists()
        rig.set_parameters(GUID_TIMEOUT=_GUIDED_TIMEOUT_S, FS_GCS_TIMEOUT=10.0)
        await asyncio.sleep(0.2)
        killed_s = rig.kill()
        await first.wait()
        assert armed.exists(), "the vehicle flies on"
        (log,) = rig.flights.rglob("flight.mcap")

        await asyncio.sleep(_GUIDED_TIMEOUT_S + 1.0)
        second = await rig.start()
        phases: list[Phase] = []
        async with Within(60):
            async for status in rig.statuses():
                phases += [status.phase] if status.phase not in phases[-1:] else []
                if Phase.RECOVER not in phases:
                    recovered_s = time.monotonic()
                if status.phase is Phase.LAND:
                    break
            code = await second.wait()
        landed_s = time.monotonic()
        assert phases in ([Phase.PREFLIGHT, Phase.RECOVER, Phase.LAND], [Phase.RECOVER, Phase.LAND])
        assert code == 1, "an aborted mission"
        assert "nobody took over after the restart" in (tmp_path / "stderr").read_text()

        rig.set_parameters(GUID_TIMEOUT=0.5, FS_GCS_TIMEOUT=1.0)
        third = await rig.start()
        waiting = await rig.until(lambda status: status.reason == _FIT or status.phase is not Phase.PREFLIGHT)
        assert waiting.phase is Phase.PREFLIGHT
        assert not armed.exists()
        third.send_signal(signal.SIGTERM)
        assert await asyncio.wait_for(third.wait(), 30) == 128 + signal.SIGTERM

    truth = [(k.stamp_ns * 1e-9, k) for k in rig.truth()]
    alone = [k for at_s, k in truth if killed_s + _GUIDED_TIMEOUT_S + 0.5 < at_s < recovered_s]
    assert alone, "the vehicle was alone in the air"
    assert max(max(abs(k.roll_rad), abs(k.pitch_rad)) for k in alone) < math.radians(4)
    assert all(abs(k.height_m - alone[0].height_m) < 0.5 for k in alone), "it neither climbs nor sinks"
    assert [k for at_s, k in truth if at_s < landed_s][-1].height_m < 0.15, "it stands on the floor"
    assert max(k.height_m for at_s, k in truth if at_s > landed_s) < 0.15, "and stays there"

    assert is_whole(log), "finished by its writer, or mended by the second start"
    cut = read_log(log)
    assert cut.damage == ""
    ticks = [entry.stamp_ns * 1e-9 for entry in cut.entries if entry.topic == Topic.TICK]
    assert killed_s - ticks[-1] < 3.0, "no more than what had not reached the disk is lost"


@pytest.mark.realtime
@in_real_time
async def test_killed_in_the_air_the_vehicle_as_shipped_lands_and_the_restart_leaves_it_alone(
    tmp_path: Path,
) -> None:
    rig = ServiceRig(tmp_path, ("A3",))
    async with rig.world():
        first = await rig.start()
        await rig.until(lambda status: status.phase in _UP, 120)
        killed_s = rig.kill()
        await first.wait()
        await asyncio.sleep(3.0)  # more than its failsafe waits: it is coming down by itself
        second = await rig.start()
        phases: set[Phase] = set()
        async with Within(60):
            async for status in rig.statuses():
                phases.add(status.phase)
                if not phases <= {Phase.PREFLIGHT, Phase.RECOVER} or status.reason == _FIT:
                    break
        # On a slow machine the vehicle stands on the floor before the restarted daemon has looked.
        assert phases <= {Phase.PREFLIGHT, Phase.RECOVER, Phase.PILOT, Phase.LAND, Phase.ABORTED}
        with contextlib.suppress(ProcessLookupError):  # its mission has ended meanwhile
            second.send_signal(signal.SIGTERM)
        await asyncio.wait_for(second.wait(), 30)
        for _ in range(16):
            if rig.truth()[-1].height_m < 0.15:
                break
            await asyncio.sleep(0.5)
    truth = rig.truth()
    heights_m = [k.height_m for k in truth if k.stamp_ns * 1e-9 > killed_s]
    assert max(heights_m) < heights_m[0] + 0.5, "it climbs no longer than GUID_TIMEOUT"
    assert truth[-1].height_m < 0.15


@pytest.mark.realtime
@in_real_time
async def test_every_child_may_be_killed_in_flight(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, ("A2",))
    async with rig.world():
        daemon = await rig.start()
        await rig.until(lambda status: status.phase is Phase.ACQUIRE, 120)
        writers = [pid for pid, command in rig.children().items() if "recorder.writer" in command]
        others = [pid for pid in rig.children() if pid not in writers]
        assert len(writers) == 1
        assert len(others) >= 2, "a detector and the process that forks them"
        os.kill(writers[0], signal.SIGKILL)
        await rig.until(lambda status: status.phase in _UP - {Phase.ACQUIRE}, 120)
        for pid in others:
            os.kill(pid, signal.SIGKILL)
        async with Within(120):
            code = await daemon.wait()
    (log,) = rig.flights.rglob("flight.mcap")
    flight = read_log(log)
    events = [(event.name, event.text) for event in flight.messages(Event)]
    recovered, landed = code == 0, any("-> land: lines lost" in text for _, text in events)
    assert recovered or landed, events  # on a slow machine a new fork server takes longer than it may hold
    assert any(name == "recorder_died" for name, _ in events)
    assert is_whole(log)
    assert rig.truth()[-1].height_m < 0.15
