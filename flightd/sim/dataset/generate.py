"""Labelled frames with exact truth at four levels of difficulty, from a seed.

`clean` is a plain floor and a good sensor; `perturbed` is an ordinary day: uneven light, a soft shadow,
texture, joints, light wear, blur, noise and JPEG; `hard` piles up deep shadows, glare, worn and broken
paint, occluders, tyre marks, distractors in the paint's colour, motion blur, darkness, residual lens
distortion and perspective taper; `rough` is the floor that the simulator's rough world is flown over, drawn
by its own renderer (`rough_floor`).  The same (level, seed, size) always gives the same frame.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from flightd.core.errors import InputError
from flightd.core.types import Image
from flightd.sim.dataset import disturbances as disturb
from flightd.sim.dataset.paint import Bend, break_band, coverage, floor_bgr, floor_texture, paint_bgr, wear
from flightd.sim.dataset.rough_floor import rough_frame
from flightd.sim.dataset.scenes import (
    Layout,
    Scene,
    random_scene,
    to_pixel,
    truth_lines,
    truth_nodes,
    visible_span,
)
from flightd.sim.dataset.severity import LEVELS
from flightd.vision.training.labelled_frames import (
    LabelledImage,
    LabelledLine,
    LabelledNode,
    Labels,
    write_labels,
)

ROUGH = "rough"
LEVEL_NAMES = (*LEVELS, ROUGH)
COLOURS = ("yellow", "white", "red", "blue", "green", "black")


@dataclass(frozen=True, slots=True)
class LabelledFrame:
    """One generated picture, its truth, the paint's share of each pixel before the dirt (0..255), and
    where things lie that hide the paint or have its colour."""

    bgr: Image
    label: LabelledImage
    paint: NDArray[np.uint8]
    unsure: NDArray[np.bool_]

    def mask(self) -> NDArray[np.uint8]:
        """(H, W) for teaching a colour: 255 paint, 0 floor, 128 not to be told."""
        partly = (self.paint > 12) & (self.paint < 230)
        mask = np.where(self.paint > 127, 255, 0)
        return np.where(self.unsure | partly, 128, mask).astype(np.uint8)


def generate(
    level: str,
    seed: int,
    width: int = 1920,
    height: int = 1080,
    colour: str | None = None,
    layout: Layout | None = None,
) -> LabelledFrame:
    """The frame that belongs to these arguments.

    `level` is a key of `severity.LEVELS`.  Colour and layout are drawn from the seed unless given.  The
    label of a bent line (residual distortion) is the straight line nearest to its centre line.
    """
    severity = LEVELS[level]
    rng = np.random.default_rng([list(LEVELS).index(level), seed])
    drawn = COLOURS[int(rng.integers(len(COLOURS)))]
    colour = colour or drawn
    scene = random_scene(rng, width, height, layout, severity.taper)
    corner = math.hypot(width, height) / 2
    bend = Bend(rng.uniform(-1, 1) * severity.bend_px * (width / 1920) / corner**3)

    covered = coverage(scene, bend)
    worn = covered
    if rng.random() < severity.wear_probability:
        thickness = min((band.thickness for band in scene.bands), default=40.0)
        worn = wear(rng, covered, rng.uniform(*severity.wear_share), max(thickness / 3, 4.0))
    if scene.bands and rng.random() < severity.break_probability:
        band = scene.bands[int(rng.integers(len(scene.bands)))]
        worn = break_band(rng, worn.copy(), band, visible_span(band, width, height) or (0.0, 0.0))

    texture = floor_texture(rng, width, height, rng.uniform(*severity.texture))
    floor = floor_bgr(rng, colour, severity.colour_spread)
    paint = paint_bgr(rng, colour, severity.colour_spread)
    picture = texture[..., None] * floor
    disturb.add_seams(rng, picture, severity.seams)
    picture += worn[..., None] * ((0.5 + 0.5 * texture)[..., None] * paint - picture)
    disturb.add_tyre_marks(rng, picture, severity.tyre_marks)
    unsure = disturb.add_distractors(rng, picture, covered, colour, severity.distractors)
    unsure |= disturb.add_occluders(rng, picture, colour, severity.occluders)
    picture *= disturb.illumination(rng, width, height, severity)[..., None]
    if (added := disturb.glare(rng, width, height, severity.glares)) is not None:
        picture += added[..., None]
    picture = disturb.blur(rng, picture, severity)
    bgr = disturb.expose(rng, picture, severity)
    if severity.jpeg is not None:
        bgr = disturb.jpeg(rng, bgr, severity.jpeg)

    label = LabelledImage(
        file="",
        width=width,
        height=height,
        line_colour=colour,
        complete=True,
        negative=scene.layout == "negative",
        lines=[_bent(line, scene, bend) for line in truth_lines(scene)],
        nodes=[_bent_node(node, scene, bend) for node in truth_nodes(scene)],
        tags=[level, scene.layout],
    )
    return LabelledFrame(bgr, label, (worn * 255.0 + 0.5).astype(np.uint8), unsure)


def frame_of_any_level(
    level: str,
    seed: int,
    width: int = 1920,
    height: int = 1080,
    colour: str | None = None,
    layout: Layout | None = None,
) -> tuple[Image, LabelledImage]:
    """As `generate`, for each of LEVEL_NAMES; a rough floor has no `layout`."""
    if level == ROUGH:
        return rough_frame(seed, width, height, colour)
    frame = generate(level, seed, width, height, colour, layout)
    return frame.bgr, frame.label


def _bent(line: LabelledLine, scene: Scene, bend: Bend) -> LabelledLine:
    """The straight line nearest to a line seen through `bend` (least squares over its visible span)."""
    if not bend.k:
        return line
    cx, cy = (scene.width - 1) / 2, (scene.height - 1) / 2
    steps = np.linspace(0.0, 1.0, 101)
    ideal = [(line.x1 + t * (line.x2 - line.x1) - cx, line.y1 + t * (line.y2 - line.y1) - cy) for t in steps]
    seen = np.array([bend.apparent(x, y) for x, y in ideal])
    middle = seen.mean(axis=0)
    direction = np.linalg.svd(seen - middle)[2][0]
    ends = [middle + direction * float((seen[i] - middle) @ direction) for i in (0, -1)]
    (x1, y1), (x2, y2) = (to_pixel(scene, float(end[0]), float(end[1])) for end in ends)
    return LabelledLine(x1=x1, y1=y1, x2=x2, y2=y2, thickness=line.thickness, grade=line.grade)


def _bent_node(node: LabelledNode, scene: Scene, bend: Bend) -> LabelledNode:
    cx, cy = (scene.width - 1) / 2, (scene.height - 1) / 2
    x, y = to_pixel(scene, *bend.apparent(node.x - cx, node.y - cy))
    return LabelledNode(x=x, y=y, kind=node.kind)


def write_dataset(
    folder: Path,
    level: str,
    count: int,
    first_seed: int,
    width: int = 1920,
    height: int = 1080,
    colour: str | None = None,
    layout: Layout | None = None,
    masks: bool = False,
    advance: Callable[[], None] = lambda: None,
) -> None:
    """Write `count` frames of seeds `first_seed`… as PNG and their `labels.json` into a new folder.

    With `masks` each frame's paint is written beside it.  `advance` is called after each frame.
    Raises InputError for a layout or masks of rough floors.
    """
    if level == ROUGH and (layout is not None or masks):
        raise InputError(
            f"level {ROUGH} has no layouts and no masks; leave them out, or choose another level"
        )
    folder.mkdir(parents=True, exist_ok=True)
    images = []
    for seed in range(first_seed, first_seed + count):
        name, mask = f"{level}-{seed:06d}.png", ""
        if masks:
            frame = generate(level, seed, width, height, colour, layout)
            bgr, label, mask = frame.bgr, frame.label, f"{level}-{seed:06d}-mask.png"
            cv2.imwrite(str(folder / mask), frame.mask())
        else:
            bgr, label = frame_of_any_level(level, seed, width, height, colour, layout)
        cv2.imwrite(str(folder / name), bgr, [cv2.IMWRITE_PNG_COMPRESSION, 1])
        images.append(msgspec.structs.replace(label, file=name, mask=mask))
        advance()
    about: dict[str, object] = {"level": level, "first_seed": first_seed, "width": width, "height": height}
    write_labels(folder, Labels(images=images, about=about))
