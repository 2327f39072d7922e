"""One simulated flight to be flown: its setting, its world, and what is true in it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from flightd.adapters.vehicle.mavlink.link.connection import Firmware
from flightd.adapters.vehicle.mavlink.required_parameters import FIRMWARES, Job, advice_for, rules_for
from flightd.app.build import plan_of, start_of
from flightd.app.flight_orders import configured_order
from flightd.app.recording import FlightSetting
from flightd.app.simulation.ports import WorldPorts
from flightd.config.schema import Config
from flightd.core.flight_order import FlightOrder
from flightd.core.snapshot import Snapshot
from flightd.mission.plan.flight_plan import FlightPlan
from flightd.sim.autopilot.parameters import COPTER_PARAMETERS, PX4_PARAMETERS
from flightd.sim.autopilot.shipped_parameters import shipped_parameters
from flightd.sim.plant.plant_kind import PlantKind
from flightd.sim.racks.stock_truth import LocationTruth, stock_truth
from flightd.sim.scenario.scenario import Scenario
from flightd.sim.sensors.camera_path import CameraPath
from flightd.sim.unknowns import NOTHING, Unknowns
from flightd.sim.world import FrontSpec, WorldSpec
from flightd.site.site import Site

FLIGHT_LOG: Final = "flight.mcap"
"""What the simulator calls the log of the flight in its folder."""


@dataclass(frozen=True, slots=True)
class Simulation:
    """One simulated flight to be flown; `speed` None is lockstep."""

    config: Config
    site: Site
    scenario: Scenario
    seed: int
    speed: float | None
    folder: Path
    observer: Callable[[Snapshot], None] = lambda _: None
    truth_url: str = ""
    """An external simulator's truth link; the configuration says where its vehicle is flown."""
    order: FlightOrder | None = None
    """What this flight is to do; None: what the configuration says."""
    unknowns: Unknowns = NOTHING
    plant: PlantKind = PlantKind.OWN
    camera: CameraPath = CameraPath.SHARED

    @property
    def flight_log(self) -> Path:
        return self.folder / FLIGHT_LOG

    @property
    def truth_log(self) -> Path:
        return self.folder / "truth.mcap"

    @property
    def setting(self) -> FlightSetting:
        """What it is flown by."""
        return FlightSetting(self.config, self.site, self.order or configured_order(self.config))

    @property
    def painted_site(self) -> Site:
        """The site as it really is."""
        configured = self.scenario.floor.site(self.site, self.seed)
        return self.unknowns.floor(configured, self.seed)

    def plan(self) -> FlightPlan:
        """The plan of the flight at its start."""
        return plan_of(self.config, self.site, self.setting.order)


def world_spec(simulation: Simulation, ports: WorldPorts) -> WorldSpec:
    """The world that it is flown in, its peers at `ports`."""
    scenario, config = simulation.scenario, simulation.config
    adapter, order = config.vehicle.kind, simulation.setting.order
    return WorldSpec(
        site=simulation.painted_site,
        seed=simulation.seed,
        camera_address=("127.0.0.1", ports.camera),
        vehicle="px4" if adapter == "mavsdk" else adapter,
        vehicle_ports=ports.vehicle,
        start=start_of(order, simulation.site),
        start_yaw_rad=order.start_yaw_rad + math.radians(scenario.vehicle.start_yaw_deg),
        start_offset_m=scenario.vehicle.start_offset_m,
        camera=replace(scenario.camera.camera(), mount=config.camera.mount()),
        camera_path=simulation.camera,
        front=_front(simulation, ports.front_camera),
        appearance=simulation.unknowns.look(scenario.floor.surface(), told=scenario.floor.tells_appearance),
        wind=simulation.unknowns.wind(scenario.wind.params(), told=scenario.wind.tells_gusts),
        battery_frac=scenario.vehicle.battery,
        battery_ah=scenario.vehicle.battery_ah,
        pads=scenario.vehicle.pads(),
        radio=scenario.vehicle.radio(),
        clock_ppm=scenario.vehicle.clock_ppm + simulation.unknowns.clock_ppm - 20.0,
        range_least_m=scenario.vehicle.range_least_m,
        second_range_m=scenario.vehicle.second_range_m,
        parameters=_set_up(config),
        truth_url=simulation.truth_url,
        faults=scenario.fault,
        unknowns=simulation.unknowns,
        cheap=simulation.unknowns.cheap(told=scenario.floor.tells_appearance),
        plant=simulation.plant,
    )


def _set_up(config: Config) -> dict[str, float]:
    """The simulated autopilot's parameters beyond those that are shipped: as `flightd doctor --fix` leaves
    them for what is configured."""
    firmware = FIRMWARES.get(config.vehicle.kind)
    if firmware is None:
        return {}
    is_px4 = firmware is Firmware.PX4
    known: Mapping[str, float | int] = PX4_PARAMETERS if is_px4 else COPTER_PARAMETERS
    values = {**known, **shipped_parameters("px4" if is_px4 else "ardupilot", known)}
    job = Job.of(config.vehicle, config.battery)
    return {
        name: rule.better
        for rule in (*rules_for(firmware, job), *advice_for(firmware, job))
        for name in rule.names
        if name in values and rule.better is not None and not rule.fits(values[name])
    }


def _front(simulation: Simulation, port: int | None) -> FrontSpec | None:
    if port is None:
        return None
    scenario = simulation.scenario
    camera = replace(scenario.front_camera.camera(), mount=simulation.config.front_camera.mount())
    return FrontSpec(("127.0.0.1", port), camera, scenario.racks.appearance())


def truth_of(simulation: Simulation) -> dict[str, LocationTruth]:
    """What is really at every location of the simulated racks; empty without a front camera before them."""
    if not simulation.config.front_camera.is_fitted:
        return {}
    scenario = simulation.scenario
    focal_px = scenario.front_camera.camera().lens.fx_px
    return stock_truth(simulation.painted_site, scenario.racks.appearance(), focal_px, simulation.seed)
