"""What is drawn of a drone: within its world's bounds, the same for the same seed, nothing in the ideal."""

from __future__ import annotations

import math

import pytest

from flightd.app.simulation.prepare import SimOptions
from flightd.config.paths import shipped
from flightd.core.errors import InputError
from flightd.sim.appearance import DEFAULT, HARSH
from flightd.sim.leap import NEVER, Leap, LeapInFlight
from flightd.sim.plant.airframe import AirframeParams
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.face_light import check_names
from flightd.sim.scenario.scenario import FloorScenario
from flightd.sim.sensors.instruments import SensorParams
from flightd.sim.sensors.optics import SimCamera
from flightd.sim.unknowns import NOTHING, SPREADS, WorldKind, unknowns_of
from flightd.site.site_file import load_site


def test_the_ideal_world_keeps_nothing_to_itself() -> None:
    assert unknowns_of(WorldKind.IDEAL, 7) == NOTHING
    assert NOTHING.camera(SimCamera()) == SimCamera()
    assert NOTHING.sensors(SensorParams()) == SensorParams()
    assert NOTHING.airframe(AirframeParams()) == AirframeParams()


@pytest.mark.parametrize("kind", [WorldKind.USUAL, WorldKind.ROUGH])
def test_what_is_drawn_stays_within_its_world_and_reaches_what_it_is_of(kind: WorldKind) -> None:
    most = SPREADS[kind]
    drawn = [unknowns_of(kind, seed) for seed in range(200)]
    assert drawn == [unknowns_of(kind, seed) for seed in range(200)]
    delays = [one.camera_delay_s for one in drawn]
    assert max(map(abs, delays)) <= most.delay_s
    assert max(delays) > 0.8 * most.delay_s
    assert min(delays) < -0.8 * most.delay_s
    assert max(one.stand_tilt_rad[0] for one in drawn) > 0.8 * math.radians(most.stand_deg)
    assert max(one.bandwidth_share for one in drawn) > 1.0 + 0.8 * most.attitude_loop_share
    assert min(one.damping_share for one in drawn) < 1.0 - 0.8 * most.attitude_loop_share
    assert len({one.range_lag_s for one in drawn}) == len(drawn)
    for one in drawn:
        camera = one.camera(SimCamera())
        assert camera.capture_delay_s == pytest.approx(max(0.060 + one.camera_delay_s, 0.005))
        assert abs(math.degrees(camera.mount.roll_rad)) <= most.mount_deg
        assert abs(camera.lens.fx_px / SimCamera().lens.fx_px - 1.0) <= most.focal_share
        assert one.sensors(SensorParams()).leak_s == most.leak_s
        assert max(map(abs, one.airframe(AirframeParams()).rest_tilt_rad)) <= math.radians(most.stand_deg)
        assert most.quickest_exposure_s <= one.exposure_lag_s <= most.slowest_exposure_s
        assert most.least_flicker <= one.flicker <= most.most_flicker
        assert 0.0 <= one.sensors(SensorParams()).compass_rad <= math.radians(most.compass_deg)
        if most.delay_leap_s:
            assert abs(one.camera_delay_s + one.camera_leap.by_s) <= most.delay_s
            assert 5.0 <= one.camera_leap.after_s <= 60.0
            assert 5.0 <= one.clock_leap.after_s <= 60.0
            assert abs(one.clock_leap.by_s) == most.clock_leap_s
        else:
            assert one.camera_leap == one.clock_leap == NEVER
        body, told = one.airframe(AirframeParams()), one.sensors(SensorParams())
        assert abs(body.attitude_bandwidth_radps / 10.0 - 1.0) <= most.attitude_loop_share
        assert abs(body.attitude_damping / 0.94 - 1.0) <= most.attitude_loop_share
        assert most.quickest_range_s <= told.range_lag_s <= most.slowest_range_s
        assert math.degrees(max(map(abs, told.tilt_rate_bias_radps))) <= most.tilt_rate_degps
        assert abs(told.battery.current_share - 1.0) <= most.current_share
        assert abs(told.battery.volt_share - 1.0) <= most.volt_share
        down_s, up_s = one.path_s
        assert down_s + up_s == pytest.approx(2.0 * most.path_s)


@pytest.mark.parametrize(
    ("kind", "drawn"),
    [(WorldKind.USUAL, (-0.000789, 1.018342, 0.003262)), (WorldKind.ROUGH, (0.005667, 0.822846, 0.011211))],
)
def test_a_seed_draws_what_it_drew_before_there_was_more_to_draw(
    kind: WorldKind, drawn: tuple[float, float, float]
) -> None:
    one = unknowns_of(kind, 7)
    assert (one.camera_delay_s, one.hover_share, one.readout_s) == pytest.approx(drawn, abs=1e-6)


def test_leaps_come_within_a_flight_of_half_a_minute_as_often_as_not() -> None:
    drawn = [unknowns_of(WorldKind.ROUGH, seed) for seed in range(200)]
    assert sum(one.camera_leap.after_s < 30.0 for one in drawn) > 70
    assert sum(one.clock_leap.after_s < 30.0 for one in drawn) > 70


def test_a_leap_comes_so_long_after_the_vehicle_first_flew() -> None:
    leap = Leap(0.033, 5.0)
    in_flight, standing_m, flying_m, s = LeapInFlight(leap), 0.1, 1.6, 1_000_000_000
    assert [in_flight.ns(at * s, standing_m) for at in (0, 40)] == [0, 0]
    assert [in_flight.ns(at * s, flying_m) for at in (41, 46, 47, 48)] == [0, 0, 33_000_000, 33_000_000]
    assert in_flight.ns(60 * s, standing_m) == 33_000_000  # it stays, landed or not
    heights = [(0, standing_m), (41 * s, flying_m), (60 * s, standing_m)]
    assert (leap.since_s(heights, 48 * s), leap.since_s(heights, 43 * s)) == (2.0, -3.0)
    assert leap.since_s(heights[:1], 48 * s) == NEVER.since_s(heights, 48 * s) == -math.inf


def test_the_rough_floor_looks_worn_where_nobody_says_how_it_looks() -> None:
    for kind in (WorldKind.IDEAL, WorldKind.USUAL):
        assert unknowns_of(kind, 3).look(DEFAULT, told=False) == DEFAULT
    worn = unknowns_of(WorldKind.ROUGH, 3).look(DEFAULT, told=False)
    for name in ("wear", "dirt", "glare", "soft_px"):
        assert getattr(DEFAULT, name) < getattr(worn, name) < getattr(HARSH, name)
    assert (worn.noise, worn.exposure, worn.sun) == (DEFAULT.noise, DEFAULT.exposure, DEFAULT.sun)
    named = FloorScenario(appearance="default")
    assert not FloorScenario().tells_appearance
    assert unknowns_of(WorldKind.ROUGH, 3).look(named.surface(), told=named.tells_appearance) == DEFAULT


def test_lines_lie_beside_their_places_by_what_the_world_allows_and_not_more() -> None:
    site = load_site(shipped("site-demo.toml"))
    assert NOTHING.floor(site, 3) is site
    for kind in (WorldKind.USUAL, WorldKind.ROUGH):
        most_m = SPREADS[kind].map_m
        off_m = [
            math.hypot(node.x_m - site.nodes[node.id].x_m, node.y_m - site.nodes[node.id].y_m)
            for seed in range(10)
            for node in unknowns_of(kind, seed).floor(site, seed).nodes.values()
        ]
        assert 0.7 * most_m < max(off_m) <= math.hypot(most_m, most_m)


def test_racks_stand_where_they_stand_whatever_was_painted() -> None:
    site = load_site(shipped("site-racks-small.toml"))
    painted = unknowns_of(WorldKind.ROUGH, 3).floor(site, 3)
    assert painted.nodes != site.nodes
    assert (painted.shelves, painted.locations, painted.racks) == (site.shelves, site.locations, site.racks)


def test_an_airframe_that_there_is_not_is_refused() -> None:
    with pytest.raises(InputError, match=r"--plant kite: no such airframe; give one of own, rotorpy"):
        SimOptions(plant="kite").check()
    with pytest.raises(InputError, match=r"--truth-url the other simulator is the airframe"):
        SimOptions(plant="rotorpy", truth_url="tcp:h:1", vehicle_url="tcp:h:2").check()


def test_each_level_of_each_rack_front_has_its_light_and_what_was_told_of_it_stands() -> None:
    site = load_site(shipped("site-racks-small.toml"))
    assert NOTHING.racks(RackAppearance(), site, 3) == RackAppearance()
    drawn = unknowns_of(WorldKind.ROUGH, 3).racks(RackAppearance(), site, 3).light
    assert len(drawn) == len({(p.aisle, p.side, p.level) for p in site.locations.values()})
    assert 0.35 <= min(drawn.values()) < 0.8
    assert 1.2 < max(drawn.values()) <= 1.8
    told = RackAppearance(light={"A left": 0.5})
    assert unknowns_of(WorldKind.ROUGH, 3).racks(told, site, 3) == told


def test_light_of_a_front_that_is_not_there_is_refused() -> None:
    site = load_site(shipped("site-racks-small.toml"))
    check_names(["A left", "B right 2"], site)
    with pytest.raises(InputError, match=r"racks\.light: no rack front 'C left'; there are A left, A left 1"):
        check_names(["A left", "C left"], site)
