"""What a simulated flight is flown in: a small typed TOML format of which every key may be left out.

The guide ("Simulation") has all of them with their defaults; the kinds of `[[fault]]` and their keys are in
`fault_schema`, those of `[expect]` in `sim.judge.expectation`."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from flightd.config.section import Section
from flightd.sim.appearance import Appearance, preset
from flightd.sim.autopilot.radio import RadioParams
from flightd.sim.floor.misplaced_lines import misplaced
from flightd.sim.judge.expectation import Expectation
from flightd.sim.plant.charge_pads import PadService
from flightd.sim.plant.wind import WindParams
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.front_camera import FrontCamera, front_lens
from flightd.sim.racks.stock import StockShares
from flightd.sim.scenario.fault_schema import Fault
from flightd.sim.sensors.optics import SimCamera, wide_lens
from flightd.site.site import Site

_Shift = Annotated[float, Field(ge=-2, le=2, allow_inf_nan=False)]
_Carried = Annotated[float, Field(ge=-100, le=100, allow_inf_nan=False)]
_Light = Annotated[float, Field(ge=0.05, le=4, allow_inf_nan=False)]


class CameraScenario(Section):
    width_px: int = Field(640, ge=64, le=3840)
    height_px: int = Field(360, ge=36, le=2160)
    fps: float = Field(30.0, gt=1, le=120)
    capture_delay_s: float = Field(0.060, ge=0, le=1)
    jitter_s: float = Field(0.003, ge=0, le=0.1)
    exposure_s: float = Field(0.004, gt=0, le=0.1)
    readout_s: float = Field(0.015, ge=0, le=0.1)

    @model_validator(mode="after")
    def _exposure_fits(self) -> Self:
        self.camera()  # knows what does not fit together
        return self

    def camera(self) -> SimCamera:
        return SimCamera(
            lens=wide_lens().scaled(self.width_px, self.height_px),
            fps=self.fps,
            exposure_s=self.exposure_s,
            capture_delay_s=self.capture_delay_s,
            jitter_s=self.jitter_s,
            readout_s=self.readout_s,
        )


class FrontCameraScenario(Section):
    width_px: int = Field(1280, ge=64, le=4096)
    height_px: int = Field(800, ge=64, le=4096)
    focal_px: float = Field(1000.0, gt=50, le=20_000)
    fps: float = Field(4.0, ge=0.5, le=60)
    exposure_s: float = Field(0.002, gt=0, le=0.01)
    capture_delay_s: float = Field(0.080, ge=0, le=1)
    jitter_s: float = Field(0.005, ge=0, le=0.1)
    focus_m: float = Field(1.2, gt=0.1, le=100)

    def camera(self) -> FrontCamera:
        return FrontCamera(
            lens=front_lens(self.width_px, self.height_px, self.focal_px),
            fps=self.fps,
            exposure_s=self.exposure_s,
            capture_delay_s=self.capture_delay_s,
            jitter_s=self.jitter_s,
            focus_m=self.focus_m,
        )


_USUAL = StockShares()


class RacksScenario(Section):
    empty: float = Field(_USUAL.empty, ge=0, le=1)
    tilted: float = Field(_USUAL.tilted, ge=0, le=1)
    glossy: float = Field(_USUAL.glossy, ge=0, le=1)
    several: float = Field(_USUAL.several, ge=0, le=1)
    torn: float = Field(_USUAL.torn, ge=0, le=1)
    too_small: float = Field(_USUAL.too_small, ge=0, le=1)
    missing: float = Field(_USUAL.missing, ge=0, le=1)
    occluded: float = Field(_USUAL.occluded, ge=0, le=1)
    dark: float = Field(_USUAL.dark, ge=0, le=1)
    in_part: float = Field(0.0, ge=0, le=1)
    cartons: float = Field(0.0, ge=0, le=1)
    location_labels: bool = True
    seed: int | None = Field(None, ge=0)
    noise: float = Field(2.0, ge=0, le=20)
    exposure: float = Field(1.0, gt=0, le=3)
    light: dict[str, _Light] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _shares_leave_room(self) -> Self:
        self.shares()
        return self

    def shares(self) -> StockShares:
        return StockShares(**{name: getattr(self, name) for name in StockShares.names()})

    def appearance(self) -> RackAppearance:
        return RackAppearance(
            shares=self.shares(),
            seed=self.seed,
            location_labels=self.location_labels,
            noise=self.noise,
            exposure=self.exposure,
            in_part=self.in_part,
            cartons=self.cartons,
            light=self.light,
        )


class FloorScenario(Section):
    appearance: Literal["default", "clean", "harsh", "dim", "glossy", "worn"] = "default"

    pad_off_m: tuple[_Shift, _Shift] = (0.0, 0.0)
    map_error_m: float = Field(0.0, ge=0, le=0.3)

    def site(self, site: Site, seed: int = 0) -> Site:
        """The site as it really is: its lines beside where the map has them, drawn by the `seed`, and its
        pads pushed about.  InputError where no such floor can be laid out."""
        if self.map_error_m:
            site = misplaced(site, self.map_error_m, seed)
        dx_m, dy_m = self.pad_off_m
        pads = (replace(pad, offset_m=(pad.offset_m[0] + dx_m, pad.offset_m[1] + dy_m)) for pad in site.pads)
        return replace(site, pads=tuple(pads))

    @property
    def tells_appearance(self) -> bool:
        """Whether the scenario says how the floor looks; else the world does."""
        return "appearance" in self.model_fields_set

    def surface(self) -> Appearance:
        return preset(self.appearance)


class WindScenario(Section):
    mean_x_mps: float = Field(0.0, ge=-10, le=10)
    mean_y_mps: float = Field(0.0, ge=-10, le=10)
    gust_mps: float = Field(WindParams().gust_rms_mps, ge=0, le=10)

    @property
    def tells_gusts(self) -> bool:
        """Whether the scenario says how strong the gusts are; else the world does."""
        return "gust_mps" in self.model_fields_set

    def params(self) -> WindParams:
        return WindParams(self.mean_x_mps, self.mean_y_mps, self.gust_mps)


class VehicleScenario(Section):
    battery: float = Field(1.0, ge=0, le=1)
    battery_ah: float = Field(5.0, gt=0.05, le=100)
    swap_s: float = Field(30.0, ge=0, le=3600)
    contact_s: float = Field(0.0, ge=0, le=86_400)
    start_offset_m: tuple[_Carried, _Carried] = (0.0, 0.0)
    start_yaw_deg: float = Field(0.0, ge=-180, le=180)
    radio_loss: float = Field(0.0, ge=0, le=1)
    radio_delay_ms: float = Field(0.0, ge=0, le=2000)
    radio_jitter_ms: float = Field(0.0, ge=0, le=2000)
    clock_ppm: float = Field(20.0, ge=-200_000, le=200_000)
    range_least_m: float = Field(0.05, ge=0.01, le=1)
    second_range_m: float | None = Field(None, ge=-1, le=1)

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if self.contact_s and self.swap_s and "swap_s" in self.model_fields_set:
            raise ValueError("swap_s or contact_s: a charge pad swaps batteries or fills them; leave one out")
        return self

    def pads(self) -> PadService:
        """What the charge pads do."""
        return PadService(contact_s=self.contact_s) if self.contact_s else PadService(self.swap_s)

    def radio(self) -> RadioParams:
        """Each way between a MAVLink autopilot and its companion."""
        return RadioParams(self.radio_loss, self.radio_delay_ms / 1000, self.radio_jitter_ms / 1000)


class Scenario(Section):
    """One simulated world's conditions."""

    camera: CameraScenario = CameraScenario()
    front_camera: FrontCameraScenario = FrontCameraScenario()
    racks: RacksScenario = RacksScenario()
    floor: FloorScenario = FloorScenario()
    wind: WindScenario = WindScenario()
    vehicle: VehicleScenario = VehicleScenario()
    fault: tuple[Fault, ...] = ()
    expect: Expectation | None = None

    @property
    def needs_real_time(self) -> bool:
        return any(fault.real_time for fault in self.fault)
