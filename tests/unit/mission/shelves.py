"""A small site with racks and what the front camera sees of it, for the tests of scanning."""

from __future__ import annotations

from collections.abc import Sequence

from flightd.config.front_camera import FrontCameraConfig
from flightd.core.scanning import BodyPose, CodeSet, Light, Occupancy, PlaceLook
from flightd.core.types import CodeRead
from flightd.mission.scan.code_assignment import FrontSight
from flightd.site.site import Site
from flightd.site.site_file import parse_site

_RACKS_AND_PAD = """
[[rack]]
bay_width_m = 1.3
levels_m = [0.9, 1.8]
positions = 2

[[pad]]
id = "home"
node = "A1"
size_m = 0.5
"""


def one_aisle(levels_m: Sequence[float] = (0.9, 1.8), bay_m: float = 1.3, positions: int = 2) -> Site:
    """Four nodes with racks on both sides."""
    text = f"""
[site]
name = "shelves"
ceiling_m = 6.0

[[aisle]]
id = "A"
x_m = 0.0
y_m = 0.0
spacing_m = [1.3, 1.3, 1.3]
shelf_height_m = {max(levels_m) + 0.6}

[[rack]]
bay_width_m = {bay_m}
levels_m = {list(levels_m)}
positions = {positions}

[[pad]]
id = "home"
node = "A1"
size_m = 0.5
"""
    return parse_site(text, "shelves")


SITE = one_aisle()
_SPACING = "[1.3, 1.3, 1.3, 1.3]"
BARE_ENDS = parse_site(
    """
[site]
name = "three aisles"
ceiling_m = 6.0
"""
    + "".join(
        f"""
[[aisle]]
id = "{aisle}"
x_m = 0.0
y_m = {y_m}
spacing_m = {_SPACING}
shelf_distance_m = 1.2
shelf_height_m = 2.4
"""
        for aisle, y_m in (("A", 0.0), ("B", 3.4), ("C", 6.8))
    )
    + "".join(f'[[cross]]\nnodes = ["{a}{n}", "{b}{n}"]\n' for a, b in ("AB", "BC") for n in (1, 5))
    + _RACKS_AND_PAD,
    "three aisles",
)
"""The middle aisle has no shelves before its end nodes."""
FITTED = {"url": "udp://127.0.0.1:0"}
"""A front camera, whose pictures reach the tests another way."""
SIGHT = FrontSight(FrontCameraConfig().lens(), FrontCameraConfig().mount())


def pose(stamp_ns: int = 0, **changes: float | bool) -> BodyPose:
    """A drone that hovers over A2 and faces the left shelf, very sure of it."""
    values = {
        "x_m": 1.3, "y_m": 0.0, "height_m": 0.9, "roll_rad": 0.0, "pitch_rad": 0.0, "yaw_rad": -1.5707963,
        "sigma_x_m": 0.01, "sigma_y_m": 0.01, "sigma_yaw_rad": 0.003, "certain": True,
    }  # fmt: skip
    return BodyPose(stamp_ns, **{**values, **changes})  # type: ignore[arg-type]


def read(
    text: str, x_px: float = 0.0, y_px: float = 0.0, *, size_px: float = 40.0, sure: bool = True
) -> CodeRead:
    """A code around a point of the picture."""
    h = size_px / 2
    corners = ((x_px - h, y_px - h), (x_px + h, y_px - h), (x_px + h, y_px + h), (x_px - h, y_px + h))
    return CodeRead("QR Code", text, corners, sure, 1, 1.0)


def picture(
    seq: int,
    reads: tuple[CodeRead, ...] = (),
    places: dict[str, Occupancy] | None = None,
    stamp_ns: int | None = None,
    exposure: float = 1.0,
    light: Light = Light.FAIR,
) -> CodeSet:
    """What one picture showed; every place in full, with evidence named after picture and place."""
    quad = ((-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0))
    looks = tuple(
        PlaceLook(code, quad, 1.0, seen, f"{seq}:{code}", light) for code, seen in (places or {}).items()
    )
    at_ns = seq * 250_000_000 if stamp_ns is None else stamp_ns
    return CodeSet(seq, at_ns, 1280, 800, reads, looks, exposure=exposure)
