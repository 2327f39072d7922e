"""How the simulated warehouse and its camera look: one frozen set of strengths, and named presets."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

from flightd.core.errors import InputError


@dataclass(frozen=True, slots=True)
class Appearance:
    """Strengths of what makes a floor hard to see; 0 takes the effect away, 1 is the strongest sensible.

    `concrete` mottling and grain, `wear` share of the paint chipped or rubbed off, `ragged_m` waviness of
    the paint's edges, `dirt` on paint, `stains`, `tyre_marks`, `cracks` their number and depth, `joints`
    the saw cuts of the slab, `lamps` unevenness of the lighting, `shadows` depth of the shelves' shadows,
    `sun` brightness of skylight patches, `glare` mirror images of the lamps, `drone_shadow` depth below
    the airframe, `vignetting` loss in the picture's corners, `noise` standard deviation in grey levels at
    mid grey, `soft_px` sigma of the lens blur, `flicker` share of brightness that beats with the mains.
    `exposure` scales the brightness (1 is right)."""

    concrete: float = 0.5
    wear: float = 0.18
    ragged_m: float = 0.001
    dirt: float = 0.35
    stains: float = 0.4
    tyre_marks: float = 0.5
    cracks: float = 0.4
    joints: float = 0.6
    lamps: float = 0.4
    shadows: float = 0.4
    sun: float = 0.0
    glare: float = 0.25
    drone_shadow: float = 0.5
    vignetting: float = 0.25
    noise: float = 2.0
    soft_px: float = 0.5
    flicker: float = 0.01
    motion_blur: bool = True
    exposure: float = 1.0

    def towards(self, other: Appearance, share: float) -> Appearance:
        """This floor by a `share` of the way to the paint, dirt, lamps and lens of another."""
        changed = {
            name: (1.0 - share) * getattr(self, name) + share * getattr(other, name) for name in _NEGLECTED
        }
        return replace(self, **changed)

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not 0.0 <= value <= 50.0:
                raise ValueError(f"appearance {field.name} {value} outside 0..50")


_NEGLECTED = ("wear", "ragged_m", "dirt", "stains", "tyre_marks", "lamps", "glare", "soft_px")
"""What years without care change of a hall and of a lens."""

DEFAULT = Appearance()

CLEAN = Appearance(
    concrete=0.0,
    wear=0.0,
    ragged_m=0.0,
    dirt=0.0,
    stains=0.0,
    tyre_marks=0.0,
    cracks=0.0,
    joints=0.0,
    lamps=0.0,
    shadows=0.0,
    glare=0.0,
    drone_shadow=0.0,
    vignetting=0.0,
    noise=0.0,
    soft_px=0.0,
    flicker=0.0,
    motion_blur=False,
)

HARSH = Appearance(
    concrete=0.9,
    wear=0.32,
    ragged_m=0.002,
    dirt=0.7,
    stains=0.9,
    tyre_marks=1.0,
    cracks=0.8,
    joints=0.9,
    lamps=0.8,
    shadows=0.8,
    sun=0.8,
    glare=0.7,
    drone_shadow=0.8,
    vignetting=0.5,
    noise=5.0,
    soft_px=0.8,
    flicker=0.03,
)

PRESETS = {
    "default": DEFAULT,
    "clean": CLEAN,
    "harsh": HARSH,
    "dim": replace(DEFAULT, exposure=0.45, noise=5.0),
    "glossy": replace(DEFAULT, glare=0.9, lamps=0.6),
    "worn": replace(DEFAULT, wear=0.35, dirt=0.7, tyre_marks=0.9),
}


def preset(name: str) -> Appearance:
    """The appearance of that name; InputError lists the names there are."""
    try:
        return PRESETS[name]
    except KeyError:
        raise InputError(f"appearance {name!r} is not known; choose from: {', '.join(PRESETS)}") from None
