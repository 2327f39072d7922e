"""What `flightd sim` was asked for -> a simulation to be flown, or what is wrong with it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from flightd.app.flight_orders import configured_order, going_on
from flightd.app.simulation.process_faults import check_faults
from flightd.app.simulation.simulation import Simulation
from flightd.app.simulation.simulator_config import simulator_config
from flightd.config.schema import Config
from flightd.core.errors import InputError
from flightd.sim.external.external_simulator import truth_address
from flightd.sim.plant.plant_kind import PlantKind
from flightd.sim.racks.face_light import check_names
from flightd.sim.scenario.scenario import Scenario
from flightd.sim.sensors.camera_path import CameraPath
from flightd.sim.unknowns import WorldKind, unknowns_of

_FACTORS = 0.05, 50.0


@dataclass(frozen=True, slots=True)
class SimOptions:
    """The options of the command, as they were given."""

    config: Path | None = None
    warehouse: str | None = None
    seed: int = 1
    vehicle: str | None = None
    speed: str | None = None
    settings: Sequence[str] = ()
    truth_url: str = ""
    vehicle_url: str = ""
    world: str = WorldKind.USUAL
    plant: str = PlantKind.OWN
    camera: str = CameraPath.SHARED

    def check(self) -> None:
        """InputError where options contradict each other."""
        if self.world not in list(WorldKind):
            kinds = ", ".join(WorldKind)
            raise InputError(f"--world {self.world}: no such world; give one of {kinds}")
        if self.plant not in list(PlantKind):
            kinds = ", ".join(PlantKind)
            raise InputError(f"--plant {self.plant}: no such airframe; give one of {kinds}")
        if self.camera not in list(CameraPath):
            paths = ", ".join(CameraPath)
            raise InputError(f"--camera {self.camera}: no such path of its frames; give one of {paths}")
        if self.truth_url and self.plant != PlantKind.OWN:
            raise InputError(f"--plant {self.plant}: with --truth-url the other simulator is the airframe")
        if bool(self.truth_url) is not bool(self.vehicle_url):
            raise InputError("--truth-url and --vehicle-url belong together: give both or neither")


def prepare(
    options: SimOptions,
    scenario: Scenario,
    folder: Path,
    say: Callable[[str], None],
    *,
    sweep_route: str = "",
) -> Simulation:
    """The simulation, its results' folder made; `say` hears in a line what will not be as one might expect.
    `sweep_route` is the route where every scenario is flown in turn (`--set` text): then only those that need
    the clock go by it.  InputError for what cannot be flown."""
    options.check()
    camera = CameraPath(options.camera)
    settings = [sweep_route, *options.settings] if sweep_route else options.settings
    config, site = simulator_config(
        options.config,
        options.warehouse,
        scenario,
        settings,
        options.vehicle,
        options.vehicle_url,
        camera,
    )
    _check_camera(camera, config.vehicle.kind, scenario)
    clock = scenario.needs_real_time
    wanted = None if sweep_route and not clock else options.speed
    own_clock = _own_clock(config.vehicle.kind, options.truth_url, camera)
    factor = _clocked(wanted, say) if clock and wanted in {None, "max"} else _factor(wanted, own_clock)
    if options.truth_url:
        truth_address(options.truth_url)
    if factor is None:
        _say_what_is_off(config, say)
    check_names(scenario.racks.light, site)
    check_faults(scenario.fault, config, site, external=bool(options.truth_url))
    _make_folder(folder, going_on=bool(config.inventory.run))
    order = going_on(configured_order(config), config.inventory.run, site, folder)
    return Simulation(
        config,
        site,
        scenario,
        options.seed,
        factor,
        folder,
        truth_url=options.truth_url,
        order=order,
        unknowns=unknowns_of(WorldKind(options.world), options.seed),
        plant=PlantKind(options.plant),
        camera=camera,
    )


def _check_camera(path: CameraPath, vehicle: str, scenario: Scenario) -> None:
    """InputError for frames that cannot reach the daemon so."""
    if not path.is_stream:
        return
    if vehicle == "ardrone":
        raise InputError(f"--camera {path}: an AR.Drone streams its pictures itself; leave --camera out")
    lens = scenario.camera.camera().lens
    if problem := path.problem(lens):
        raise InputError(
            f"--camera {path}: it carries pictures {problem}, not {lens.width_px}x{lens.height_px};"
            " give another width_px and height_px in [camera] of a scenario (--scenario FILE)"
        )


def _say_what_is_off(config: Config, say: Callable[[str], None]) -> None:
    """What runs by the clock has no place in lockstep."""
    if config.ground.listen:
        say("the ground link is off in lockstep; --speed 1 turns it on")
    if config.metrics.listen:
        say("metrics.listen is off in lockstep; --speed 1 turns it on")


def _own_clock(vehicle: str, truth_url: str, camera: CameraPath) -> str:
    """Who keeps a clock of his own, which rules out lockstep; an empty text for nobody."""
    if vehicle == "mavsdk":
        return "MAVSDK"
    return "a stream" if camera.is_stream else "an external simulator" if truth_url else ""


def _clocked(speed: str | None, say: Callable[[str], None]) -> float:
    """Real time, for a scenario that makes sense by the clock only."""
    if speed == "max":
        raise InputError("--speed max: faults of processes and of the ground link need the clock: --speed 1")
    say("this scenario is flown in real time (--speed 1)")
    return 1.0


def _factor(speed: str | None, own_clock: str) -> float | None:
    """Multiple of real time, None for lockstep."""
    if speed is None:
        return 1.0 if own_clock else None
    try:
        factor = float(speed)
    except ValueError:
        factor = 0.0
    if own_clock and speed == "max":
        raise InputError(
            f"--speed max: {own_clock} keeps a clock of its own; leave --speed out for real time"
        )
    if own_clock in {"MAVSDK", "a stream"} and factor != 1.0:
        raise InputError(
            f"--speed {speed}: {own_clock} keeps a clock of its own; it flies with --speed 1 only"
        )
    if speed == "max":
        return None
    if not _FACTORS[0] <= factor <= _FACTORS[1]:
        raise InputError(f"--speed {speed}: expected max, or a factor between 0.05 and 50")
    return factor


def _make_folder(out: Path, *, going_on: bool) -> None:
    """An empty place for the results; the inventory of a count that goes on stays."""
    old = ["summary.json"]
    if not going_on:
        old += ["inventory.db", "inventory.db-wal", "inventory.db-shm"]
    try:
        out.mkdir(parents=True, exist_ok=True)
        for name in old:
            (out / name).unlink(missing_ok=True)
    except OSError as err:
        raise InputError(f"--out {out}: {err.strerror}; give a folder that can be written") from err
