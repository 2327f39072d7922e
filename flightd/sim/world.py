"""The world in a box: warehouse, airframe, autopilot and camera, as peers on sockets.

It knows nothing of the daemon but the address that its camera reports to.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, nullcontext
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from typing import Literal, Protocol

from flightd.core.errors import FlightdError, RunError, UnavailableError
from flightd.core.extras import missing_extra
from flightd.core.topics import Document, Topic
from flightd.core.types import Image
from flightd.ports import Clock, Recorder
from flightd.runtime.clock import Hold
from flightd.runtime.frame_ring import FrameTicket
from flightd.sim.appearance import DEFAULT, Appearance
from flightd.sim.autopilot.autopilot import AutopilotPeer, PeerConfig
from flightd.sim.autopilot.copter import ArduCopterPeer
from flightd.sim.autopilot.parameters import COPTER_PARAMETERS, PX4_PARAMETERS
from flightd.sim.autopilot.px4 import Px4Peer
from flightd.sim.autopilot.radio import PERFECT, RadioParams
from flightd.sim.autopilot.shipped_parameters import shipped_parameters
from flightd.sim.external.external_simulator import ExternalVehicle
from flightd.sim.external.external_truth import Placement
from flightd.sim.floor.paint_damage import PALLET_HEIGHT_M, PaintDamage
from flightd.sim.floor.renderer import Renderer
from flightd.sim.plant.airframe import Airframe, AirframeParams
from flightd.sim.plant.charge_pads import ChargePads, PadService
from flightd.sim.plant.kinematics import ArmedChange, Kinematics
from flightd.sim.plant.plant_kind import PlantKind, airframe_kind
from flightd.sim.plant.wind import WindParams
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.front_camera import FrontCamera
from flightd.sim.racks.renderer import FrontRenderer
from flightd.sim.scenario.fault_schema import Fault
from flightd.sim.scenario.faults import FaultListener, WorldFaults, bare_boxes
from flightd.sim.sensors.battery_monitor import MonitorParams
from flightd.sim.sensors.camera import CameraPeer, PictureMaker
from flightd.sim.sensors.camera_path import CameraPath
from flightd.sim.sensors.cheap_camera import FAITHFUL, CheapCamera, CheapParams
from flightd.sim.sensors.instruments import Goods, SensorParams, Sensors
from flightd.sim.sensors.optics import SimCamera
from flightd.sim.unknowns import NOTHING, Unknowns
from flightd.site.site import Site
from flightd.site.site_file import site_toml

_TRUTH_PERIOD_S = 0.02
_LAMP = 0.9
"""The light of the drone's lamp 1 m away, as a part of the usual one."""


@dataclass(frozen=True, slots=True)
class FrontSpec:
    """A front camera before racks, and the address that it reports to."""

    address: tuple[str, int]
    camera: FrontCamera = field(default_factory=FrontCamera)
    appearance: RackAppearance = field(default_factory=RackAppearance)


@dataclass(frozen=True, slots=True)
class WorldSpec:
    """Everything that makes one simulated world; a port 0 takes any free one.  An AR.Drone has four:
    commands, navdata, video and configuration; it transmits its pictures itself.  With a `truth_url` the
    vehicle is an external simulator's, which stands on the pad, and only the camera is ours; `radio` lies
    between a MAVLink autopilot and its companion.  `pads` is what charge pads do.  The vehicle stands
    `start_offset_m` (x, y) away from the start pad's centre.
    `faults` go wrong on the way.  A MAVLink autopilot is set up as the shipped parameter file says, but for
    `parameters`; its clock runs `clock_ppm` fast, its range finder measures from `range_least_m` on, and one
    beside it reads `second_range_m` more (None: there is none).  `unknowns` are what no configuration
    tells of it all; `cheap` is what the down camera does by itself.  On `camera_path` its frames reach the
    daemon, but for an AR.Drone's."""

    site: Site
    seed: int
    camera_address: tuple[str, int]
    vehicle: Literal["ardupilot", "px4", "ardrone"] = "ardupilot"
    vehicle_ports: tuple[int, ...] = (0,)
    start: str | None = None
    start_yaw_rad: float = 0.0
    start_offset_m: tuple[float, float] = (0.0, 0.0)
    camera: SimCamera = field(default_factory=SimCamera)
    camera_path: CameraPath = CameraPath.SHARED
    front: FrontSpec | None = None
    appearance: Appearance = DEFAULT
    wind: WindParams = field(default_factory=WindParams)
    battery_frac: float = 1.0
    battery_ah: float = 5.0
    pads: PadService = field(default_factory=PadService)
    radio: RadioParams = PERFECT
    clock_ppm: float = 20.0
    range_least_m: float = 0.05
    second_range_m: float | None = None
    truth_url: str = ""
    faults: tuple[Fault, ...] = ()
    parameters: Mapping[str, float] = field(default_factory=dict)
    unknowns: Unknowns = NOTHING
    cheap: CheapParams = FAITHFUL
    plant: PlantKind = PlantKind.OWN


class VehiclePeer(Protocol):
    """A simulated vehicle on its sockets."""

    async def open(self) -> tuple[str, int]: ...

    async def run(self) -> None: ...

    @property
    def armed(self) -> bool | None:
        """Whether its motors may turn; None where that is not known."""
        ...

    def truth(self) -> Kinematics: ...

    def truth_at(self, stamp_ns: int) -> Kinematics: ...


class World:
    """The running peers.  `open` binds the vehicle's port, `run` lives until cancelled."""

    def __init__(
        self,
        spec: WorldSpec,
        clock: Clock,
        recorder: Recorder,
        tell: FaultListener = lambda _index, _begins: None,
        hold: Hold = nullcontext,
        drawn: Callable[[FrameTicket], None] = lambda _: None,
    ) -> None:
        """`tell` hears of the faults that are not the world's own, `drawn` of the down camera's pictures
        unless they are streamed; time is held by `hold` while pictures are being drawn.  InputError for a
        fault at an unknown node, UnavailableError without a video library that is needed."""
        self._clock = clock
        self._recorder = recorder
        self._opened = ExitStack()
        self._unknowns, self._floor = spec.unknowns, site_toml(spec.site)
        self._damage = spec.unknowns.paint_damage(spec.site, spec.seed)
        start = _placement(spec)
        airframe = airframe_kind(spec.plant)(
            spec.unknowns.airframe(AirframeParams(battery_capacity_ah=spec.battery_ah)),
            wind=spec.wind,
            seed=spec.seed,
            x_m=start.x_m,
            y_m=start.y_m,
            yaw_rad=start.yaw_rad,
            battery_frac=spec.battery_frac,
            wash=spec.unknowns.wash(spec.site, spec.seed),
        )
        goods = [Goods(*box, PALLET_HEIGHT_M) for box in self._damage.pallets]
        self.vehicle: VehiclePeer
        lamp: Callable[[], float] = float
        show: Callable[[Image, int], None] | None = None
        own_front: CameraPeer | None = None
        if spec.truth_url:
            self.vehicle = ExternalVehicle(spec.truth_url, clock, start)
        elif spec.vehicle == "ardrone":
            self.vehicle, show, own_front = _ardrone(spec, airframe, goods, clock, hold)
        else:
            self.vehicle = autopilot = _autopilot(spec, airframe, goods, clock)

            def lamp() -> float:
                return _LAMP if autopilot.lamp_lit else 0.0

        if spec.camera_path.is_stream:
            show = _streaming(spec, recorder, self._opened)
        serves = spec.pads != PadService() and not spec.truth_url
        self._charge_pads = ChargePads(spec.site, airframe, spec.pads) if serves else None
        truth_at = self.vehicle.truth_at
        self._cameras = {"camera": down_camera(spec, self._damage, truth_at, clock, show, hold, drawn)}
        if own_front is not None:
            self._cameras["ardrone-front-camera"] = own_front
        if spec.front is not None:
            self._cameras["front-camera"] = _front_camera(spec, spec.front, self.vehicle, clock, hold, lamp)
        self._faults = WorldFaults(
            spec.faults, spec.site, self._cameras, airframe, self.vehicle, tell, spec.seed
        )

    async def open(self) -> tuple[str, int]:
        """Bind the vehicle's sockets; the address to which a daemon sends commands.  UnavailableError when
        a port is taken or an external simulator does not tell its truth."""
        try:
            return await self.vehicle.open()
        except OSError as err:
            raise UnavailableError(f"the simulated vehicle cannot listen: {err.strerror}") from err

    async def run(self, opened: Callable[[], None] = lambda: None) -> None:
        """Live until cancelled; `opened` is called when the vehicle can be talked to (an external one's truth
        is known then, so that it can be drawn).  UnavailableError as for `open`; RunError when a peer fails:
        the world ends with it."""
        await self.open()
        drawn = {**asdict(self._unknowns), "paint_damage": asdict(self._damage)}
        told = Document(json.dumps(drawn, indent=1))
        self._recorder.record(Topic.UNKNOWNS, self._clock.now_ns(), told)
        self._recorder.record(Topic.MAP, self._clock.now_ns(), Document(self._floor))
        try:
            async with asyncio.TaskGroup() as tasks:
                tasks.create_task(self.vehicle.run(), name="autopilot")
                for name, camera in self._cameras.items():
                    tasks.create_task(camera.run(), name=name)
                tasks.create_task(self._log_truth(), name="truth")
                faults = self._faults.run(self._clock, self.vehicle.truth_at, self._recorder)
                tasks.create_task(faults, name="faults")
                if self._charge_pads is not None:
                    tasks.create_task(self._charge_pads.run(self._clock, self._at), name="charge pads")
                opened()
        except ExceptionGroup as failures:
            raise _cause(failures) from failures
        finally:
            self._opened.close()

    def _at(self, now_ns: int) -> None:
        """Bring the vehicle up to the present."""
        self.vehicle.truth_at(now_ns)

    async def _log_truth(self) -> None:
        armed: bool | None = None
        while True:
            truth: Kinematics = self.vehicle.truth()
            self._recorder.record(Topic.TRUTH, truth.stamp_ns, truth)
            if (now := self.vehicle.armed) is not None and now is not armed:
                armed = now
                self._recorder.record(Topic.ARMED, truth.stamp_ns, ArmedChange(truth.stamp_ns, now))
            await asyncio.sleep(_TRUTH_PERIOD_S)


def _placement(spec: WorldSpec) -> Placement:
    """Where the vehicle stands at the start."""
    start = spec.start or spec.site.home.node
    pad = next(pad for pad in spec.site.pads if pad.node == start)
    x_m, y_m = spec.site.pad_centre(pad)
    return Placement(x_m + spec.start_offset_m[0], y_m + spec.start_offset_m[1], spec.start_yaw_rad)


def _autopilot(spec: WorldSpec, airframe: Airframe, goods: Sequence[Goods], clock: Clock) -> AutopilotPeer:
    (port,) = spec.vehicle_ports
    is_px4 = spec.vehicle == "px4"
    known = PX4_PARAMETERS if is_px4 else COPTER_PARAMETERS
    parameters = {**shipped_parameters("px4" if is_px4 else "ardupilot", known), **spec.parameters}
    down, up = spec.unknowns.radio(spec.radio)
    config = PeerConfig(
        port=port,
        seed=spec.seed,
        radio=down,
        radio_up=up,
        parameters=parameters,
        clock_ppm=spec.clock_ppm,
        clock_leap=spec.unknowns.clock_leap,
        sensors=_sensors(spec, SensorParams(range_min_m=spec.range_least_m, goods=goods)),
        second_range_m=spec.second_range_m,
    )
    return Px4Peer(clock, airframe, config) if is_px4 else ArduCopterPeer(clock, airframe, config)


def _sensors(spec: WorldSpec, configured: SensorParams) -> SensorParams:
    """The vehicle's, set up for its battery, as they really are."""
    return spec.unknowns.sensors(replace(configured, battery=MonitorParams(spec.battery_ah)))


def down_camera(
    spec: WorldSpec,
    damage: PaintDamage,
    truth_at: Callable[[int], Kinematics],
    clock: Clock,
    show: Callable[[Image, int], None] | None,
    hold: Hold,
    drawn: Callable[[FrameTicket], None],
) -> CameraPeer:
    """The camera that looks at the floor, as it really is."""
    damage = replace(damage, gaps=damage.gaps + bare_boxes(spec.faults, spec.site))
    camera = spec.unknowns.camera(spec.camera)
    look = replace(spec.appearance, flicker=0.0) if spec.cheap.flicker else spec.appearance
    make: Callable[[], PictureMaker] = partial(Renderer, spec.site, camera, look, spec.seed, damage)
    if spec.cheap != FAITHFUL:
        make = partial(CheapCamera, make, camera, spec.cheap, spec.seed)
    seed, address = f"camera {spec.seed}", spec.camera_address
    shaken, leap = spec.unknowns.shaken(spec.seed), spec.unknowns.camera_leap
    return CameraPeer(
        camera,
        make,
        seed,
        address,
        lambda ns: shaken(truth_at(ns)),
        clock,
        show,
        hold=hold,
        leap=leap,
        drawn=drawn,
    )


def _streaming(spec: WorldSpec, recorder: Recorder, opened: ExitStack) -> Callable[[Image, int], None]:
    """Where the floor's pictures go to be streamed.  UnavailableError without the video library."""
    try:
        from flightd.sim.sensors.camera_stream import (  # noqa: PLC0415 - video needs an optional extra
            CameraStream,
            ExposedFrame,
        )
    except ModuleNotFoundError as err:
        raise missing_extra("ardrone", f"--camera {spec.camera_path}") from err
    camera = spec.camera
    stream = CameraStream(spec.camera_path, spec.camera_address, camera.lens, camera.fps)
    opened.callback(stream.close)

    def send(bgr: Image, exposed_ns: int) -> None:
        if stream.send(bgr, exposed_ns):
            recorder.record(Topic.EXPOSED, exposed_ns, ExposedFrame(exposed_ns))

    return send


def _front_camera(
    spec: WorldSpec,
    front: FrontSpec,
    vehicle: VehiclePeer,
    clock: Clock,
    hold: Hold,
    lamp: Callable[[], float],
) -> CameraPeer:
    look = spec.unknowns.racks(front.appearance, spec.site, spec.seed)
    make = partial(FrontRenderer, spec.site, front.camera, look, spec.seed)
    seed, truth_at = f"front camera {spec.seed}", vehicle.truth_at
    address = front.address
    return CameraPeer(
        front.camera, make, seed, address, truth_at, clock, hold=hold, name="front camera", lamp=lamp
    )


def _cause(failures: ExceptionGroup[Exception]) -> FlightdError:
    """Of what a world died, as one error: what a person can do something about comes first."""
    leaves = list(_leaves(failures))
    told = next((leaf for leaf in leaves if isinstance(leaf, FlightdError)), None)
    return told or RunError(f"the simulated world failed: {type(leaves[0]).__name__}: {leaves[0]}")


def _leaves(failure: Exception) -> Iterator[Exception]:
    if isinstance(failure, ExceptionGroup):
        for part in failure.exceptions:
            yield from _leaves(part)
    else:
        yield failure


def _ardrone(
    spec: WorldSpec, airframe: Airframe, goods: Sequence[Goods], clock: Clock, hold: Hold
) -> tuple[VehiclePeer, Callable[[Image, int], None], CameraPeer]:
    """The emulated AR.Drone, where the floor's pictures go, and its own front camera.  UnavailableError
    without its video library."""
    try:
        from flightd.sim.ardrone.drone import Drone  # noqa: PLC0415 - its video needs an optional extra
        from flightd.sim.ardrone.front_camera import front_peer  # noqa: PLC0415
        from flightd.sim.ardrone.server import ArDroneServer, DronePorts  # noqa: PLC0415
        from flightd.sim.ardrone.video import VideoChannel  # noqa: PLC0415
    except ModuleNotFoundError as err:
        raise missing_extra("ardrone", "simulating an AR.Drone") from err
    drone = Drone(airframe, Sensors(_sensors(spec, SensorParams(goods=goods)), seed=spec.seed))
    ports = DronePorts("127.0.0.1", *spec.vehicle_ports)
    server = ArDroneServer(drone, clock, ports, air=spec.radio, seed=spec.seed)
    appearance = spec.front.appearance if spec.front is not None else RackAppearance()
    front = front_peer(server, spec.site, appearance, spec.seed, clock, hold)
    return server, partial(server.show, camera=VideoChannel.BOTTOM), front
