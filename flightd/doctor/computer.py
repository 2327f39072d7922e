"""The checks of this computer, and of what it flies by, that wait for nothing but its disk: who asks chooses
how many of them."""

from __future__ import annotations

from flightd.config.schema import Config
from flightd.doctor.calibration import check_calibration, check_learnt
from flightd.doctor.check import Check
from flightd.doctor.label_text import check_text
from flightd.doctor.labels import check_labels
from flightd.doctor.lamp import check_lamp
from flightd.doctor.machine import check_clock, check_count_clock, check_disk, check_processor
from flightd.doctor.written_files import check_written
from flightd.site.site import Site


def check_machine(config: Config) -> list[Check]:
    """The computer itself."""
    return [check_clock(), check_disk(config.recorder), *check_processor(config.vision.workers)]


def check_set_up(config: Config, site: Site) -> list[Check]:
    """Before a service starts: what has to be put right on the drone."""
    return [
        *check_machine(config),
        *check_written(config),
        *check_lamp(config),
        *check_labels(config, site),
        *check_text(config),
    ]


def check_computer(config: Config, site: Site, newest_ns: int = 0) -> list[Check]:
    """All of them, for a person; `newest_ns` is the UTC of the inventory's newest look (0: none is known)."""
    return [
        *check_set_up(config, site),
        *check_count_clock(newest_ns),
        *check_calibration(config.camera, site, config.mission.height_m),
        *check_learnt(config),
    ]


def check_fitness(config: Config, site: Site, newest_ns: int = 0) -> list[Check]:
    """Of them what speaks against a flight that is about to begin; `newest_ns` as for `check_computer`."""
    return [
        *check_machine(config),
        *check_count_clock(newest_ns),
        *check_calibration(config.camera, site, config.mission.height_m),
        *check_labels(config, site),
    ]
