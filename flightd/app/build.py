"""What a configuration and a map ask for: the plan, the pilot, what counts, what sees, the ground link."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from flightd.adapters.ground_link.link import ZmqGround
from flightd.app.counting.count import Counting
from flightd.app.detection.detector_pool import DetectorPool
from flightd.config.mission import HEIGHT_ROOM_M, VisitOrder
from flightd.config.schema import Config
from flightd.core.errors import InputError
from flightd.mission.battery.sorties import check_battery
from flightd.mission.guidance import CEILING_MARGIN_M
from flightd.mission.plan.flight_plan import FlightPlan, HeadingPolicy, make_plan
from flightd.mission.plan.leg_times import Pace
from flightd.mission.plan.route_optimiser import ordered_best
from flightd.mission.scan.code_assignment import FrontSight
from flightd.mission.scan.no_scan import NO_SCAN, AnyScanner
from flightd.mission.scan.scanner import Scanner
from flightd.mission.scan.views import view_height_m
from flightd.pilot import Pilot
from flightd.ports import Clock
from flightd.site.site import Site
from flightd.vision.lines.detector import Detector


def plan_of(config: Config, site: Site) -> FlightPlan:
    """The flight plan that the configuration asks for, from the home pad and back."""
    return _plan_on(config, site.between(*flown_between_m(config, site)))


def _plan_on(config: Config, site: Site) -> FlightPlan:
    """The plan on a site that has only the keep-outs of the heights flown."""
    mission = config.mission
    visits: Sequence[str] = mission.nodes or site.serpentine_route()
    start, policy, yaw_rad = (
        start_of(config, site),
        HeadingPolicy.of(config),
        mission.start_yaw_rad,
    )
    if mission.order is VisitOrder.BEST:
        visits = ordered_best(site, visits, (start, site.home.node), policy, Pace.of(mission), yaw_rad)
    return make_plan(site, visits, start, site.home.node, policy, yaw_rad)


def start_of(config: Config, site: Site) -> str:
    """The node of the pad on which the drone stands at first.  InputError when the site lacks that pad."""
    wanted = config.mission.pad
    pad = site.home if wanted is None else next((pad for pad in site.pads if pad.id == wanted), None)
    if pad is None:
        names = ", ".join(pad.id for pad in site.pads)
        raise InputError(f"mission.pad {wanted!r}: site {site.name} has the pads {names}")
    return pad.node


def pilot_of(config: Config, site: Site) -> Pilot:
    """A fresh pilot for one flight.  Raises InputError where map and configuration contradict each other."""
    if config.mission.height_m > site.ceiling_m - CEILING_MARGIN_M:
        raise InputError(
            f"mission.height_m {config.mission.height_m} is not {CEILING_MARGIN_M} m below the ceiling of"
            f" {site.name} ({site.ceiling_m} m)"
        )
    flown = site.between(*flown_between_m(config, site))
    plan, policy = _plan_on(config, flown), HeadingPolicy.of(config)
    scanner = scanner_of(config, site)
    check_battery(flown, plan, policy, config, scanner)
    return Pilot(flown, plan, policy, config, scanner, site.overhead_m)


def scanner_of(config: Config, site: Site) -> AnyScanner:
    """What counts the shelves; `NO_SCAN` without a front camera or locations."""
    front = config.front_camera
    if not front.is_fitted or not site.locations:
        return NO_SCAN
    highest_m = site.ceiling_m - CEILING_MARGIN_M
    if config.scan.min_height_m > highest_m:
        raise InputError(
            f"scan.min_height_m {config.scan.min_height_m} is not {CEILING_MARGIN_M} m below the ceiling of"
            f" {site.name} ({site.ceiling_m} m)"
        )
    sight = FrontSight(front.lens(), front.mount())
    return Scanner(site, sight, config.scan, highest_m, config.camera.aside_per_height)


def flown_between_m(config: Config, site: Site) -> tuple[float, float]:
    """The heights that are flown between: with a scan, those of its views too."""
    low_m, high_m = config.mission.flown_between_m()
    if not config.front_camera.is_fitted or not site.locations:
        return low_m, high_m
    scan, mount = config.scan, config.front_camera.mount()
    heights_m = scan.min_height_m, scan.highest_m(site.ceiling_m - CEILING_MARGIN_M)
    views_m = [
        view_height_m(place.height_m, abs(place.y_m - site.nodes[place.node].y_m), mount, heights_m)
        for place in site.locations.values()
    ]
    return min(low_m, min(views_m) - HEIGHT_ROOM_M), max(high_m, max(views_m) + HEIGHT_ROOM_M)


def profile_of(config: Config, site: Site) -> str:
    """The colour profile that is configured, or else that of the site's lines."""
    return config.vision.profile or site.line_colour.value


def detector_pool(config: Config, site: Site, clock: Clock) -> DetectorPool:
    """Detector processes after the configuration; the colour profile is read here, so that a wrong one
    is found before anything flies."""
    make = detector_of(config, site)
    make()
    return DetectorPool(make, config.vision.workers, config.vision.timeout_s, clock)


def detector_of(config: Config, site: Site) -> Callable[[], Detector]:
    """What makes the detector that configuration and map ask for (in its own process, where it flies)."""
    camera, vision = config.camera, config.vision
    lens = camera.lens() if camera.lens().is_distorted else None
    profile = profile_of(config, site)
    return partial(Detector, vision.method, profile, lens, markers=site.marker_set, in_flight=True)


def ground_link(
    config: Config, site: Site, clock: Clock, counting: Counting | None = None
) -> ZmqGround | None:
    """The link to ground stations, if the configuration wants one."""
    if not config.ground.listen:
        return None
    return ZmqGround(config.ground, site, clock, counting.places if counting is not None else None)
