"""Rendered pictures of shelves as a scan takes them, the drone's pose known as well as in flight."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from flightd.config.scan import ScanConfig
from flightd.core.scanning import BodyPose
from flightd.core.types import Image
from flightd.mission.scan.code_assignment import Assigner, FrontSight
from flightd.mission.scan.views import View, ViewPlanner
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.front_camera import FrontCamera
from flightd.sim.racks.renderer import FrontRenderer
from flightd.sim.sensors.optics import Taking
from flightd.site.site import Site


@dataclass(frozen=True, slots=True)
class ShelfPicture:
    """One picture, the view it was taken for and the pose that the daemon believes; `part` of the usual
    exposure."""

    picture: Image
    view: View
    pose: BodyPose
    part: float


def shelf_pictures(
    site: Site,
    camera: FrontCamera,
    look: RackAppearance,
    seed: int,
    nodes: Sequence[str],
    parts: Sequence[float] = (1.0,),
    retakes: bool = False,
) -> Iterator[ShelfPicture]:
    """A picture of each view of some nodes for each of the exposures; with `retakes` from all places that
    re-takes look from, too."""
    sight = FrontSight(camera.lens, camera.mount)
    planner = ViewPlanner(site, sight, Assigner(site, sight), ScanConfig(max_height_m=4.0))
    renderer = FrontRenderer(site, camera, look, seed)
    rng = random.Random(seed)
    stamp_ns = 0
    for node in nodes:
        for first in planner.views(node, frozenset(site.locations), 1.0, 0.0):
            view: View | None = first
            while view is not None:
                for part in parts:
                    stamp_ns += 1
                    hover, pose = _poses(rng, view, stamp_ns)
                    yield ShelfPicture(renderer.render(hover, stamp_ns, how=Taking(part)), view, pose, part)
                view = planner.retake(view, view.locations) if retakes else None


def _poses(rng: random.Random, view: View, stamp_ns: int) -> tuple[Kinematics, BodyPose]:
    """Where the drone hovers for a view, and where the daemon takes it to be."""

    def near(value: float, sigma: float) -> float:
        return value + rng.gauss(0.0, sigma)

    x_m, y_m, height_m = near(view.x_m, 0.03), near(view.y_m, 0.03), near(view.height_m, 0.03)
    roll, pitch, yaw = near(0.0, 0.01), near(0.0, 0.01), near(view.yaw_rad, 0.01)
    hover = Kinematics(stamp_ns, x_m, y_m, height_m, 0.0, 0.0, 0.0, roll, pitch, yaw, 0.0, 0.0, 0.0)
    pose = BodyPose(
        stamp_ns,
        near(x_m, 0.01),
        near(y_m, 0.01),
        near(height_m, 0.015),
        near(roll, 0.004),
        near(pitch, 0.004),
        near(yaw, 0.004),
        0.01,
        0.01,
        0.004,
        True,
    )
    return hover, pose
