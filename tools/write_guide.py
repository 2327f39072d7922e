"""Write the parts of the guide and of the README that are made from the code.

A part stands between `<!-- made: NAME -->` and `<!-- end: NAME -->`; what stands between is replaced.  The
picture of the layers is made from the contract in pyproject.toml.

python -m tools.write_guide            # write them
python -m tools.write_guide --check    # exit 1 and name the pages that are stale
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

from flightd.adapters.ground_link import protocol_text
from flightd.adapters.vehicle.mavlink.link.connection import Firmware
from flightd.adapters.vehicle.mavlink.parameter_rule import Rule
from flightd.adapters.vehicle.mavlink.required_parameters import Job, rules_for
from flightd.config.battery import BatteryConfig
from flightd.config.schema import Config
from flightd.guide import pages
from flightd.mission.safety import hazard_table
from flightd.sim.judge.verdict import KINDS
from flightd.sim.unknowns import SPREADS, Spread, WorldKind
from flightd.site.site_tables import SiteFile
from tools import command_table, reference_tables, safety_case
from tools.command_help import help_pages
from tools.layer_picture import layers, picture

ROOT = Path(__file__).parent.parent
LAYERS = pages.FOLDER / "pictures" / "layers.svg"
_PART = re.compile(r"(<!-- made: (\S+) -->\n).*?(<!-- end: \2 -->)", re.DOTALL)


def _commands() -> str:
    return "\n".join(help_pages(ROOT / "pyproject.toml"))


def _parameters(firmware: Firmware) -> str:
    rules = [(rule, "") for rule in rules_for(firmware, Job())]
    usual = {rule for rule, _ in rules}
    for key, job in (
        ('flying_mode = "guided"', Job(guided=True)),
        ("raw_thrust = true", Job(raw_thrust=True)),
        ("raw_thrust = false", Job(raw_thrust=False)),
        ('pose_output = "none"', Job(pose_output="none")),
        ('pose_output = "odometry"', Job(pose_output="odometry")),
        ("landing_target", Job(pose_output="odometry", landing_target=True)),
        ("battery.cells = 4", Job(battery=BatteryConfig(cells=4))),
    ):
        rules += [(rule, key) for rule in rules_for(firmware, job) if not _is_in(rule, usual)]
    lines = ["| parameter | must be | `--fix` sets | only with | why |", "|---|---|---|---|---|"]
    for rule, key in rules:
        names = " or ".join(f"`{name}`" for name in rule.names)
        better = "" if rule.better is None else f"{rule.better:g}"
        only = f"`{key}`" if key else ""
        lines.append(f"| {names} | {rule.expected} | {better} | {only} | {rule.reason} |")
    return "\n".join(lines) + "\n"


def _faults() -> str:
    lines = ["| `kind` | what it says, and its `value` |", "|---|---|"]
    lines += [f"| `{kind}` | {text} |" for kind, text in KINDS.items()]
    return "\n".join(lines) + "\n"


def _worlds() -> str:
    usual, rough = SPREADS[WorldKind.USUAL], SPREADS[WorldKind.ROUGH]
    lines = ["| what the configuration does not know | `usual` | `rough` |", "|---|---|---|"]
    rows = (
        ("camera: delay off by up to", "delay_s", 1e3, "ms"),
        ("camera: jitter added, up to", "jitter_s", 1e3, "ms"),
        ("camera: delay that leaps in flight, by", "delay_leap_s", 1e3, "ms"),
        ("camera: roll and pitch of the mount, up to", "mount_deg", 1, "deg"),
        ("camera: yaw of the mount, up to", "mount_yaw_deg", 1, "deg"),
        ("camera: focal length off by up to", "focal_share", 1e2, "%"),
        (
            "camera: shakes against the attitude (`rough`: vibrates by 60 to 200 Hz), rms",
            "shake_deg",
            1,
            "deg",
        ),
        ("camera: rows read out slower or faster by up to", "readout_s", 1e3, "ms"),
        ("camera: automatic exposure, time constant from", "quickest_exposure_s", 1, "s"),
        ("camera: automatic exposure, time constant up to", "slowest_exposure_s", 1, "s"),
        ("camera: bands of mains light, amplitude from", "least_flicker", 1e2, "%"),
        ("camera: bands of mains light, amplitude up to", "most_flicker", 1e2, "%"),
        ("map: each painted line beside its place by up to", "map_m", 1e2, "cm"),
        ("compass: turned by steel, place by place, by up to", "compass_deg", 1, "deg"),
        ("attitude: constant error, up to", "tilt_deg", 1, "deg"),
        ("attitude: error that wanders, rms", "tilt_wander_deg", 1, "deg"),
        ("attitude: leaks to level within", "leak_s", 1, "s"),
        ("legs and floor: roll and pitch in which it stands, up to", "stand_deg", 1, "deg"),
        ("autopilot's clock fast or slow by up to", "clock_ppm", 1, "ppm"),
        ("autopilot's clock set in flight, by", "clock_leap_s", 1e3, "ms"),
        ("gyros: yaw rate off for good by up to", "yaw_drift_degps", 1, "deg/s"),
        ("gyros: rates too large or small by up to", "gyro_share", 1e2, "%"),
        ("gyros: noise of the rates, rms", "gyro_noise_degps", 1, "deg/s"),
        ("gyros: roll and pitch rate told too large or small by up to", "tilt_rate_degps", 1, "deg/s"),
        ("autopilot's attitude loop: bandwidth, damping off by up to", "attitude_loop_share", 1e2, "%"),
        ("telemetry: least delay of either way", "path_s", 1e3, "ms"),
        ("telemetry: one way longer, the other shorter by up to", "uneven_s", 1e3, "ms"),
        ("telemetry: jitter, exponential", "path_jitter_s", 1e3, "ms"),
        ("range finder: noise, rms", "range_noise_m", 1e2, "cm"),
        ("range finder: readings lost", "range_dropout", 1e2, "%"),
        ("range finder: measures from", "range_min_m", 1, "m"),
        ("range finder: follows within, from", "quickest_range_s", 1e3, "ms"),
        ("range finder: follows within, up to", "slowest_range_s", 1e3, "ms"),
        ("range finder: readings by a longer way", "range_echo", 1e2, "%"),
        ("barometer: wanders, rms", "baro_m", 1, "m"),
        ("hover thrust off by up to", "hover_share", 1e2, "%"),
        ("drag, battery's capacity: off by up to", "body_share", 1e2, "%"),
        ("current by which the charge is counted: off by up to", "current_share", 1e2, "%"),
        ("battery's voltage told too high or low by up to", "volt_share", 1e2, "%"),
        ("motors: most thrust on a full battery, less as it sags", "thrust_to_weight", 1, "times the weight"),
        ("air: gusts, rms", "gust_mps", 1, "m/s"),
        ("air: thrown back right beside floor and racks, rms", "wash_mps", 1, "m/s"),
        ("floor: paint that is missing", "paint_gone", 1e2, "% of its length"),
        ("floor: paint on which pallets and drains lie", "paint_covered", 1e2, "% of its length"),
        ("floor: lines that no map has", "false_lines", 1e2, "% of the painted length"),
        (
            "floor: long old lines beside the true ones, in the mean",
            "old_lines",
            1e2,
            "% of the painted length",
        ),
        ("floor: tape of another colour", "tape", 1e2, "% of the painted length"),
        ("floor: wear, dirt, mirrored lamps and blur, from `default` to `harsh`", "worn_look", 1e2, "%"),
        ("racks: light on each level of a front, from", "darkest_face", 1, "times the usual"),
        ("racks: light on each level of a front, up to", "lightest_face", 1, "times the usual"),
    )

    def told(spread: Spread, name: str, factor: float, unit: str) -> str:
        value = getattr(spread, name)
        return "not limited" if value is None else f"{value * factor:g} {unit}"

    lines += [
        f"| {what} | {told(usual, name, factor, unit)} | {told(rough, name, factor, unit)} |"
        for what, name, factor, unit in rows
    ]
    return "\n".join(lines) + "\n"


def _is_in(rule: Rule, usual: set[Rule]) -> bool:
    return any((rule.names, rule.expected) == (other.names, other.expected) for other in usual)


def _page_list(prefix: str) -> str:
    lines = ["| page | what is in it |", "|---|---|"]
    lines += [f"| [{page.title}]({prefix}{page.topic}.md) | {page.summary} |" for page in pages.pages()]
    return "\n".join(lines) + "\n"


PARTS: Mapping[str, Callable[[], str]] = {
    "configuration": lambda: reference_tables.markdown(Config),
    "site-file": lambda: reference_tables.markdown(SiteFile),
    "commands": _commands,
    "command-phases": command_table.markdown,
    "protocol": protocol_text.markdown,
    "hazards": hazard_table.markdown,
    "faults": _faults,
    "worlds": _worlds,
    "safety-case": safety_case.markdown,
    "parameters-ardupilot": lambda: _parameters(Firmware.ARDUPILOT),
    "parameters-px4": lambda: _parameters(Firmware.PX4),
    "pages": lambda: _page_list(""),
    "readme-pages": lambda: _page_list("flightd/guide/"),
}
"""Every part by its name, and what makes it."""


def guide_files() -> list[Path]:
    """The README and every page."""
    return [ROOT / "README.md", *sorted(pages.FOLDER.glob("*.md"))]


def written(text: str) -> str:
    """The page as it should be."""
    return _PART.sub(lambda part: f"{part[1]}\n{PARTS[part[2]]()}\n{part[3]}", text)


def stale() -> dict[Path, str]:
    """Files whose made parts differ from the code, and how they should be."""
    wanted = {path: written(path.read_text(encoding="utf-8")) for path in guide_files()}
    wanted[LAYERS] = picture(layers(ROOT / "pyproject.toml"))
    return {
        path: text
        for path, text in wanted.items()
        if not path.exists() or path.read_text(encoding="utf-8") != text
    }


def _main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 when a page is stale")
    check = parser.parse_args().check
    found = stale()
    for path, text in found.items():
        print(f"{path.relative_to(ROOT)}: {'stale' if check else 'written'}")
        if not check:
            path.write_text(text, encoding="utf-8")
    return 1 if check and found else 0


if __name__ == "__main__":
    sys.exit(_main())
