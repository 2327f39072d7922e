"""Which stops of a plan are still to be made, in a small file that survives a power cut.

A companion computer that is fed by the flight battery loses its power when that is changed; what the file
says is flown on the next start when it is asked to.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path

from flightd.adapters.store.kept_file import KeptFile
from flightd.core.errors import InputError
from flightd.site.site import SAME_NODE_M, Site


@dataclass(frozen=True, slots=True)
class LeftOver:
    """The stops still to be made, in order, and the node and heading on which the drone stands for them."""

    remaining: tuple[str, ...]
    stand: str
    yaw_rad: float


class NothingLeftError(InputError):
    """No stop was left over."""


def load_left_over(path: Path, site: Site) -> LeftOver:
    """What is left over on `site`.  InputError when the file is another's, NothingLeftError without stops."""
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
        name = told["site"]
        left = LeftOver(tuple(map(str, told["remaining"])), str(told["stand"]), float(told["yaw_rad"]))
        at = {str(node): (float(x_m), float(y_m)) for node, (x_m, y_m) in told.get("at", {}).items()}
    except OSError as err:
        raise NothingLeftError(f"{path}: {err.strerror}; there is nothing to resume") from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise InputError(f"{path}: not a progress file; delete it and start without --resume") from None
    if name != site.name or not {*left.remaining, left.stand} <= site.nodes.keys():
        raise InputError(f"{path}: progress on site {name}, not on {site.name}; start without --resume")
    known = [node for node in at if node in site.nodes]
    if moved := [node for node in known if math.dist(_place(site, node), at[node]) > SAME_NODE_M]:
        raise InputError(
            f"{path}: {moved[0]} lies elsewhere on {site.name} than it did then; start without --resume"
        )
    if not left.remaining:
        raise NothingLeftError(f"{path}: every stop was made; start without --resume")
    return left


def progress_file(path: Path, site: Site) -> KeptFile[LeftOver]:
    """Keeps what is left over on a site, and where that is."""

    def text(left: LeftOver) -> str:
        at = {node: _place(site, node) for node in (left.stand, *left.remaining)}
        return json.dumps({"site": site.name, **asdict(left), "at": at}, ensure_ascii=False)

    return KeptFile(path, "progress", text)


def _place(site: Site, node: str) -> tuple[float, float]:
    return site.nodes[node].x_m, site.nodes[node].y_m
