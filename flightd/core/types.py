"""The messages that flow between the stages, as frozen dataclasses with the unit in each name.

Angles are radians, lengths metres or pixels as named, times integer nanoseconds of one monotonic
clock.  Every message carries the time at which its *content* was true (for a picture: mid-exposure),
never the time at which it was handed on.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flightd.core.count_choice import ShelfCount
from flightd.core.refusal import Refusal
from flightd.core.tracks import NOT_SEEN, SensorEstimate

Image: TypeAlias = NDArray[np.uint8]
"""(H, W, 3) BGR or (H, W) single channel, uint8."""

VERTICAL_LIMIT_RAD = math.radians(30.0)
"""Lines within this of theta = 0 (mod pi) are `vertical` (paper, eq. 7)."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One picture: (H, W, 3) uint8, BGR, read-only; `stamp_ns` is mid-exposure."""

    seq: int
    stamp_ns: int
    bgr: Image

    def __post_init__(self) -> None:
        if self.bgr.ndim != 3 or self.bgr.shape[2] != 3 or self.bgr.dtype != np.uint8:
            raise ValueError(f"frame {self.seq} is {self.bgr.shape} {self.bgr.dtype}, not (H, W, 3) uint8")


class LineKind(enum.StrEnum):
    """The paper's two classes (eq. 7): vertical runs up the picture, horizontal across it."""

    VERTICAL = "vertical"
    HORIZONTAL = "horizontal"


def line_kind(theta_rad: float) -> LineKind:
    """Class of a line by its normal's angle, theta in [0, pi)."""
    vertical = theta_rad < VERTICAL_LIMIT_RAD or theta_rad > math.pi - VERTICAL_LIMIT_RAD
    return LineKind.VERTICAL if vertical else LineKind.HORIZONTAL


@dataclass(frozen=True, slots=True)
class Line:
    """A thick line's centre line in Hessian normal form about the image centre.

    x cos(theta) + y sin(theta) = rho with x right, y down, origin ((W-1)/2, (H-1)/2), theta in
    [0, pi), rho signed.  The visible span runs from `start_px` to `end_px` along the direction
    (-sin(theta), cos(theta)), measured from the foot of the normal.  `support` is the part of the
    span that is really painted, 0..1.  The sigmas are standard deviations; `rho_theta_cov` (px rad)
    is the covariance of the two errors, which is what remains when only one end of a line is seen.
    """

    rho_px: float
    theta_rad: float
    width_px: float
    start_px: float
    end_px: float
    support: float
    sigma_rho_px: float
    sigma_theta_rad: float
    rho_theta_cov: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.theta_rad < math.pi:
            raise ValueError(f"theta {self.theta_rad} outside [0, pi)")
        if not self.end_px >= self.start_px:
            raise ValueError(f"span ends at {self.end_px} before its start {self.start_px}")

    @property
    def span_px(self) -> float:
        return self.end_px - self.start_px

    @property
    def kind(self) -> LineKind:
        return line_kind(self.theta_rad)

    def point_at(self, along_px: float) -> tuple[float, float]:
        """Centred image coordinates (x, y) of the point `along_px` from the foot of the normal."""
        c, s = math.cos(self.theta_rad), math.sin(self.theta_rad)
        return self.rho_px * c - along_px * s, self.rho_px * s + along_px * c


class JunctionKind(enum.StrEnum):
    CROSS = "cross"
    TEE = "tee"
    CORNER = "corner"
    END = "end"


@dataclass(frozen=True, slots=True)
class Junction:
    """Where lines meet or one ends, in centred image coordinates; `arms_rad` are the directions
    (atan2(y, x), image axes) in which paint leaves it: 4 for a cross, 3, 2, 1."""

    kind: JunctionKind
    x_px: float
    y_px: float
    arms_rad: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class PadSight:
    """A charge pad seen whole: its centre in centred image coordinates of a distortion-free camera, the
    length of its sides, and how like a full square it looks, 0..1."""

    x_px: float
    y_px: float
    side_px: float
    confidence: float


@dataclass(frozen=True, slots=True)
class PictureCheck:
    """Whether a picture shows anything: a fingerprint of its pixels (equal only for the same picture),
    their mean, 0..255, and their spread (standard deviation of the liveliest channel)."""

    fingerprint: int
    mean: float
    spread: float


UNCHECKED = PictureCheck(-1, 127.5, 127.5)
"""Nobody looked at the pixels: nothing is said against them."""


@dataclass(frozen=True, slots=True)
class MarkerSight:
    """A floor marker seen whole: its number, its centre in centred image coordinates of a distortion-free
    camera, and the mean length of its sides."""

    id: int
    x_px: float
    y_px: float
    side_px: float


@dataclass(frozen=True, slots=True)
class FloorFeature:
    """A point of the floor that was followed from another frame: the number that it keeps from frame to
    frame, and where it is in centred image coordinates of a distortion-free camera."""

    id: int
    x_px: float
    y_px: float


@dataclass(frozen=True, slots=True)
class LineSet:
    """What vision saw in one frame.  Lines are in pixels of a distortion-free pinhole camera when a
    lens was given to the detector.  `timings_ms` names each stage's time.  Pads are only looked for, features
    only followed, and the picture only checked, by a detector that is in flight."""

    frame_seq: int
    stamp_ns: int
    width_px: int
    height_px: int
    lines: tuple[Line, ...]
    junctions: tuple[Junction, ...]
    method: str
    timings_ms: dict[str, float] = field(default_factory=dict)
    pads: tuple[PadSight, ...] = ()
    picture: PictureCheck = UNCHECKED
    markers: tuple[MarkerSight, ...] = ()
    features: tuple[FloorFeature, ...] = ()


@dataclass(frozen=True, slots=True)
class CodeRead:
    """One code read from one picture.

    `symbology` is the reader's name for it ("QR Code", "EAN-13"); UPC-A is reported as its 12 digits.
    `corners_px` are in centred image coordinates, from the code's own top left, clockwise; none in a record
    that comes from an inventory.  `sure` says that the code's error correction or checksum vouches for the
    text; `agreeing` counts the ways of looking at the picture that gave this text; `quality` is 1 for a code
    read from the picture as it is and falls towards 0 with every alteration it took.  `gs1` are the
    (application identifier, value) pairs of a GS1 code or GS1 Digital Link whose check digits hold, and
    `gs1_problem` says what is wrong with one that is none.  `module_px` are the pixels for each of its
    modules, None where their number is not known.  `whole` is False for a weakly checked linear code that may
    be a part of a longer one: the picture does not show it end in quiet zones.
    """

    symbology: str
    text: str
    corners_px: tuple[tuple[float, float], ...]
    sure: bool
    agreeing: int
    quality: float
    gs1: tuple[tuple[str, str], ...] = ()
    gs1_problem: str = ""
    module_px: float | None = None
    whole: bool = True

    @property
    def believed(self) -> bool:
        """A checksum vouches for it, or two reads of a whole code agree: never a guess.  Of a part all reads
        may agree, and all be wrong."""
        return self.sure or (self.whole and self.agreeing >= 2)


@dataclass(frozen=True, slots=True)
class Attitude:
    """Body to level frame: roll + right side down, pitch + nose up, yaw + clockwise from above.

    The rates are those of the three angles by the gyros alone, NaN where the vehicle tells none."""

    stamp_ns: int
    roll_rad: float
    pitch_rad: float
    yaw_rad: float
    yaw_rate_radps: float = math.nan
    roll_rate_radps: float = math.nan
    pitch_rate_radps: float = math.nan

    def turned_to(self, yaw_rad: float) -> Attitude:
        """The same with another heading."""
        return Attitude(self.stamp_ns, self.roll_rad, self.pitch_rad, yaw_rad, *self._rates)

    def leant_by(self, roll_rad: float, pitch_rad: float) -> Attitude:
        """The same with so much more roll and pitch."""
        roll, pitch = self.roll_rad + roll_rad, self.pitch_rad + pitch_rad
        return Attitude(self.stamp_ns, roll, pitch, self.yaw_rad, *self._rates)

    @property
    def _rates(self) -> tuple[float, float, float]:
        return self.yaw_rate_radps, self.roll_rate_radps, self.pitch_rate_radps


class LandedState(enum.StrEnum):
    UNKNOWN = "unknown"
    ON_GROUND = "on_ground"
    IN_AIR = "in_air"


class PoseUse(enum.StrEnum):
    """Whether the vehicle's own estimator gets our motion: it is not to be given (NONE), what it takes is not
    known yet, by its parameters it takes none, or it is given."""

    NONE = "none"
    UNKNOWN = "unknown"
    NOT_TAKEN = "not_taken"
    GIVEN = "given"


@dataclass(frozen=True, slots=True)
class VehicleState:
    """The newest that the vehicle told, each group with its own time.

    `in_control` says that the autopilot is in the mode in which it obeys our setpoints (or, while LAND
    is demanded, in its landing mode) *and* that we asked for that mode: False means hands off, unless it is
    `unheard`: silent for so long that nobody knows any more in which mode it is, or whether it is armed.
    `height_m` is above the floor below, along the vertical; NaN when no range finder speaks.
    `stamps_refused` counts attitudes whose own time made no sense (the arrival's was taken);
    `clock_error_s` is by how much their times may be wrong in our clock (standard deviation), NaN where the
    vehicle's clock was never compared with ours.
    `battery_frac` is NaN while the vehicle does not know it, `battery_stamp_ns` the time at which it last
    told anything of its battery (0: it gives none), `battery_a` the current and `battery_cells` the cells in
    series (NaN and 0: not told).
    `climb_contradicted`: what it told of its climb was none, or ended, `climb_mps` is the height's.
    `keeps_climb`: it keeps a setpoint's climb rate by its own measurements, whatever it tells of them.
    `hovers_unsteered`: it comes to rest over the floor by itself, also where it lands by itself.
    `in_failsafe`: it says that a failsafe of its own acts.
    `refusal` is why it does not do what is demanded, `unfit` why the adapter would not arm it, as far as can
    be asked while it stands; None where nothing is against it.
    """

    attitude: Attitude
    height_m: float
    height_stamp_ns: int
    climb_mps: float
    mode: str
    in_control: bool
    armed: bool
    landed: LandedState
    battery_frac: float
    battery_v: float
    heartbeat_ns: int
    refusal: Refusal | None = None
    stamps_refused: int = 0
    clock_error_s: float = 0.0
    battery_stamp_ns: int = 0
    battery_a: float = math.nan
    battery_cells: int = 0
    unfit: Refusal | None = None
    climb_contradicted: bool = False
    keeps_climb: bool = False
    pose_use: PoseUse = PoseUse.NONE
    hovers_unsteered: bool = False
    in_failsafe: bool = False
    unheard: bool = False

    @property
    def may_fly(self) -> bool:
        """It is armed and does not say that it stands: what is not known to stand is landed, not disarmed."""
        return self.armed and self.landed is not LandedState.ON_GROUND


class Demand(enum.StrEnum):
    """What the mission wants of the vehicle; the adapter works towards it and retries by itself.

    KEEP takes over a vehicle that was found flying in the mode in which it obeys us, and nothing else: it
    never arms, never changes the mode.
    """

    HANDS_OFF = "hands_off"
    STANDBY = "standby"
    KEEP = "keep"
    FLY = "fly"
    LAND = "land"
    DISARM = "disarm"


@dataclass(frozen=True, slots=True)
class AttitudeSetpoint:
    """Roll + right side down, pitch + nose up, yaw rate + clockwise from above, climb + up."""

    stamp_ns: int
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    yaw_rate_radps: float = 0.0
    climb_mps: float = 0.0

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (self.roll_rad, self.pitch_rad, self.yaw_rate_radps, self.climb_mps))):
            raise ValueError(f"setpoint is not finite: {self}")


@dataclass(frozen=True, slots=True)
class GridPose:
    """Where the drone is on the warehouse grid.

    Map frame: x along the aisles, y to the right of x seen from above, yaw clockwise from x.
    `node` is the nearest node; `along_m`, `across_m` are the offset from it in x and y.  `covariance`
    is that of (x, y, yaw), row-major 3x3.  `integrity` is the probability that the node is right.
    """

    stamp_ns: int
    node: str
    along_m: float
    across_m: float
    yaw_rad: float
    x_m: float
    y_m: float
    vx_mps: float
    vy_mps: float
    height_m: float
    covariance: tuple[float, ...]
    integrity: float


@dataclass(frozen=True, slots=True)
class Health:
    """How the daemon itself does: `latency_p99_s` from exposure to the wire over the last second (0
    without a frame flown by), detector processes replaced and writers of the log started again so far,
    and why the disk refuses the log ("" while it does not)."""

    latency_p99_s: float = 0.0
    detectors_replaced: int = 0
    recorder_restarts: int = 0
    recorder_error: str = ""


HEALTHY = Health()


class EventLevel(enum.StrEnum):
    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


@dataclass(frozen=True, slots=True)
class Event:
    """Something a person or a log reader should know, at the time it happened."""

    stamp_ns: int
    level: EventLevel
    name: str
    text: str


class CommandKind(enum.StrEnum):
    START = "start"
    PAUSE = "pause"
    RESUME = "resume"
    GOTO = "goto"
    HOME = "home"
    LAND = "land"
    STOP = "stop"
    PLAN = "plan"


@dataclass(frozen=True, slots=True)
class Command:
    """An operator's order; `node` only with GOTO.

    PLAN: to visit `nodes` in that order with the next start (none: what the configuration says) and to count
    what hangs on the shelf `levels` there (none: on all).  With `counts` only what is of these is counted of
    all that its nodes see, and of what the node of a GOTO sees; a GOTO without has that counted as the plan's
    levels say.  START with `plan`: only if the plan that stands is the one that was ordered with this id.
    PLAN and GOTO that `waits`: at the end hold there until another order, rather than fly home.  GOTO that
    `lands`: on the pad of that node, to wait there for another flight."""

    id: str
    kind: CommandKind
    node: str = ""
    nodes: tuple[str, ...] = ()
    levels: tuple[int, ...] = ()
    counts: tuple[ShelfCount, ...] | None = None
    plan: str = ""
    waits: bool = False
    lands: bool = False


class Phase(enum.StrEnum):
    """What the mission is doing; the words of log, status and report."""

    PREFLIGHT = "preflight"
    RECOVER = "recover"
    ARMING = "arming"
    TAKE_OFF = "take_off"
    ACQUIRE = "acquire"
    FOLLOW = "follow"
    HOVER = "hover"
    TURN = "turn"
    CLIMB = "climb"
    SCAN = "scan"
    HOLD = "hold"
    RELOCATE = "relocate"
    LAND = "land"
    SWAP = "swap"
    DONE = "done"
    ABORTED = "aborted"
    PILOT = "pilot"


OVER = frozenset({Phase.DONE, Phase.ABORTED, Phase.PILOT})
"""Nothing leads on from these."""
WAITING = frozenset({Phase.PREFLIGHT, Phase.SWAP})
"""On the floor before a flight."""
AT_STOP = frozenset({Phase.HOVER, Phase.CLIMB, Phase.SCAN})
"""At a node that is visited: over it, or beside it where a scan looks again from nearer or from aside."""
LOOKING = frozenset({Phase.FOLLOW, Phase.HOVER, Phase.TURN, Phase.CLIMB, Phase.SCAN})
"""In which shelves may be looked at."""


@dataclass(frozen=True, slots=True)
class Status:
    """A `core.snapshot.Snapshot` as the flight log keeps it.

    `latency_ms` are the newest frame's stages: capture, transport, detection, track, wire (each from its
    predecessor), and total (mid-exposure to setpoint on the wire).  `height_goal_m` is the commanded height
    above the floor, None in logs that do not tell it; `sensors` what the lines say of the drone's own sensors
    (`core.tracks.SensorEstimate`); `view_x_m`, `view_y_m` the place on the map from which a shelf is looked
    at, None where none is and in logs that do not tell it.
    """

    stamp_ns: int
    phase: Phase
    reason: str
    node: str
    goal: str
    nodes_done: int
    nodes_planned: int
    battery_frac: float
    height_m: float
    frames: int
    frames_dropped: int
    fps: float
    latency_ms: dict[str, float]
    height_goal_m: float | None = None
    sensors: SensorEstimate = NOT_SEEN
    view_x_m: float | None = None
    view_y_m: float | None = None
