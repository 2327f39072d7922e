"""Configuration, map and explicit arguments -> a flight: everything is composed here, and nothing runs yet.

What differs between a real vehicle and a simulated one (clock, detectors, recorder, addresses) is handed in.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial

from flightd.adapters.camera.connect import connect_camera
from flightd.adapters.ground_link.link import ZmqGround
from flightd.adapters.ground_link.maintenance_desk import Maintainer
from flightd.adapters.ground_link.messages.floor import CameraOptics
from flightd.adapters.interlock import FileInterlock
from flightd.adapters.lamp import LedLamp, SwitchedLamp
from flightd.adapters.store.learnt_sensors import learnt_file
from flightd.adapters.store.progress import progress_file
from flightd.adapters.vehicle.connect import connect_vehicle
from flightd.adapters.vehicle.mavlink.vehicle import MavlinkVehicle
from flightd.app.absent_parts import (
    NO_CAMERA,
    NO_COUNTING,
    NO_FITNESS,
    NO_GROUND,
    NO_INTERLOCK,
    NO_LAMP,
    NO_RECORDER,
    NOTHING_KEPT,
    keep_pose,
)
from flightd.app.counting.count import Counting
from flightd.app.detection.detector_pool import DetectorPool, Detectors
from flightd.app.detection.latency import LatencyBook
from flightd.app.detection.pipeline import DetectionPipeline
from flightd.app.flight import Count, Fitness, Flight, SetpointSink, Vision
from flightd.app.flight_orders import configured_order
from flightd.app.frame_tap import NO_FRAMES, FrameTap
from flightd.app.publishers import TelemetryPublishers
from flightd.app.setpoint_pump import SetpointPump
from flightd.config.ground import GroundConfig
from flightd.config.lamp import SWITCHED_BY, LampKind, lamp_switch
from flightd.config.mission import HEIGHT_ROOM_M
from flightd.config.schema import Config
from flightd.config.sweep import ScanMode
from flightd.core.errors import FlightdError, InputError
from flightd.core.flight_order import FlightOrder
from flightd.core.learnt import LearntSensors
from flightd.core.preview import CameraName
from flightd.core.shared_pose import SharedPose
from flightd.core.snapshot import Snapshot
from flightd.core.tick import TICK_S
from flightd.core.topics import Topic
from flightd.core.types import AttitudeSetpoint, EventLevel
from flightd.mission.battery.sorties import check_battery
from flightd.mission.guidance import CEILING_MARGIN_M
from flightd.mission.plan.flight_plan import FlightPlan, HeadingPolicy, counts_shelves, make_plan
from flightd.mission.plan.leg_times import Pace
from flightd.mission.plan.route_optimiser import ordered_best
from flightd.mission.scan.code_assignment import FrontSight
from flightd.mission.scan.no_scan import NO_SCAN, AnyScanner
from flightd.mission.scan.scanner import Scanner
from flightd.mission.scan.sweep_speed import SweepOptics
from flightd.mission.scan.views import view_height_m
from flightd.pilot import Pilot
from flightd.ports import Camera, Clock, Ground, Interlock, Lamp, Monitor, PoseTaker, Recorder, Vehicle
from flightd.runtime.clock import Hold
from flightd.runtime.datagrams import OpenDatagrams, open_datagrams
from flightd.runtime.supervisor import FaultBarrier
from flightd.site.site import ASSUMED_CEILING_M, Site
from flightd.vision.line_detector import Detector
from flightd.vision.lines.colour_profile import SHIPPED


@dataclass(frozen=True, slots=True)
class Peers:
    """Where the vehicle and the cameras are reached, as URLs of their sections."""

    vehicle: str
    camera: str
    front_camera: str


def configured_peers(config: Config) -> Peers:
    """Those of the configuration."""
    return Peers(config.vehicle.url, config.camera.url, config.front_camera.url)


def build(
    config: Config,
    site: Site,
    order: FlightOrder,
    *,
    clock: Clock,
    detectors: Detectors,
    recorder: Recorder = NO_RECORDER,
    ground: Ground = NO_GROUND,
    counting: Counting | None = None,
    monitors: Sequence[Monitor] = (),
    observers: Sequence[Callable[[Snapshot], None]] = (),
    learnt: LearntSensors | None = None,
    keep_files: bool = False,
    peers: Peers | None = None,
    opener: OpenDatagrams = open_datagrams,
    hold: Hold = nullcontext,
    startup_fault: FlightdError | None = None,
    interlock: Interlock | None = None,
    fitness: Fitness = NO_FITNESS,
) -> Flight:
    """Connect the vehicle and the cameras and compose the flight that `order` asks for.  `peers` are those of
    the configuration unless given; `opener` opens sockets and time is held by `hold` while threads work, as
    the event loop wants it; `learnt` is what earlier flights have learnt; the rest as `assemble`.  InputError
    where configuration, map and order contradict each other."""
    peers = peers or configured_peers(config)
    pilot = pilot_of(config, site, order, learnt)
    ground.plan_by(pilot.mission)
    vehicle = connect_vehicle(
        config.vehicle,
        clock,
        config.control,
        battery=config.battery,
        highest_m=site.ceiling_m - config.hazards.headroom_m,
        url=peers.vehicle,
        opener=opener,
    )
    publishers = TelemetryPublishers(clock, vehicle, recorder, ground, monitors, observers)
    kept_fps = 0.0 if recorder is NO_RECORDER else config.recorder.picture_fps
    vision = DetectionPipeline(
        detectors, config.vision.workers, recorder, ground, kept_fps, config.camera.lens(), publishers.pace
    )
    connect = partial(connect_camera, clock=clock, on_trouble=publishers.trouble, vehicle=vehicle, hold=hold)
    down_frames = FrameTap(vision.frames.put)
    camera = connect(config.camera, on_frame=down_frames.put, url=peers.camera)
    front_camera: Camera = NO_CAMERA
    if counting is not None:
        counting.read_for(pilot.places, pilot.evidence)
        counting.show_on(ground)
        front_camera = connect(config.front_camera, on_frame=counting.frame, url=peers.front_camera)
    return assemble(
        config,
        site,
        pilot,
        lamp=lamp_of(config, vehicle, clock, partial(publishers.note, EventLevel.WARNING, "lamp")),
        vehicle=vehicle,
        setpoints=SetpointPump(vehicle, clock, noted(vision.latency, recorder, publishers.barrier), TICK_S),
        vision=vision,
        publishers=publishers,
        clock=clock,
        recorder=recorder,
        ground=ground,
        cameras=(camera, front_camera),
        counting=NO_COUNTING if counting is None else counting,
        keep_files=keep_files,
        startup_fault=startup_fault,
        interlock=interlock,
        fitness=fitness,
        down_frames=down_frames,
    )


def assemble(
    config: Config,
    site: Site,
    pilot: Pilot,
    *,
    vehicle: Vehicle,
    setpoints: SetpointSink,
    vision: Vision,
    publishers: TelemetryPublishers,
    clock: Clock,
    recorder: Recorder = NO_RECORDER,
    ground: Ground = NO_GROUND,
    cameras: tuple[Camera, Camera] = (NO_CAMERA, NO_CAMERA),
    counting: Count = NO_COUNTING,
    keep_files: bool = False,
    startup_fault: FlightdError | None = None,
    interlock: Interlock | None = None,
    fitness: Fitness = NO_FITNESS,
    down_frames: FrameTap = NO_FRAMES,
    lamp: Lamp = NO_LAMP,
) -> Flight:
    """Put a flight together from what is connected already.  `cameras` are the down and the front one;
    `keep_files`: the stops left over are kept in `mission.progress`, what is learnt of the sensors in
    `tracking.learnt`, if those name files; `interlock` is the configured one unless given, `fitness`
    what speaks against a flight on this computer, `down_frames` what the down camera's frames pass."""
    progress, learnt = (config.mission.progress, config.tracking.learnt) if keep_files else (None, None)
    camera, front_camera = cameras
    return Flight(
        clock=clock,
        pilot=pilot,
        vehicle=vehicle,
        setpoints=setpoints,
        camera=camera,
        front_camera=front_camera,
        vision=vision,
        counting=counting,
        recorder=recorder,
        ground=ground,
        progress=NOTHING_KEPT if progress is None else progress_file(progress, site),
        learnt=NOTHING_KEPT if learnt is None else learnt_file(learnt, config),
        publishers=publishers,
        share_pose=_pose_sharing(config, site, vehicle),
        startup_fault=startup_fault,
        interlock=interlock or interlock_of(config, site, clock),
        fitness=fitness,
        down_frames=down_frames,
        lamp=lamp,
    )


def lamp_of(config: Config, vehicle: Vehicle, clock: Clock, on_trouble: Callable[[str], None]) -> Lamp:
    """The configured lamp.  InputError where the vehicle has no such output."""
    switch = lamp_switch(config.front_camera.lamp)
    if switch is None:
        return NO_LAMP
    if switch.kind is LampKind.LED:
        return SwitchedLamp(clock, LedLamp(switch.name), on_trouble, repeats=True)
    kind = SWITCHED_BY[switch.kind]
    if config.vehicle.kind != kind or not isinstance(vehicle, MavlinkVehicle):
        raise InputError(
            f"{config.front_camera.lamp}: only a vehicle of kind {kind} has such an output",
            key="front_camera.lamp",
            remedy="give the lamp of this vehicle, or led:NAME",
        )
    return SwitchedLamp(clock, vehicle.output(switch.number), on_trouble)


def noted(
    latency: LatencyBook, recorder: Recorder, barrier: FaultBarrier
) -> Callable[[AttitudeSetpoint, int], None]:
    """What hears of each setpoint that goes out: it ends a frame's way, and is recorded; what fails there
    stays behind the `barrier`."""

    def sent(setpoint: AttitudeSetpoint, now_ns: int) -> None:
        barrier.call("detection", lambda: latency.sent(now_ns), None)
        barrier.call("recorder", lambda: recorder.record(Topic.SETPOINT, setpoint.stamp_ns, setpoint), None)

    return sent


def interlock_of(config: Config, site: Site, clock: Clock) -> Interlock:
    """What tells whether the aisles are closed.  InputError where the site demands that, and nothing does."""
    settings = config.interlock
    if settings.file is not None:
        return FileInterlock(settings.file, settings.closed, clock, settings.max_age_s)
    if site.interlock:
        raise InputError(
            f"site {site.name} demands it, and there is none",
            key="interlock.file",
            remedy="name the file that says whether the aisles are closed",
        )
    return NO_INTERLOCK


def plan_of(config: Config, site: Site, order: FlightOrder | None = None) -> FlightPlan:
    """The flight plan for an order (by default the configuration's), from its pad and back."""
    flown = site.between(*flown_between_m(config, site))
    return _plan_on(config, flown, order or configured_order(config))


def start_of(order: FlightOrder, site: Site) -> str:
    """The node of the pad on which the drone stands at first.  InputError when the site lacks that pad."""
    wanted = order.pad
    pad = site.home if wanted is None else next((pad for pad in site.pads if pad.id == wanted), None)
    if pad is None:
        names = ", ".join(pad.id for pad in site.pads)
        raise InputError(f"mission.pad {wanted!r}: site {site.name} has the pads {names}")
    return pad.node


def pilot_of(
    config: Config, site: Site, order: FlightOrder | None = None, learnt: LearntSensors | None = None
) -> Pilot:
    """A fresh pilot for one flight of an order (by default the configuration's), which begins with what
    earlier ones have `learnt`.  InputError where map and configuration contradict each other."""
    order = order or configured_order(config)
    _demand_ceiling(config, site)
    if config.mission.height_m > site.ceiling_m - CEILING_MARGIN_M:
        raise InputError(
            f"mission.height_m {config.mission.height_m} is not {CEILING_MARGIN_M} m below the ceiling of"
            f" {site.name} ({site.ceiling_m} m)"
        )
    flown = site.between(*flown_between_m(config, site))
    plan, policy = _plan_on(config, flown, order), HeadingPolicy.of(config, flown)
    scanner = scanner_of(config, site)
    check_battery(flown, plan, policy, config, scanner)
    return Pilot(
        flown, plan, policy, config, scanner, site.overhead_m, autostart=order.autostart, learnt=learnt
    )


def scanner_of(config: Config, site: Site) -> AnyScanner:
    """What counts the shelves; `NO_SCAN` where nothing is counted."""
    if not counts_shelves(config, site):
        return NO_SCAN
    front, highest_m = config.front_camera, site.ceiling_m - CEILING_MARGIN_M
    if config.scan.min_height_m > highest_m:
        raise InputError(
            f"scan.min_height_m {config.scan.min_height_m} is not {CEILING_MARGIN_M} m below the ceiling of"
            f" {site.name} ({site.ceiling_m} m)"
        )
    sight = FrontSight(front.lens(), front.mount())
    optics = SweepOptics.of(config) if config.scan.mode is ScanMode.SWEEP else None
    return Scanner(site, sight, config.scan, highest_m, config.camera.aside_per_height, optics)


def flown_between_m(config: Config, site: Site) -> tuple[float, float]:
    """The heights that are flown between: with a scan, those of its views too.  InputError where they need a
    ceiling that the site does not give."""
    low_m, high_m = config.mission.flown_between_m()
    _demand_ceiling(config, site)
    if not counts_shelves(config, site):
        return low_m, high_m
    views_m = _view_heights_m(config, site, site.ceiling_m - CEILING_MARGIN_M)
    return min(low_m, min(views_m) - HEIGHT_ROOM_M), max(high_m, max(views_m) + HEIGHT_ROOM_M)


def _view_heights_m(config: Config, site: Site, below_m: float) -> list[float]:
    """The heights of the views of all locations, where nothing may be flown above `below_m`."""
    scan, mount = config.scan, config.front_camera.mount()
    heights_m = scan.min_height_m, scan.highest_m(below_m)
    return [
        view_height_m(place.height_m, abs(place.y_m - site.nodes[place.node].y_m), mount, heights_m)
        for place in site.locations.values()
    ]


def _demand_ceiling(config: Config, site: Site) -> None:
    """InputError where something would fly above 2 m under a ceiling that nobody measured."""
    highest_m, key = config.mission.height_m, "mission.height_m"
    if counts_shelves(config, site):
        view_m = max(_view_heights_m(config, site, math.inf))
        if view_m > highest_m:
            highest_m, key = view_m, "the highest view of a shelf (scan.max_height_m)"
    if not site.ceiling_given and highest_m > ASSUMED_CEILING_M - CEILING_MARGIN_M:
        raise InputError(
            f"not given, and {key} is at {highest_m:.2g} m",
            file=f"site {site.name}",
            key="site.ceiling_m",
            remedy="measure the lowest thing under the roof and give it; without it nothing flies above 2 m",
        )


def profile_of(config: Config, site: Site) -> str:
    """The colour profile that is configured, or else the shipped one of the site's paint.  InputError where
    none is shipped for it."""
    if config.vision.profile:
        return config.vision.profile
    if site.line_colour not in SHIPPED:
        raise InputError(
            f"no profile is shipped for paint {site.line_colour}",
            key="vision.profile",
            remedy="train one (page Studio of the ground station, or flightd train-colour) and name its file",
        )
    return site.line_colour


def detector_pool(config: Config, site: Site, clock: Clock, hold: Hold = nullcontext) -> DetectorPool:
    """Detector processes after the configuration; the colour profile is read here, so that a wrong one
    is found before anything flies."""
    make = detector_of(config, site)
    make()
    return DetectorPool(make, config.vision.workers, config.vision.timeout_s, clock, hold)


def detector_of(config: Config, site: Site) -> Callable[[], Detector]:
    """What makes the detector that configuration and map ask for (in its own process, where it flies)."""
    camera, vision = config.camera, config.vision
    lens = camera.lens() if camera.lens().is_distorted else None
    profile = profile_of(config, site)
    return partial(Detector, vision.method, profile, lens, markers=site.marker_set, in_flight=True)


def ground_link(
    settings: GroundConfig,
    site: Site,
    clock: Clock,
    counting: Counting | None = None,
    maintainer: Maintainer | None = None,
    optics: Sequence[CameraOptics] = (),
) -> ZmqGround | None:
    """The link to ground stations, not listening yet; None where none is wanted."""
    if not settings.listen:
        return None
    if counting is None:
        return ZmqGround(settings, site, clock, maintainer=maintainer, optics=optics)
    return ZmqGround(settings, site, clock, counting.places, tuple(CameraName), maintainer, optics)


def _plan_on(config: Config, flown: Site, order: FlightOrder) -> FlightPlan:
    """The plan on a site that has only the keep-outs of the heights flown."""
    visits: Sequence[str] = order.nodes or flown.serpentine_route()
    start, home, policy = start_of(order, flown), flown.home.node, HeadingPolicy.of(config, flown)
    if order.best_order:
        pace = Pace.of(config.mission)
        visits = ordered_best(flown, visits, (start, home), policy, pace, order.start_yaw_rad)
    return make_plan(flown, visits, start, home, policy, order.start_yaw_rad)


def _pose_sharing(config: Config, site: Site, vehicle: Vehicle) -> Callable[[SharedPose | None], None]:
    """What tells the vehicle's own estimator of the motion, and of the pad to land on if it shall."""
    if not config.vehicle.shares_pose or not isinstance(vehicle, PoseTaker):
        return keep_pose
    pad = site.nodes[site.home.node]
    return partial(vehicle.share_pose, pad_m=(pad.x_m, pad.y_m) if config.vehicle.landing_target else None)
