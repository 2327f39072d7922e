"""The file of what was learnt of the sensors: whose it is, what survives, and what is refused."""

from __future__ import annotations

import asyncio
from pathlib import Path

import numpy as np
import pytest

from flightd.adapters.store.learnt_sensors import learnt_file, load_learnt
from flightd.config.schema import Config, load_config
from flightd.core.errors import InputError
from flightd.core.learnt import Learnt, LearntSensors
from flightd.doctor.calibration import check_learnt
from flightd.doctor.check import CheckLevel
from tests.rigs.event_loops import real

CONFIG = load_config(Path(__file__).parents[3] / "configs" / "sim.toml")
SIGMAS = (0.01, 0.01, 0.02, 0.004, 0.004, 0.006, 0.003, 0.002, 0.01)
LEARNT = LearntSensors(
    (0.001, -0.002, 0.1, 0.017, -0.008, 0.01, -0.031, 0.01, 0.01),
    tuple(np.diag(np.square(SIGMAS)).ravel().tolist()),
)


async def _write(path: Path, config: Config, learnt: LearntSensors) -> None:
    file = learnt_file(path, config)
    task = asyncio.ensure_future(file.run())
    file.put(learnt)
    await asyncio.sleep(0.01)
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)


def kept(path: Path, config: Config = CONFIG, learnt: LearntSensors = LEARNT) -> Path:
    real(_write(path, config, learnt))
    return path


def test_what_was_learnt_is_read_again_number_for_number(tmp_path: Path) -> None:
    path = tmp_path / "state" / "sensors.json"
    assert load_learnt(path, CONFIG) is None
    assert load_learnt(kept(path), CONFIG) == LEARNT
    assert [file.name for file in path.parent.iterdir()] == ["sensors.json"]


def test_of_a_version_that_learnt_something_else_it_says_nothing(tmp_path: Path) -> None:
    older = LearntSensors(LEARNT.means[:7], tuple(np.eye(7).ravel().tolist()))
    assert load_learnt(kept(tmp_path / "sensors.json", learnt=older), CONFIG) is None


@pytest.mark.parametrize(
    "changed",
    [
        {"camera": {"latency_s": 0.09}},
        {"camera": {"mount_roll_deg": 1.0}},
        {"camera": {"url": "device:/dev/video2"}},
        {"vehicle": {"url": "serial:/dev/ttyAMA0:921600"}},
    ],
)
def test_of_another_camera_mount_or_vehicle_it_says_nothing(
    changed: dict[str, dict[str, object]], tmp_path: Path
) -> None:
    path, other = kept(tmp_path / "sensors.json"), CONFIG.with_values(**changed)
    assert load_learnt(path, other) is None
    assert load_learnt(kept(path, other), other) == LEARNT


@pytest.mark.parametrize("rubbish", ["", "{", "[]", '{"sensors": {}}', "numbers", "shape", "covariance"])
def test_rubbish_is_refused_with_the_files_name(rubbish: str, tmp_path: Path) -> None:
    path = kept(tmp_path / "sensors.json")
    good = path.read_text()
    spoilt = {
        "numbers": good.replace("0.017", "NaN"),
        "shape": good.replace("0.017,", ""),
        "covariance": good.replace("1.6e-05", "-1.6e-05"),
    }
    path.write_text(spoilt.get(rubbish, rubbish))
    assert path.read_text() != good
    with pytest.raises(InputError, match=r"sensors\.json.*delete it"):
        load_learnt(path, CONFIG)


def test_the_doctor_tells_it_and_what_to_configure(tmp_path: Path) -> None:
    path = tmp_path / "sensors.json"
    config = CONFIG.with_values(tracking={"learnt": path})
    assert check_learnt(CONFIG) == []
    assert [check.level for check in check_learnt(config)] == [CheckLevel.OK]
    kept(path, config)
    (check,) = check_learnt(config)
    assert check.level is CheckLevel.WARNING
    assert "delay +31 ms (sigma 4)" in check.text, "3 ms, and 2 ms that no line tells"
    assert "mount roll +1.0 pitch -0.5 deg (sigma 0.2) yaw +0.6 (sigma 0.3)" in check.text
    assert "attitude +0.1 -0.1 deg (sigma 0.6), focal length -1.0% (sigma 0.2%)" in check.text
    assert check.remedy == f"camera.latency_s = {CONFIG.camera.latency_s + 0.031:.3f}"
    means = list(LEARNT.means)
    means[Learnt.DELAY] = 0.004
    kept(path, config, LearntSensors(tuple(means), LEARNT.covariance))
    assert check_learnt(config)[0].level is CheckLevel.OK
    means[Learnt.HEIGHT_SCALE] = 0.052
    kept(path, config, LearntSensors(tuple(means), LEARNT.covariance))
    (check,) = check_learnt(config)
    assert check.level is CheckLevel.WARNING
    assert "height +5.2%" in check.text
    assert "range finder" in check.remedy
    path.write_text("{")
    assert check_learnt(config)[0].level is CheckLevel.ERROR
