"""Every hazard in one table: how it is found, what is done, where that is flown.

The transition table takes its safety rows from here, the guide prints it, and a test flies each row.
Keys in backticks are those of the configuration.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass

from flightd.core.types import Phase
from flightd.mission.triggers import Trigger


class Action(enum.StrEnum):
    """What answers a hazard, the strongest first."""

    HANDS_OFF = "hands off"
    STOP = "stop"
    """Level at this very tick, down at once, no steering, no waiting."""
    LAND = "land"
    """Brake, settle, descend; by the lines while they are seen."""
    HOLD = "hold"
    """Stop where it is and wait; land when it lasts."""
    RELOCATE = "relocate"
    """Stop and find out where it is; land when that lasts."""
    HOME = "home"
    CONFIGURED = "as configured"
    REPORT = "report"
    """What failed is replaced; the flight goes on."""
    LIMIT = "limit"


PHASE_OF = {
    Action.HANDS_OFF: Phase.PILOT,
    Action.STOP: Phase.LAND,
    Action.LAND: Phase.LAND,
    Action.HOLD: Phase.HOLD,
    Action.RELOCATE: Phase.RELOCATE,
}
"""The phase into which an action takes a flying mission."""


@dataclass(frozen=True, slots=True)
class Hazard:
    """One row.  `trigger` is what tells the mission (None: answered below it), `test` where it is flown; the
    shipped scenario that makes it happen has its `name`.  `shows_landing`: only a drone that lands meets it,
    whenever it began."""

    name: str
    trigger: Trigger | None
    found_by: str
    action: Action
    then: str
    test: str
    shows_landing: bool = False


_FAST = "tests/sim/hazards/test_hazards.py"
_HOLD = "brake, hold; on when it is over; land after `mission.lines_land_s`"
_CLIMBING = "; a take-off above 0.5 m climbs no further at once, and lands after 1 s"
_BLIND = (
    "brake by dead reckoning and sink to `hazards.expert.blind_m` at once, to 0.3 m above a keep-out that"
    " stands below; up and on when it is over; land after `hazards.expert.blind_land_s`"
)

HAZARDS: tuple[Hazard, ...] = (
    Hazard(
        "pilot",
        Trigger.PILOT_TOOK,
        "the autopilot is in a mode that was not commanded",
        Action.HANDS_OFF,
        "silence at once, for good; an ArduPilot that is left for a second in GUIDED_NOGPS, where nobody"
        " flies it then, gets no more heartbeats and lands by itself; in any other mode they go on",
        _FAST,
    ),
    Hazard(
        "uplink_lost",
        Trigger.FAILSAFE_TOOK,
        "the autopilot is in a mode that was not commanded, and its heartbeats say that a failsafe of its own"
        " acts (`MAV_STATE_CRITICAL`): nothing that is sent reaches it",
        Action.HANDS_OFF,
        "silence at once, for good: it lands by itself (`companion_dead`); other failsafes of its own are"
        " told and answered alike",
        _FAST,
    ),
    Hazard(
        "stop",
        Trigger.STOP,
        "an operator's stop",
        Action.STOP,
        "level at this tick and down at once, without steering, whatever else holds",
        _FAST,
    ),
    Hazard(
        "telemetry_stale",
        Trigger.TELEMETRY_STALE,
        "newest attitude older by `mission.telemetry_hold_s` than attitudes usually come",
        Action.HOLD,
        "brake by the pictures, with the commanded attitude; level without them; no climb; never"
        " taken for a pilot",
        _FAST,
    ),
    Hazard(
        "telemetry_lost",
        Trigger.TELEMETRY_LOST,
        "newest attitude older than `mission.telemetry_land_s`",
        Action.LAND,
        "down by setpoints, braked by the pictures, where the autopilot keeps their climb rate; then, or else"
        " at once, its own landing is ordered unheard, again and again; given up 60 s later",
        _FAST,
    ),
    Hazard(
        "companion_dead",
        None,
        "the autopilot hears neither heartbeats nor setpoints of this computer",
        Action.LAND,
        "level after 0.3 s (PX4: half a second), then, within a second of its death, the autopilot begins to"
        " land by itself (an ArduCopter keeps its height for 4 s first; by `FS_GCS_ENABLE`, `FS_GCS_TIMEOUT`,"
        " `SYSID_MYGCS`, a PX4 by `COM_OF_LOSS_T`, `COM_OBL_RC_ACT`); an AR.Drone keeps the last lean until"
        " it lands after 2 s (`general:com_watchdog`); without these nothing is armed",
        "tests/protocol/mavlink/test_companion_dead.py",
    ),
    Hazard(
        "heartbeat_lost",
        Trigger.HEARTBEAT_LOST,
        "no heartbeat for `hazards.heartbeat_land_s`, whatever else arrives",
        Action.LAND,
        "modes and arming are those of the past",
        _FAST,
    ),
    Hazard(
        "height_lost",
        Trigger.HEIGHT_LOST,
        "no range finder sample for a second, and then for `mission.telemetry_land_s`",
        Action.LAND,
        "no climb from the first; then down",
        _FAST,
    ),
    Hazard(
        "climb_lost",
        Trigger.CLIMB_LOST,
        "no climb rate from the autopilot for a second, and then for `mission.telemetry_hold_s`; or, where"
        " thrust is sent, one that stands still though pushed by 0.3 m/s, while the height moves that way",
        Action.LAND,
        "down by setpoints, held by the lines: the autopilot keeps their climb rate; where thrust is sent,"
        " the height's rate keeps it; once that is lost, too, the autopilot's own landing: thrust cannot be"
        " steered unmeasured; nothing is armed without a climb rate",
        _FAST,
    ),
    Hazard(
        "climb_wrong",
        Trigger.CLIMB_WRONG,
        "range finder and lines' width both change by 0.35 m more, or less, within two seconds than the"
        " autopilot tells to have climbed: moved air has misled its barometer",
        Action.LAND,
        "from 0.15 m on the climb is commanded otherwise by that error, by 1.5 m/s at most; the heights are"
        " believed; down by them",
        _FAST,
    ),
    Hazard(
        "height_stuck",
        Trigger.HEIGHT_STUCK,
        "the height does not follow the climb that the autopilot tells: it stands still for 0.4 m within"
        " 1.5 s, or stays 0.5 m behind within 3 s, one drop over goods left out; or stays 3 m behind what was"
        " commanded within 8 s",
        Action.LAND,
        "the height is not believed again in this flight: no climb; down by the lines",
        "tests/sim/hazards/test_stuck_height.py",
    ),
    Hazard(
        "height_wrong",
        Trigger.HEIGHT_WRONG,
        "width of the seen lines against the map's by more than `hazards.height_share`, or by 0.25 m and"
        " 12 %, or by 8.5 % where their distances and the drone's motion tell the same, for"
        " `hazards.disagree_s`, less what is climbed within the range finder's 0.1 s and the delay's error;"
        " from the floor on, too; over once both agree to 10 % for 0.5 s",
        Action.HOLD,
        "no climb by it; land after `mission.lines_land_s`",
        _FAST,
    ),
    Hazard(
        "attitude_wrong",
        Trigger.ATTITUDE_WRONG,
        "heading by the lines against the vehicle's, or the told one against the gyros by 6 degrees within"
        " half a second, by more than `hazards.heading_deg` for `hazards.disagree_s`",
        Action.LAND,
        "the heading is carried by the gyros and taken from the lines; land by them",
        _FAST,
    ),
    Hazard(
        "camera_turned",
        Trigger.ATTITUDE_WRONG,
        "heading by the lines against it, where the picture leapt and the heading did not",
        Action.LAND,
        "the camera is taken to be turned in its mount by so much; land by the lines",
        "tests/sim/hazards/test_lasting_faults.py",
    ),
    Hazard(
        "battery_low",
        Trigger.BATTERY_LOW,
        "charge below `mission.battery_home`, a cell below `battery.cell_home_v` for 2 s, or what flying took"
        " so far, times the time of the way back, and `battery.reserve` left",
        Action.HOME,
        "fly to the nearest charge pad, against one-way lines when below",
        _FAST,
    ),
    Hazard(
        "battery_critical",
        Trigger.BATTERY_CRITICAL,
        "charge below `mission.battery_land`, or a cell below `battery.cell_land_v` for 2 s; where the charge"
        " is not known any more, the last one less what flying takes",
        Action.LAND,
        "land here",
        _FAST,
    ),
    Hazard(
        "battery_unknown",
        Trigger.BATTERY_UNKNOWN,
        "nothing told of the battery for `battery.silent_s`, no charge for 3 s, one that stands still, or"
        " flickers between two neighbouring per cents, while `battery.frozen` should have gone, or volts that"
        " its cells cannot have",
        Action.CONFIGURED,
        "`hazards.battery_unknown`: home or land",
        _FAST,
    ),
    Hazard(
        "wind",
        Trigger.WIND,
        "a steady push of more than `hazards.expert.push_mps2`, or off its place by `hazards.expert.off_m`,"
        " for `hazards.expert.push_s`",
        Action.LAND,
        "land by the lines",
        _FAST,
    ),
    Hazard(
        "landing_unreported",
        None,
        "down at the height that the range finder read on the floor, neither climbing nor turning over, while"
        " it sinks; or the same for 2 s at any height that it reads, commanded to sink; or a landing that"
        " takes longer than twice its way's time and"
        " `mission.expert.phase_slack_s`",
        Action.LAND,
        "after 1.5 s level, after 2.5 s the autopilot's own landing, which disarms; then asked to disarm,"
        " never forced. By time: the autopilot's own landing, then given up with an error, still asked to"
        " land",
        "tests/sim/hazards/test_landing_unreported.py",
        shows_landing=True,
    ),
    Hazard(
        "ceiling_left",
        Trigger.CEILING_LEFT,
        "height above the ceiling less `hazards.headroom_m`",
        Action.LAND,
        "no setpoint climbs there; down",
        _FAST,
    ),
    Hazard(
        "corridor_left",
        Trigger.CORRIDOR_LEFT,
        "position further than `hazards.corridor_m` from the open lines of the map, or where a shelf stands"
        " near a line nearer than 0.35 m to it (0.2 m beside the line are always free), or nearer than 0.45 m"
        " to a keep-out, seen or dead-reckoned, as long as it is known to 0.3 m, and to two thirds of the way"
        " that is free beside the line",
        Action.HOLD,
        "no setpoint leans further out, nor towards a keep-out nearer than 0.45 m and the way in which the"
        " drone comes to rest; back to the nearest line, land after `mission.lines_land_s`",
        _FAST,
    ),
    Hazard(
        "ground_lost",
        Trigger.GROUND_LOST,
        "the last ground station that attends silent for `ground.lost_s`",
        Action.CONFIGURED,
        "`ground.lost_action`: continue, hold, home or land; no hold outlasts the charge that the way back"
        " needs",
        _FAST,
    ),
    Hazard(
        "aisle_open",
        Trigger.AISLE_OPEN,
        "where `interlock.file` is named (a site may demand that): it does not say any more that the aisles"
        " are closed, or cannot be read",
        Action.CONFIGURED,
        "nothing arms; in flight `hazards.aisle_open`: continue, hold, home or land; no hold outlasts the"
        " charge that the way back needs",
        _FAST,
    ),
    Hazard(
        "lines_lost",
        Trigger.LINES_LOST,
        "no line of the map newer than `mission.lines_hold_s`, the followed one older than 0.8 s, and no"
        " features of the floor that carry the position on (`localisation.expert.by_features_m`), or the"
        " position too uncertain; in a take-off no line and no mat seen from a metre up (0.65 of a lower"
        " flying height), or not for `hazards.expert.search_land_s`",
        Action.HOLD,
        "brake by dead reckoning, hold; after `hazards.expert.search_s` climb by"
        " `hazards.expert.search_climb_m` to see more; land after `hazards.expert.search_land_s`, or with"
        " glimpses after `mission.lines_land_s`; a take-off lands, and climbs by no more than"
        " `hazards.expert.search_climb_m` meanwhile",
        _FAST,
    ),
    Hazard(
        "camera_frozen",
        Trigger.CAMERA_FROZEN,
        "the same picture for `mission.lines_hold_s`; a repeated one is never used",
        Action.HOLD,
        _BLIND + _CLIMBING,
        _FAST,
    ),
    Hazard(
        "camera_blind",
        Trigger.CAMERA_BLIND,
        "black, white or flat pictures for `mission.lines_hold_s`",
        Action.HOLD,
        _BLIND + _CLIMBING,
        _FAST,
    ),
    Hazard(
        "frames_stale",
        Trigger.FRAMES_STALE,
        "newest picture exposed more than `mission.lines_hold_s` ago",
        Action.HOLD,
        _BLIND + _CLIMBING + "; the camera is opened again",
        _FAST,
    ),
    Hazard(
        "camera_gone",
        Trigger.FRAMES_STALE,
        "no picture at all: as stale ones",
        Action.HOLD,
        _BLIND + _CLIMBING + "; the camera is opened again",
        _FAST,
    ),
    Hazard(
        "frames_disordered",
        None,
        "a frame exposed before one that was delivered already, or more than a second ago",
        Action.REPORT,
        "refused and counted, never flown by; the times of the others stay as they are",
        "tests/sim/hazards/test_camera_times.py",
    ),
    Hazard(
        "delay_leapt",
        Trigger.DELAY_LEAPT,
        "what lines err by while the drone leans, all of them together: Page's test for a delay of the camera"
        " that is another one by 20 ms",
        Action.REPORT,
        "it is learnt anew, as quickly as at first: to 10 ms within a second in which it leans; lines that a"
        " lean moves count for less until then, and the gains stay as they are",
        _FAST,
    ),
    Hazard(
        "lean_leapt",
        Trigger.LEAN_LEAPT,
        "roll or pitch told otherwise by more than a degree from one sample to the next, while the gyros,"
        " which explained its turns before, felt none",
        Action.REPORT,
        "roll and pitch are carried by the gyros, and what the told ones leave out is leaned against at once",
        _FAST,
    ),
    Hazard(
        "detector_killed",
        Trigger.DETECTOR_LOST,
        "the detector's channel closes, in the middle of an answer too",
        Action.REPORT,
        "replaced at once, the frame counted as lost; all of them gone is as stale pictures",
        _FAST,
    ),
    Hazard(
        "detector_hung",
        Trigger.DETECTOR_LOST,
        "no answer, or only a part of one, within `vision.timeout_s`",
        Action.REPORT,
        "killed and replaced, the frame counted as lost",
        _FAST,
    ),
    Hazard(
        "overload",
        Trigger.OVERLOAD,
        "p99 from exposure to the wire, dropped frames included, above `hazards.latency_s`, or ticks late on"
        " average by more than 40 ms, for `hazards.overload_s`",
        Action.HOLD,
        _HOLD,
        _FAST,
    ),
    Hazard(
        "swings",
        Trigger.SWINGS,
        "half swings of the velocity about the reference's above 0.4 m/s: three, none smaller than four"
        " fifths of the one before, or two that grow; above 0.3 m/s three that are all alike and lean by 1.5"
        " m/s^2: the position loop is too fast for what is late in it. Found within 2 s of the full swing"
        " where it is 60 to 180 ms too late; a swing of 7 cm or less is not told from gusts",
        Action.HOLD,
        "slowed down to 60 %, then to 35 %, at once where it swings faster than 0.8 m/s, and hardly more than"
        " level where even that does; tried faster again once after 8 s of calm; brake, hold; on when"
        " it is over; land after 12 s of it alone: gusts and a shaken camera keep even a slow loop moving",
        _FAST,
    ),
    Hazard(
        "clock_jump",
        Trigger.CLOCK_JUMP,
        "attitudes whose time makes no sense, or a tick 0.3 s late",
        Action.HOLD,
        "times of arrival are used; on when the clocks agree again; wall time decides nothing",
        _FAST,
    ),
    Hazard(
        "loop_stalled",
        Trigger.CLOCK_JUMP,
        "a tick 0.3 s late: the daemon stood still",
        Action.HOLD,
        "frames and attitudes that waited keep the time at which they were true, what is old is refused; on"
        " when nothing is missing; if it stood still for longer than the autopilot's own failsafe bears"
        " (`companion_dead`), that lands, and is left to it",
        "tests/sim/hazards/test_camera_times.py",
    ),
    Hazard(
        "clock_unsure",
        Trigger.CLOCK_UNSURE,
        "offset and rate of the vehicle's clock are not known to `hazards.clock_error_s`: it does not answer",
        Action.HOLD,
        _HOLD,
        _FAST,
    ),
    Hazard(
        "map_wrong",
        Trigger.POSITION_DOUBTED,
        "probability of the node below `mission.integrity_min` for 0.3 s (3 s after take-off), or the"
        " position turned out to be another",
        Action.RELOCATE,
        "stop, climb up to 1 m to see more, move along the line to where the possible places differ, or back"
        " the way it came where no such way is safe; on from the right node when sure; land after"
        " `mission.relocate_s` of doubt within a metre, or where no open line leads on from that node; no"
        " node counts as visited meanwhile",
        "tests/sim/ideal/test_carried.py",
    ),
    Hazard(
        "step_failed",
        Trigger.STEP_FAILED,
        "an error in the flight software itself, at whatever place of a control tick",
        Action.LAND,
        "level at the same tick; the next one lands, by the lines; where that fails too, it comes to rest"
        " over the floor and sinks by what is seen of it, without the mission, and below 0.4 m or where that"
        " fails as well, level and down by the autopilot's own landing; the error is an event, its traceback"
        " is in the flight log",
        "tests/sim/hazards/test_step_failures.py",
    ),
    Hazard(
        "disk_full",
        Trigger.RECORD_LOST,
        "the disk refuses the flight log, or keeps a writing process that was killed for 2 s, or a message"
        " found no room in the last 3 s",
        Action.CONFIGURED,
        "`hazards.record_lost`: continue, hold, home or land; no hold outlasts the charge that the way back"
        " needs",
        _FAST,
    ),
    Hazard(
        "recorder_dead",
        Trigger.RECORDER_DEAD,
        "the log's writing process ends",
        Action.REPORT,
        "another goes on in the same file",
        _FAST,
    ),
    Hazard(
        "recorder_hung",
        Trigger.RECORDER_DEAD,
        "the log's writing process tells nothing for 6 s, a new one, which looks through the log first, for"
        " 60 s",
        Action.REPORT,
        "killed; another goes on in the same file, with what waited",
        _FAST,
    ),
)

ACTIONS = {row.trigger: row.action for row in HAZARDS if row.trigger is not None}
"""What each hazard's trigger asks for."""


def triggers_of(*actions: Action) -> frozenset[Trigger]:
    """The hazards' triggers that are answered by one of `actions`."""
    return frozenset(trigger for trigger, action in ACTIONS.items() if action in actions)


def markdown() -> str:
    """The table as the guide prints it."""
    lines = ["| hazard | found by | action | then |", "|---|---|---|---|"]
    lines += [f"| `{row.name}` | {row.found_by} | {row.action} | {row.then} |" for row in HAZARDS]
    return "\n".join(lines) + "\n"
