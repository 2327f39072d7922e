"""What a stranger's drone keeps from its computer: drawn anew for each flight, told to the judge alone.

Three worlds.  In the ideal one the configuration knows the drone exactly; the usual one has the errors of a
drone that was built with care, the rough one those of a bad day.
"""

from __future__ import annotations

import enum
import math
import random
from contextlib import suppress
from dataclasses import dataclass, replace

from flightd.core.errors import InputError
from flightd.sim.appearance import HARSH, Appearance
from flightd.sim.autopilot.radio import PERFECT, RadioParams
from flightd.sim.floor.misplaced_lines import misplaced
from flightd.sim.floor.paint_damage import PaintDamage, drawn_damage
from flightd.sim.floor.strange_lines import drawn_old_lines, drawn_tapes
from flightd.sim.leap import NEVER, Leap
from flightd.sim.plant.airframe import AirframeParams
from flightd.sim.plant.wash import Wash
from flightd.sim.plant.wind import WindParams
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.face_light import drawn_light
from flightd.sim.sensors.cheap_camera import FAITHFUL, CheapParams
from flightd.sim.sensors.instruments import SensorParams
from flightd.sim.sensors.optics import SimCamera
from flightd.sim.sensors.vibration import STILL, Shaken, Tones, Vibration, drawn_tones
from flightd.site.site import Site


class WorldKind(enum.StrEnum):
    """How much the simulated world keeps to itself."""

    IDEAL = "ideal"
    USUAL = "usual"
    ROUGH = "rough"


_SENSORS = SensorParams()
_GUST_RMS_MPS = WindParams().gust_rms_mps
_LEAPS_AFTER_S = 5.0, 60.0
"""So long after the vehicle first flew delays and clocks leap: every other time within half a minute."""


@dataclass(frozen=True, slots=True)
class Unknowns:
    """What is true of one drone and not in its configuration; all differences are true less configured."""

    kind: WorldKind = WorldKind.IDEAL
    camera_delay_s: float = 0.0
    camera_jitter_s: float = 0.0
    camera_leap: Leap = NEVER
    """Pictures come later from then on: a frame more is queued, or one less."""
    mount_roll_rad: float = 0.0
    mount_pitch_rad: float = 0.0
    mount_yaw_rad: float = 0.0
    focal_share: float = 1.0
    shake_rad: float = 0.0
    """Rms of roll and of pitch of the camera against the airframe."""
    shake_tones: tuple[Tones, Tones] | None = None
    """The tones of roll and of pitch by which it shakes; None: it is turned anew for each frame."""
    compass_rad: float = 0.0
    """The most by which steel turns the compass."""
    gyro_share: float = 0.0
    """The most by which the gyros scale a rate."""
    gyro_noise_radps: float = _SENSORS.gyro_noise_radps
    tilt_rate_bias_radps: tuple[float, float] = (0.0, 0.0)
    """What is left of the biases of the roll and pitch gyros, less what the autopilot knows of them."""
    yaw_drift_radps: float = _SENSORS.yaw_drift_radps
    readout_s: float = 0.0
    map_error_m: float = 0.0
    """The most by which a painted line lies beside its place on the map."""
    tilt_bias_rad: tuple[float, float] | None = None
    """Roll and pitch told too large; None: the simulated autopilot's own small ones."""
    tilt_wander_rad: float = _SENSORS.tilt_wander_rad
    stand_tilt_rad: tuple[float, float] = (0.0, 0.0)
    """Roll and pitch in which it stands."""
    leak_s: float | None = None
    """Time within which the told attitude leaks towards level; None: it does not."""
    clock_ppm: float = 20.0
    clock_leap: Leap = NEVER
    """The autopilot's clock is set."""
    path_s: tuple[float, float] = (0.0, 0.0)
    """Least delay of telemetry, and of what is sent to the autopilot."""
    path_jitter_s: float = 0.0
    range_noise_m: float = _SENSORS.range_noise_m
    range_dropout: float = _SENSORS.range_dropout
    range_min_m: float = _SENSORS.range_min_m
    baro_wander_m: float = _SENSORS.baro_wander_m
    hover_share: float = 1.0
    gust_rms_mps: float = _GUST_RMS_MPS
    face_light: tuple[float, float] = (1.0, 1.0)
    """Between which the light on each level of each rack front is drawn, the usual one being 1."""
    drag_share: float = 1.0
    capacity_share: float = 1.0
    """Of the battery."""
    current_share: float = 1.0
    """Of the battery's current, by which its charge is counted."""
    volt_share: float = 1.0
    bandwidth_share: float = 1.0
    damping_share: float = 1.0
    """Of the attitude loop, as the bandwidth."""
    thrust_to_weight: float | None = None
    """The most that the motors lift, less as the battery's voltage sags; None: all that is asked for."""
    wash_mps: float = 0.0
    """Rms of the air that comes back right beside floor and racks."""
    range_lag_s: float = 0.0
    range_echo: float = 0.0
    """Share of readings that came back by a longer way."""
    exposure_lag_s: float = 0.0
    """Time constant of the down camera's automatic exposure; 0: it has none."""
    flicker: float = 0.0
    """Share of the floor's grey level that beats with the mains, row by row; 0: as its appearance has it."""
    paint_gone: float = 0.0
    """Share of the painted length from which the paint is gone."""
    paint_covered: float = 0.0
    """Share of it on which pallets and drains lie."""
    false_lines: float = 0.0
    """Length of the stripes that no map has, as a share of it."""
    old_lines: float = 0.0
    """Length of the long old lines beside the true ones, as a share of it, in the mean over the floors."""
    tape: float = 0.0
    """Length of the tape of other colours, as a share of it."""
    worn_look: float = 0.0
    """How far the floor looks worn, from as configured (0) to the harsh appearance (1)."""

    @property
    def vibration(self) -> Vibration:
        return STILL if self.shake_tones is None else Vibration(self.shake_rad, *self.shake_tones)

    def shaken(self, seed: int) -> Shaken:
        """What turns the camera anew for each frame; nothing where it vibrates."""
        return Shaken(self.shake_rad if self.shake_tones is None else 0.0, seed)

    def camera(self, configured: SimCamera) -> SimCamera:
        """The down camera as it really is."""
        lens, mount = configured.lens, configured.mount
        return replace(
            configured,
            lens=lens.longer_by(self.focal_share),
            mount=replace(
                mount,
                yaw_rad=mount.yaw_rad + self.mount_yaw_rad,
                roll_rad=mount.roll_rad + self.mount_roll_rad,
                pitch_rad=mount.pitch_rad + self.mount_pitch_rad,
            ),
            capture_delay_s=max(configured.capture_delay_s + self.camera_delay_s, 0.005),
            jitter_s=configured.jitter_s + self.camera_jitter_s,
            readout_s=max(configured.readout_s + self.readout_s, 0.0),
            vibration=self.vibration,
        )

    def cheap(self, *, told: bool) -> CheapParams:
        """What the down camera does by itself; a floor whose look somebody has `told` is seen as it is."""
        return FAITHFUL if told else CheapParams(self.exposure_lag_s, self.flicker)

    def floor(self, configured: Site, seed: int) -> Site:
        """The floor as it is painted; as far from its map as it can be where lines come too close."""
        for share in (1.0, 0.5, 0.25) if self.map_error_m else ():
            with suppress(InputError):
                return misplaced(configured, share * self.map_error_m, seed)
        return configured

    def paint_damage(self, painted: Site, seed: int) -> PaintDamage:
        """What the hall did to the floor as it was `painted`."""
        damage = drawn_damage(painted, self.paint_gone, self.paint_covered, self.false_lines, seed)
        return replace(
            damage,
            old_lines=drawn_old_lines(painted, self.old_lines, seed, damage.false_lines),
            tapes=drawn_tapes(painted, self.tape, seed),
        )

    def look(self, configured: Appearance, *, told: bool) -> Appearance:
        """How the floor looks; a look that somebody has `told` stands."""
        return configured if told or not self.worn_look else configured.towards(HARSH, self.worn_look)

    def racks(self, configured: RackAppearance, site: Site, seed: int) -> RackAppearance:
        """The racks in the light that really falls on them; what was told of it stands."""
        if self.face_light == (1.0, 1.0) or configured.light:
            return configured
        return replace(configured, light=drawn_light(site, self.face_light, seed))

    def sensors(self, configured: SensorParams) -> SensorParams:
        """The autopilot's sensors as they really are."""
        return replace(
            configured,
            compass_rad=self.compass_rad,
            gyro_share=self.gyro_share,
            gyro_noise_radps=self.gyro_noise_radps,
            tilt_rate_bias_radps=self.tilt_rate_bias_radps,
            yaw_drift_radps=self.yaw_drift_radps,
            tilt_bias=self.tilt_bias_rad,
            tilt_wander_rad=self.tilt_wander_rad,
            leak_s=self.leak_s,
            range_noise_m=self.range_noise_m,
            range_dropout=self.range_dropout,
            range_min_m=max(self.range_min_m, configured.range_min_m),
            baro_wander_m=self.baro_wander_m,
            range_lag_s=self.range_lag_s,
            range_echo=self.range_echo,
            battery=replace(configured.battery, current_share=self.current_share, volt_share=self.volt_share),
            vibration=self.vibration,
        )

    def radio(self, configured: RadioParams) -> tuple[RadioParams, RadioParams]:
        """The line from the autopilot and to it as they really are; a radio is worse than any line."""
        if configured != PERFECT or not self.path_jitter_s:
            return configured, configured
        down_s, up_s = self.path_s
        down = RadioParams(delay_s=down_s, jitter_s=self.path_jitter_s, in_order=True)
        return down, replace(down, delay_s=up_s)

    def wind(self, configured: WindParams, *, told: bool) -> WindParams:
        """The air of the hall; gusts that somebody has `told` are as they are."""
        return configured if told else replace(configured, gust_rms_mps=self.gust_rms_mps)

    def airframe(self, configured: AirframeParams) -> AirframeParams:
        """The airframe as it really is."""
        return replace(
            configured,
            attitude_bandwidth_radps=configured.attitude_bandwidth_radps * self.bandwidth_share,
            attitude_damping=configured.attitude_damping * self.damping_share,
            hover_collective=configured.hover_collective * self.hover_share,
            drag_per_s=configured.drag_per_s * self.drag_share,
            rest_tilt_rad=self.stand_tilt_rad,
            battery_capacity_ah=configured.battery_capacity_ah * self.capacity_share,
            sags=self.thrust_to_weight is not None,
            thrust_to_weight=self.thrust_to_weight,
        )

    def wash(self, site: Site, seed: int) -> Wash | None:
        """The air that floor and racks throw back; None where there is none."""
        return Wash(self.wash_mps, site.shelves, seed) if self.wash_mps else None


NOTHING = Unknowns()
"""The configuration knows it all."""


@dataclass(frozen=True, slots=True)
class Spread:
    """One world's largest differences, drawn evenly within them; jitter, noise and dropouts are as here."""

    delay_s: float
    jitter_s: float
    delay_leap_s: float
    mount_deg: float
    mount_yaw_deg: float
    focal_share: float
    shake_deg: float
    vibrates: bool
    readout_s: float
    compass_deg: float
    gyro_share: float
    gyro_noise_degps: float
    tilt_rate_degps: float
    yaw_drift_degps: float
    map_m: float
    tilt_deg: float
    tilt_wander_deg: float
    stand_deg: float
    leak_s: float
    clock_ppm: float
    clock_leap_s: float
    path_s: float
    uneven_s: float
    path_jitter_s: float
    range_noise_m: float
    range_dropout: float
    range_min_m: float
    baro_m: float
    hover_share: float
    gust_mps: float
    darkest_face: float
    lightest_face: float
    body_share: float
    current_share: float
    volt_share: float
    attitude_loop_share: float
    thrust_to_weight: float | None
    wash_mps: float
    quickest_range_s: float
    slowest_range_s: float
    range_echo: float
    quickest_exposure_s: float
    slowest_exposure_s: float
    least_flicker: float
    most_flicker: float
    paint_gone: float
    paint_covered: float
    false_lines: float
    old_lines: float
    tape: float
    worn_look: float


SPREADS = {
    WorldKind.USUAL: Spread(
        delay_s=0.025,
        jitter_s=0.005,
        delay_leap_s=0.0,
        mount_deg=1.0,
        mount_yaw_deg=2.0,
        focal_share=0.01,
        shake_deg=0.15,
        vibrates=False,
        readout_s=0.005,
        compass_deg=5.0,
        gyro_share=0.005,
        gyro_noise_degps=0.5,
        tilt_rate_degps=0.2,
        yaw_drift_degps=0.05,
        map_m=0.01,
        tilt_deg=0.5,
        tilt_wander_deg=0.15,
        stand_deg=0.5,
        leak_s=6.0,
        clock_ppm=50.0,
        clock_leap_s=0.0,
        path_s=0.010,
        uneven_s=0.003,
        path_jitter_s=0.005,
        range_noise_m=0.010,
        range_dropout=0.01,
        range_min_m=0.10,
        baro_m=0.1,
        hover_share=0.10,
        gust_mps=_GUST_RMS_MPS,
        darkest_face=0.75,
        lightest_face=1.05,
        body_share=0.10,
        current_share=0.05,
        volt_share=0.005,
        attitude_loop_share=0.15,
        thrust_to_weight=None,
        wash_mps=0.0,
        quickest_range_s=0.02,
        slowest_range_s=0.06,
        range_echo=0.0,
        quickest_exposure_s=0.1,
        slowest_exposure_s=0.1,
        least_flicker=0.01,
        most_flicker=0.01,
        paint_gone=0.01,
        paint_covered=0.0,
        false_lines=0.0,
        old_lines=0.0,
        tape=0.0,
        worn_look=0.0,
    ),
    WorldKind.ROUGH: Spread(
        delay_s=0.050,
        jitter_s=0.020,
        delay_leap_s=0.033,
        mount_deg=2.5,
        mount_yaw_deg=4.0,
        focal_share=0.04,
        shake_deg=0.5,
        vibrates=True,
        readout_s=0.015,
        compass_deg=25.0,
        gyro_share=0.02,
        gyro_noise_degps=1.5,
        tilt_rate_degps=0.5,
        yaw_drift_degps=0.3,
        map_m=0.05,
        tilt_deg=0.5,
        tilt_wander_deg=1.0,
        stand_deg=1.0,
        leak_s=2.0,
        clock_ppm=20_000.0,
        clock_leap_s=0.020,
        path_s=0.040,
        uneven_s=0.018,
        path_jitter_s=0.020,
        range_noise_m=0.04,
        range_dropout=0.08,
        range_min_m=0.30,
        baro_m=0.4,
        hover_share=0.25,
        gust_mps=0.5,
        darkest_face=0.35,
        lightest_face=1.8,
        body_share=0.25,
        current_share=0.10,
        volt_share=0.01,
        attitude_loop_share=0.30,
        thrust_to_weight=1.7,
        wash_mps=0.4,
        quickest_range_s=0.05,
        slowest_range_s=0.15,
        range_echo=0.02,
        quickest_exposure_s=0.5,
        slowest_exposure_s=1.5,
        least_flicker=0.05,
        most_flicker=0.15,
        paint_gone=0.05,
        paint_covered=0.03,
        false_lines=0.03,
        old_lines=0.03,
        tape=0.03,
        worn_look=0.6,
    ),
}


def unknowns_of(kind: WorldKind, seed: int) -> Unknowns:
    """What is drawn for one flight; the same kind and seed draw the same."""
    if kind is WorldKind.IDEAL:
        return NOTHING
    most, rng = SPREADS[kind], random.Random(f"unknowns {kind} {seed}")
    leaps = random.Random(f"leaps {kind} {seed}")
    body, light = random.Random(f"body {kind} {seed}"), random.Random(f"exposure {kind} {seed}")
    legs = random.Random(f"legs {kind} {seed}")
    autopilot, power = random.Random(f"autopilot {kind} {seed}"), random.Random(f"power {kind} {seed}")

    def within(limit: float) -> float:
        return rng.uniform(-limit, limit)

    def leap(by_s: float) -> Leap:
        return Leap(by_s, leaps.uniform(*_LEAPS_AFTER_S)) if by_s else NEVER

    uneven_s, delay_s = within(most.uneven_s), within(most.delay_s)
    return Unknowns(
        kind=kind,
        camera_delay_s=delay_s,
        camera_jitter_s=most.jitter_s,
        camera_leap=leap(math.copysign(most.delay_leap_s, -delay_s)),
        mount_roll_rad=math.radians(within(most.mount_deg)),
        mount_pitch_rad=math.radians(within(most.mount_deg)),
        mount_yaw_rad=math.radians(within(most.mount_yaw_deg)),
        focal_share=1.0 + within(most.focal_share),
        shake_rad=math.radians(most.shake_deg),
        shake_tones=drawn_tones(random.Random(f"shake {kind} {seed}")) if most.vibrates else None,
        map_error_m=most.map_m,
        tilt_bias_rad=(math.radians(within(most.tilt_deg)), math.radians(within(most.tilt_deg))),
        tilt_wander_rad=math.radians(most.tilt_wander_deg),
        stand_tilt_rad=(
            math.radians(legs.uniform(-most.stand_deg, most.stand_deg)),
            math.radians(legs.uniform(-most.stand_deg, most.stand_deg)),
        ),
        leak_s=most.leak_s,
        clock_ppm=within(most.clock_ppm),
        clock_leap=leap(leaps.choice((-1.0, 1.0)) * most.clock_leap_s),
        path_s=(most.path_s + uneven_s, most.path_s - uneven_s),
        path_jitter_s=most.path_jitter_s,
        range_noise_m=most.range_noise_m,
        range_dropout=most.range_dropout,
        range_min_m=most.range_min_m,
        baro_wander_m=most.baro_m,
        hover_share=1.0 + within(most.hover_share),
        compass_rad=math.radians(abs(within(most.compass_deg))),
        gyro_share=most.gyro_share,
        gyro_noise_radps=math.radians(most.gyro_noise_degps),
        tilt_rate_bias_radps=(
            math.radians(autopilot.uniform(-most.tilt_rate_degps, most.tilt_rate_degps)),
            math.radians(autopilot.uniform(-most.tilt_rate_degps, most.tilt_rate_degps)),
        ),
        yaw_drift_radps=math.radians(most.yaw_drift_degps),
        readout_s=within(most.readout_s),
        gust_rms_mps=most.gust_mps,
        face_light=(most.darkest_face, most.lightest_face),
        drag_share=1.0 + body.uniform(-most.body_share, most.body_share),
        capacity_share=1.0 + body.uniform(-most.body_share, most.body_share),
        thrust_to_weight=most.thrust_to_weight,
        wash_mps=most.wash_mps,
        bandwidth_share=1.0 + autopilot.uniform(-most.attitude_loop_share, most.attitude_loop_share),
        damping_share=1.0 + autopilot.uniform(-most.attitude_loop_share, most.attitude_loop_share),
        current_share=1.0 + power.uniform(-most.current_share, most.current_share),
        volt_share=1.0 + power.uniform(-most.volt_share, most.volt_share),
        range_lag_s=autopilot.uniform(most.quickest_range_s, most.slowest_range_s),
        range_echo=most.range_echo,
        exposure_lag_s=light.uniform(most.quickest_exposure_s, most.slowest_exposure_s),
        flicker=light.uniform(most.least_flicker, most.most_flicker),
        paint_gone=most.paint_gone,
        paint_covered=most.paint_covered,
        false_lines=most.false_lines,
        old_lines=most.old_lines,
        tape=most.tape,
        worn_look=most.worn_look,
    )
