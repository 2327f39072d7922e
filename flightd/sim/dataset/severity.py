"""How much of each disturbance a picture of a floor gets, level by level."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Severity:
    """How much of each disturbance a level has: (low, high) ranges, and probabilities.

    Lengths in pixels are for a picture 1920 wide; noise is the standard deviation in grey levels.
    """

    colour_spread: float
    texture: tuple[float, float]
    wear_probability: float
    wear_share: tuple[float, float]
    break_probability: float
    seams: int
    tyre_marks: int
    distractors: int
    occluders: int
    shadows: int
    shadow_depth: tuple[float, float]
    glares: int
    gradient: float
    exposure: tuple[float, float]
    dark_probability: float
    cast: float
    blur_px: tuple[float, float]
    motion_px: float
    noise: tuple[float, float]
    jpeg: tuple[int, int] | None
    bend_px: float
    taper: float


LEVELS: dict[str, Severity] = {
    "clean": Severity(
        colour_spread=0.3,
        texture=(0.0, 0.01),
        wear_probability=0.0,
        wear_share=(0.0, 0.0),
        break_probability=0.0,
        seams=0,
        tyre_marks=0,
        distractors=0,
        occluders=0,
        shadows=0,
        shadow_depth=(0.0, 0.0),
        glares=0,
        gradient=0.0,
        exposure=(1.0, 1.0),
        dark_probability=0.0,
        cast=0.0,
        blur_px=(0.5, 0.8),
        motion_px=0.0,
        noise=(1.0, 2.0),
        jpeg=None,
        bend_px=0.0,
        taper=0.0,
    ),
    "perturbed": Severity(
        colour_spread=0.7,
        texture=(0.01, 0.04),
        wear_probability=0.3,
        wear_share=(0.02, 0.08),
        break_probability=0.0,
        seams=2,
        tyre_marks=1,
        distractors=2,
        occluders=0,
        shadows=1,
        shadow_depth=(0.1, 0.3),
        glares=0,
        gradient=0.25,
        exposure=(0.65, 1.35),
        dark_probability=0.0,
        cast=0.10,
        blur_px=(0.5, 1.5),
        motion_px=3.0,
        noise=(2.0, 5.0),
        jpeg=(80, 95),
        bend_px=0.0,
        taper=0.0,
    ),
    "hard": Severity(
        colour_spread=1.0,
        texture=(0.03, 0.09),
        wear_probability=0.7,
        wear_share=(0.05, 0.35),
        break_probability=0.35,
        seams=4,
        tyre_marks=3,
        distractors=6,
        occluders=2,
        shadows=2,
        shadow_depth=(0.25, 0.6),
        glares=2,
        gradient=0.45,
        exposure=(0.6, 1.4),
        dark_probability=0.15,
        cast=0.15,
        blur_px=(0.6, 2.5),
        motion_px=9.0,
        noise=(3.0, 9.0),
        jpeg=(55, 90),
        bend_px=1.0,
        taper=0.1,
    ),
}

DARKNESS = (0.3, 0.5)
"""Exposure of a dark frame, relative to a normal one."""
