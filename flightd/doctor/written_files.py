"""May the daemon write what it keeps between flights?"""

from __future__ import annotations

import os
from pathlib import Path

from flightd.config.schema import Config
from flightd.doctor.check import Check, error, ok
from flightd.doctor.nearest_folder import nearest_there


def check_written(config: Config) -> list[Check]:
    """A complaint for each file or folder that is to be written and cannot be; nothing is made here.  The
    flight log's folder is looked at with its disk, the audit log with the ground link."""
    wanted = {
        "inventory.folder": config.inventory.folder,
        "mission.progress": config.mission.progress,
        "tracking.learnt": config.tracking.learnt,
        "vehicle.signing_stamp": config.vehicle.stamp_file,
    }
    wanted = {key: path for key, path in wanted.items() if path is not None}
    refused = [
        error(
            "files",
            f"{key} {path} cannot be written",
            "give this user the right to write there, or another place (of a service: /var/lib/flightd)",
        )
        for key, path in wanted.items()
        if path is not None and not _may_be_written(path)
    ]
    names = ", ".join(wanted)
    return refused or ([ok("files", f"can write {names}")] if wanted else [])


def _may_be_written(path: Path) -> bool:
    """The file or folder itself where it is there, and the folder in which it is made or replaced."""
    try:
        folder = nearest_there(path.absolute().parent)
        return folder.is_dir() and _open_to_us(folder) and (not path.exists() or _open_to_us(path))
    except OSError:  # a folder above may not even be searched, or the name is too long
        return False


def _open_to_us(path: Path) -> bool:
    return os.access(path, os.W_OK | os.X_OK if path.is_dir() else os.W_OK)
