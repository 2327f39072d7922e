"""What the last flight learnt of the drone's sensors, in a small file.

It belongs to one camera in one mount before one vehicle: where any of them, or what is configured of them,
has changed, it says nothing any more.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from flightd.adapters.store.kept_file import KeptFile
from flightd.config.schema import Config
from flightd.core.errors import InputError
from flightd.core.learnt import Learnt, LearntSensors


def load_learnt(path: Path, config: Config) -> LearntSensors | None:
    """What was learnt of the sensors of this configuration; None before the first flight, or of others.
    InputError for a file that is none."""
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
        sensors = told["sensors"]
        learnt = LearntSensors(_numbers(told["means"]), _numbers(told["covariance"]))
    except FileNotFoundError:
        return None
    except OSError as err:
        raise InputError(f"{path}: {err.strerror}") from None
    except (ValueError, KeyError, TypeError):
        raise InputError(f"{path}: not a file of learnt sensors; delete it") from None
    known = len(learnt.means)
    if known != len(Learnt) and len(learnt.covariance) == known**2:  # of a version that learnt something else
        return None
    if not _is_a_distribution(learnt):
        raise InputError(f"{path}: its numbers cannot be; delete it")
    return learnt if sensors == _sensors_of(config) else None


def learnt_file(path: Path, config: Config) -> KeptFile[LearntSensors]:
    """Keeps what flights by this configuration learn."""
    sensors = _sensors_of(config)
    return KeptFile(
        path, "learnt sensors", lambda learnt: json.dumps({"sensors": sensors, **asdict(learnt)}, indent=1)
    )


def _sensors_of(config: Config) -> dict[str, Any]:
    """All on which it depends what there is to learn, as JSON reads it again."""
    vehicle = {"kind": config.vehicle.kind, "url": config.vehicle.url}
    plain = {"camera": config.camera.model_dump(mode="json"), "vehicle": vehicle}
    found: dict[str, Any] = json.loads(json.dumps(plain, default=str))
    return found


def _numbers(told: list[float]) -> tuple[float, ...]:
    return tuple(float(number) for number in told)


def _is_a_distribution(learnt: LearntSensors) -> bool:
    if len(learnt.means) != len(Learnt) or len(learnt.covariance) != len(Learnt) ** 2:
        return False
    if not all(map(math.isfinite, (*learnt.means, *learnt.covariance))):
        return False
    covariance = np.reshape(learnt.covariance, (len(Learnt), len(Learnt)))
    return np.allclose(covariance, covariance.T) and bool(np.linalg.eigvalsh(covariance).min() >= -1e-12)
