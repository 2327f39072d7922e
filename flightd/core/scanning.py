"""What flows between the front camera, the mission and the inventory while a shelf is scanned.

Picture coordinates are centred: x right, y down from ((W-1)/2, (H-1)/2), as in `core.types.CodeRead`.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, field
from typing import TypeAlias

from flightd.core.inventory import LocationState, PlaceFill, UndecidedCode
from flightd.core.types import CodeRead

Quad: TypeAlias = tuple[tuple[float, float], ...]
"""Four corners in the picture: left top, right top, right bottom, left bottom as seen."""


class Occupancy(enum.StrEnum):
    """What a picture tells of one place without reading any code.

    `EMPTY` is said only of an opening whose deck is seen, lit, behind the front; whatever is in doubt is
    `UNSURE`.
    """

    EMPTY = "empty"
    GOODS = "goods"
    COVERED = "covered"
    UNSURE = "unsure"


class Light(enum.StrEnum):
    """How a place comes out in a picture: `BURNT` where parts of it are as white as can be, `DIM` where white
    paper on its level, or in the whole picture where none is there, is too dark to tell anything by."""

    FAIR = "fair"
    BURNT = "burnt"
    DIM = "dim"


@dataclass(frozen=True, slots=True)
class PlaceOpening:
    """The room of a place as a picture shows it: `front_px` the corners of its front, from the beam above
    down to the deck, `width_m` by `height_m` large.  `eye_m` is the camera, to the right of the front's lower
    middle, above it and before it; `posts` says whether an upright stands at its left and at its right."""

    front_px: Quad
    width_m: float
    height_m: float
    eye_m: tuple[float, float, float]
    posts: tuple[bool, bool]


@dataclass(frozen=True, slots=True, order=True)
class PictureWorth:
    """What a picture of a place is worth to people, compared in this order: whether it shows a code there,
    whether the place comes out well, and how much of the place is in it (negative: there is no picture)."""

    code: bool
    lit: bool
    share: float


NO_PICTURE = PictureWorth(False, False, -1.0)


@dataclass(frozen=True, slots=True)
class Place:
    """A location as the picture is expected to show it: its cell and how much of that is inside; the core of
    the cell, which goods cover if there are any; and the front part of the deck below the core, which an
    empty place shows (its far end above its near one; empty where it cannot be in the picture).  `opening` is
    None where it is not in the picture.  `kept` is what the picture is worth that there is of it: none is
    made that is worth no more.  Places of one `level` are lit alike, others may not be: `lit_px` is the part
    of the cell that has the light of its own level, from the beam with its label up to the next beam; empty:
    the whole cell."""

    location: str
    quad_px: Quad
    share: float
    core_px: Quad
    deck_px: Quad = ()
    opening: PlaceOpening | None = None
    kept: PictureWorth = NO_PICTURE
    level: int = 0
    lit_px: Quad = ()


@dataclass(frozen=True, slots=True)
class PlaceLook:
    """What one picture shows of one location; `evidence` names the picture of it (SHA-256), empty
    where none was made.
    `fill` is None where it shows too little of the opening; `code` says whether a code is there that is not
    the location's own label; `deck` says whether it would show its deck if it were empty: where not, it
    cannot tell that it is; `white` is as in `CodeSet`, by the labels on the location's level alone, None
    where the picture shows none."""

    location: str
    quad_px: Quad
    share: float
    occupancy: Occupancy
    evidence: str = ""
    light: Light = Light.FAIR
    fill: PlaceFill | None = None
    code: bool = False
    deck: bool = True
    white: float | None = None

    @property
    def worth(self) -> PictureWorth:
        """What the picture is worth to people."""
        return PictureWorth(self.code, self.light is Light.FAIR, self.share)


@dataclass(frozen=True, slots=True)
class CodeSet:
    """What the code reader saw in one picture of the front camera, taken with `exposure` and `gain` as parts
    of the camera's usual ones.  `timings_ms` by stage; `white` is the grey level, 0..255, that white paper
    has in it, None where nobody looked."""

    frame_seq: int
    stamp_ns: int
    width_px: int
    height_px: int
    reads: tuple[CodeRead, ...]
    places: tuple[PlaceLook, ...]
    timings_ms: dict[str, float] = field(default_factory=dict)
    exposure: float = 1.0
    gain: float = 1.0
    white: float | None = None


@dataclass(frozen=True, slots=True)
class BodyPose:
    """The drone at one moment, as the map knows it, with standard deviations; angles as in `Attitude`.

    `certain` says that the place on the grid was not in doubt then."""

    stamp_ns: int
    x_m: float
    y_m: float
    height_m: float
    roll_rad: float
    pitch_rad: float
    yaw_rad: float
    sigma_x_m: float
    sigma_y_m: float
    sigma_yaw_rad: float
    certain: bool


@dataclass(frozen=True, slots=True)
class Finding:
    """The mission's verdict on one location, from where it was seen, at the flight clock's time.

    Its place is not proven before the location is named in `Settled`: until then it is pending.  `again`: the
    flight had flown past the location before, or counted it, and that decided nothing."""

    stamp_ns: int
    location: str
    state: LocationState
    confidence: float
    reads: tuple[CodeRead, ...]
    evidence: str
    node: str
    x_m: float
    y_m: float
    height_m: float
    yaw_rad: float
    fill: PlaceFill | None = None
    again: bool = False
    undecided: tuple[UndecidedCode, ...] = ()

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (self.x_m, self.y_m, self.height_m, self.yaw_rad))):
            raise ValueError(f"{self.location}: the pose is not finite")


@dataclass(frozen=True, slots=True)
class CountedPlace:
    """A location that an earlier flight of the same count has booked, and the codes that it read there."""

    location: str
    reads: tuple[CodeRead, ...] = ()


@dataclass(frozen=True, slots=True)
class Settled:
    """Locations whose pending findings are proven to be theirs, or withdrawn because they may not be.

    `booked`: what this count has proven of them before is withdrawn, too, for something contradicts it."""

    locations: tuple[str, ...]
    confirmed: bool
    booked: bool = False

    def __post_init__(self) -> None:
        if self.confirmed and self.booked:
            raise ValueError(f"{', '.join(self.locations)}: proven and contradicted at once")
