"""What the ground is told besides: obstacles, hazards with their age, the way, what a picture shows."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flightd.adapters.ground_link.floor_status import floor_status
from flightd.adapters.ground_link.messages.published import LinkReport, StatusReport
from flightd.adapters.ground_link.messages.requests import AskPicture
from flightd.adapters.ground_link.picture_answer import picture_answer
from flightd.adapters.ground_link.protocol import decode_answer, encode
from flightd.adapters.ground_link.status_report import status_report
from flightd.config.schema import load_config
from flightd.core.geometry import Lens
from flightd.core.outlook import HazardSeen, Outlook
from flightd.core.preview import CameraName, Preview, found_areas, found_lines
from flightd.core.scanning import CodeSet, Occupancy, PlaceLook
from flightd.core.snapshot import Snapshot
from flightd.core.tick import TickInput, TickOutput
from flightd.core.types import CodeRead, CommandKind, Demand, Line, LineSet, Phase
from flightd.mission.event_log import EventLog
from flightd.mission.triggers import Trigger
from flightd.site.site_file import load_site
from flightd.site.ways import KeepOut
from tests.sim.ideal.ideal_flight import IdealFlight

CONFIGS = Path(__file__).parents[3] / "configs"
SITE = load_site(CONFIGS / "site-demo.toml")
CONFIG = load_config(CONFIGS / "sim.toml")
S = 10**9
LENS = Lens(640, 360, 400.0, 400.0, 319.5, 179.5)
BENT = replace(LENS, distortion=(-0.25, 0.05, 0.0, 0.0, 0.0))


def told(snapshot: Snapshot) -> StatusReport:
    return status_report(snapshot, "session", 1, LinkReport(0, 0, 0, 0, 0))


def test_a_hazard_is_told_from_its_beginning_until_a_second_after_its_end() -> None:
    log = EventLog()
    for tick in range(100):
        log.hazard(tick * S // 10, Trigger.LINES_LOST, "hold")
    log.hazard(99 * S // 10, Trigger.WIND, "land")
    assert log.hazards(10 * S) == (
        HazardSeen("lines lost", "hold", 0),
        HazardSeen("pushed beyond the limits", "land", 99 * S // 10),
    )
    assert log.hazards(11 * S) == ()
    log.hazard(20 * S, Trigger.LINES_LOST, "hold")
    assert [seen.since_ns for seen in log.hazards(20 * S)] == [20 * S], "another time"


def test_a_flight_tells_its_way_its_endurance_and_all_that_keeps_it_on_the_ground() -> None:
    seen: list[Snapshot] = []
    flight = IdealFlight(SITE, CONFIG, visits=("A2", "A3"), observers=[seen.append])
    flight.faults.battery = 0.15
    flight.faults.rangeless = True
    flight.fly(3.0)
    assert len(seen[-1].outlook.obstacles) == 2
    assert seen[-1].outlook.obstacles[0] == seen[-1].reason, "the worst first"
    assert CommandKind.START not in told(seen[-1]).possible
    flight.faults.battery, flight.faults.rangeless = None, False
    flight.fly(25.0)
    report = next(told(snapshot) for snapshot in seen if snapshot.phase is Phase.FOLLOW)
    assert report.obstacles == ()
    assert report.way[:2] == ("A2", "A3")
    assert {CommandKind.PAUSE, CommandKind.STOP} <= set(report.possible)
    assert report.battery_left_s is not None
    assert 300.0 < report.battery_left_s < CONFIG.battery.hover_s
    assert report.home_s is not None
    assert 3.0 < report.home_s < 60.0
    assert report.position is not None
    assert report.position.sigma_x_m is not None
    assert 0.0 < report.position.sigma_x_m < 0.2


def test_what_is_not_known_is_told_as_such() -> None:
    output = TickOutput(None, Demand.STANDBY, Phase.PREFLIGHT, "", "", 0, 1, None, None)
    report = told(Snapshot(TickInput(S), output, outlook=Outlook(home_s=math.nan)))
    assert (report.home_s, report.battery_left_s, report.way, report.hazards) == (None, None, (), ())


def test_the_floor_is_told_with_racks_keep_outs_pads_and_closed_ways() -> None:
    first = SITE.edges[0]
    site = replace(
        SITE, blocked=((first.a, first.b),), keep_outs=(KeepOut(50.0, 0.0, 51.0, 1.0, 1.0, math.inf),)
    )
    floor = floor_status(site)
    assert [(way.a, way.b, way.closed) for way in floor.ways] == [(first.a, first.b, True)]
    (area,) = floor.keep_outs
    assert (area.x0_m, area.from_m, area.to_m) == (50.0, 1.0, None)
    (pad,) = floor.pads
    assert (pad.id, pad.x_m, pad.y_m, pad.charge) == ("home", 0.0, 0.0, True)
    assert len(floor.racks) == len(SITE.shelves)


def lines(*found: Line) -> LineSet:
    return LineSet(1, S, 640, 360, found, (), "combined")


def test_a_line_is_shown_where_the_picture_shows_it() -> None:
    upright = Line(100.0, 0.0, 6.4, -90.0, 90.0, 1.0, 0.1, 0.001)
    (shown,) = found_lines(lines(upright), LENS)
    assert shown.points == ((round(420 / 640, 4), 0.25), (round(420 / 640, 4), 0.75))
    assert shown.width == pytest.approx(0.01)


def test_a_lens_bends_the_line_as_it_bends_the_picture() -> None:
    upright = Line(200.0, 0.0, 6.4, -150.0, 150.0, 1.0, 0.1, 0.001)
    (shown,) = found_lines(lines(upright), BENT)
    assert len(shown.points) == 9
    xs = [x for x, _ in shown.points]
    assert max(xs) == xs[4], "pulled in at its ends"
    assert xs[0] == pytest.approx(xs[-1])
    r2 = (200.0 / 400.0) ** 2
    assert xs[4] == pytest.approx((200.0 * (1.0 - 0.25 * r2 + 0.05 * r2 * r2)) / 640 + 0.5, abs=1e-4)


def test_places_and_codes_of_the_shelf_are_shown_and_go_over_the_link() -> None:
    quad = ((-32.0, -18.0), (32.0, -18.0), (32.0, 18.0), (-32.0, 18.0))
    read = CodeRead("QR Code", "BR-04-2-2", quad, True, 1, 1.0)
    seen = CodeSet(1, S, 640, 360, (read,), (PlaceLook("BR-04", quad, 1.0, Occupancy.GOODS),))
    place, code = found_areas(seen)
    assert (place.kind, place.text, code.kind, code.text) == ("place", "BR-04: goods", "code", "BR-04-2-2")
    assert code.corners == ((0.45, 0.45), (0.55, 0.45), (0.55, 0.55), (0.45, 0.55))
    preview = Preview(CameraName.FRONT, 3, S, b"jpeg", areas=(place, code))
    answer = picture_answer(preview, "12345678")
    assert decode_answer(encode(answer)) == answer


def test_numbers_of_any_kind_that_a_detector_tells_go_over_the_link() -> None:
    """Detectors compute with numpy, whose numbers JSON does not know."""
    told_by_numpy = Line(*map(np.float64, (10.0, 0.5, 6.0, -90.0, 90.0, 1.0, 0.1, 0.001)))
    preview = Preview(CameraName.DOWN, 1, S, b"jpeg", found_lines(lines(told_by_numpy), BENT))
    assert encode(picture_answer(preview, "12345678"))


def test_an_older_daemon_still_understands_who_asks_for_the_down_camera() -> None:
    assert b"camera" not in encode(AskPicture(version=1, id="12345678"))
    assert b'"camera":"front"' in encode(AskPicture(version=1, id="12345678", camera=CameraName.FRONT))
