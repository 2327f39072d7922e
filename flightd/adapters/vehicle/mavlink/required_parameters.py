"""Which autopilot parameters this job needs, and why: data, one table for each firmware.

A value that is missing in the firmware at hand is not judged.  `better` is what a fix would write; None
where only a person can choose.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from flightd.adapters.vehicle.mavlink.link.connection import Firmware
from flightd.adapters.vehicle.mavlink.parameter_rule import Rule, has_bits, one_of, within
from flightd.adapters.vehicle.mavlink.pose_parameters import pose_rules
from flightd.config.battery import BatteryConfig
from flightd.config.vehicle import PoseChoice, VehicleConfig

FIRMWARES = {"ardupilot": Firmware.ARDUPILOT, "px4": Firmware.PX4, "mavsdk": Firmware.PX4}
"""By `vehicle.kind`, of those that have parameters."""

UNKNOWN_BATTERY = BatteryConfig()
"""One whose cells nobody has counted."""


@dataclass(frozen=True, slots=True)
class Job:
    """What the daemon is configured to ask of the autopilot beyond flight by attitude.  `own_system_id` is
    this computer's, which nothing else on the vehicle has."""

    own_system_id: int = VehicleConfig().own_system_id
    guided: bool = False
    """ArduCopter flies in GUIDED, which wants an estimate of its motion."""
    raw_thrust: bool | None = None
    """What bit 3 of ArduCopter's GUID_OPTIONS must be; None: either."""
    pose_output: PoseChoice = "auto"
    landing_target: bool = False
    battery: BatteryConfig = UNKNOWN_BATTERY
    range_finder: int | None = None
    """Id of the range finder to fly by, which ArduPilot counts from 0; None: the first."""

    @classmethod
    def of(cls, config: VehicleConfig, battery: BatteryConfig) -> Job:
        """What is configured of the vehicle and its battery."""
        return cls(
            own_system_id=config.own_system_id,
            guided=config.flying_mode == "guided",
            raw_thrust=config.raw_thrust,
            pose_output=config.pose_output if config.shares_pose else "none",
            landing_target=config.landing_target,
            battery=battery,
            range_finder=config.range_finder,
        )


def _range_finder(sensor: int) -> tuple[Rule, ...]:
    reason = "the height above the floor comes from it"
    return (
        Rule((f"RNGFND{sensor + 1}_TYPE",), lambda value: value != 0, "a range finder", reason),
        Rule((f"RNGFND{sensor + 1}_ORIENT",), one_of(25), "25 (down)", reason, 25),
    )


_CLIMB = "the climb rate shows a range finder that sticks: it must not come from the same one"

_CLIMBS_ON = "a climb of 0.8 m/s that must end rises 0.2 m more; by the firmware's defaults 0.4 m"

_ARDUPILOT: tuple[Rule, ...] = (
    Rule(
        ("GUID_TIMEOUT",),
        within(0.1, 0.5),
        "0.3 to 0.5 s",
        "so long the last tilt is flown on after this computer has died",
        0.3,
    ),
    Rule(
        ("GUID_OPTIONS",),
        lambda value: not int(value) & ~(1 | 8),
        "0, or 8 for raw thrust",
        "the other bits change what setpoints mean",
    ),
    Rule(("DISARM_DELAY",), within(2, 30), "2 to 30 s", "an armed vehicle on the pad must disarm itself", 10),
    Rule(
        ("FS_EKF_ACTION",),
        one_of(1, 3),
        "1 (land) or 3 (land in all modes)",
        "without position there is nothing else to fall back to",
        1,
    ),
    Rule(
        ("FS_GCS_ENABLE",),
        one_of(5),
        "5 (land)",
        "else nothing lands the vehicle when this computer dies in flight",
        5,
    ),
    Rule(
        ("FS_GCS_TIMEOUT",),
        within(0.4, 1.0),
        "0.4 to 1 s",
        "so long, and up to 0.33 s more, it drifts, level, without anybody before it lands by itself",
        0.5,
    ),
    Rule(
        ("FS_THR_ENABLE",),
        one_of(0, 3),
        "3 (land), or 0 for flight without RC",
        "a return to launch needs a position",
        3,
    ),
    Rule(
        ("RC_OPTIONS",),
        lambda value: not int(value) & 1,
        "bit 0 clear",
        "the receiver is ignored: no pilot could take over",
    ),
    Rule(("BATT_FS_LOW_ACT",), one_of(1), "1 (land)", "an empty battery must end in a landing", 1),
    Rule(("BATT_LOW_VOLT",), lambda value: value > 0, "above 0 V", "else the battery failsafe never acts"),
    Rule(("AHRS_EKF_TYPE",), one_of(3), "3 (EKF3)", "the heights and attitudes used here are EKF3's", 3),
    Rule(("EK3_ENABLE",), one_of(1), "1", "EKF3 must run", 1),
    Rule(("EK3_SRC1_POSXY",), one_of(0, 6), "0 (none) or 6 (external)", "there is no GPS in the hall", 0),
    Rule(
        ("EK3_SRC1_VELXY",),
        one_of(0, 5, 6),
        "0 (none), 5 (flow) or 6 (external)",
        "there is no GPS in the hall",
        0,
    ),
    Rule(("EK3_SRC1_POSZ",), one_of(1), "1 (barometer)", _CLIMB, 1),
    Rule(("EK3_SRC1_VELZ",), one_of(0, 6), "0 (none) or 6 (external)", "there is no GPS in the hall", 0),
    Rule(
        ("EK3_SRC1_YAW",),
        one_of(0, 1, 6),
        "1 (compass), 0 (gyro) or 6 (external)",
        "there is no GPS in the hall",
        1,
    ),
    Rule(("GPS1_TYPE", "GPS_TYPE"), one_of(0), "0 (none)", "indoors a GPS reports nonsense", 0),
    *_range_finder(0),
    Rule(("ARMING_CHECK",), lambda value: value != 0, "1 (all)", "arming unchecked hides faults", 1),
    Rule(("ARMING_SKIPCHK",), one_of(0), "0 (none skipped)", "arming unchecked hides faults", 0),
    Rule(
        ("LAND_SPEED",),
        within(70, 100),
        "70 to 100 cm/s",
        "a landing of last resort is blind: it drifts for as long as it takes (1 m/s is a drop of 5 cm)",
        90,
    ),
    Rule(
        ("WPNAV_ACCEL_Z", "WP_ACC_Z"),
        within(200, 500),
        "200 to 500 cm/s2 (4.7: 2 to 5 m/s2)",
        _CLIMBS_ON,
        250,
        newer=2.5,
    ),
    Rule(("PSC_JERK_Z", "PSC_JERK_D", "PSC_D_JERK"), within(15, 50), "15 to 50 m/s3", _CLIMBS_ON, 20),
)

_PX4: tuple[Rule, ...] = (
    Rule(
        ("COM_OF_LOSS_T",),
        within(0.2, 1.0),
        "0.5 to 1 s",
        "so long the last tilt and thrust are flown on after this computer has died",
        0.5,
    ),
    Rule(
        ("COM_OBL_RC_ACT",),
        one_of(4),
        "4 (land)",
        "else nothing lands the vehicle when this computer dies: the default, Position, cannot be held"
        " without a position",
        4,
    ),
    Rule(
        ("COM_RCL_EXCEPT",),
        has_bits(4),
        "bit 2 set (4)",
        "without RC the loss of RC must not end OFFBOARD",
    ),
    Rule(
        ("COM_RC_OVERRIDE",),
        has_bits(2),
        "bit 1 set (3)",
        "a pilot who moves the sticks must get the vehicle out of OFFBOARD",
        3,
    ),
    Rule(
        ("COM_RC_IN_MODE",),
        one_of(0, 1, 2, 3, 5, 6, 7, 8),
        "any of 0 to 8 but 4 (stick input disabled)",
        "the sticks are ignored: no pilot could take over",
    ),
    Rule(("COM_DISARM_LAND",), within(0.1, 20), "above 0 s", "a landed vehicle must disarm itself", 2),
    Rule(
        ("COM_DISARM_PRFLT",),
        within(1, 30),
        "1 to 30 s",
        "an armed vehicle on the pad must disarm itself",
        10,
    ),
    Rule(("MAV_FWDEXTSP",), one_of(1), "1", "without it setpoints are not passed on", 1),
    Rule(("COM_ARM_WO_GPS",), lambda value: value != 0, "1 or 2", "there is no GPS in the hall", 1),
    Rule(("EKF2_GPS_CTRL",), one_of(0), "0", "indoors a GPS reports nonsense", 0),
    Rule(("EKF2_HGT_REF",), one_of(0), "0 (barometer)", _CLIMB, 0),
    Rule(("MPC_THR_HOVER",), within(0.1, 0.8), "0.1 to 0.8", "the first guess of the hover thrust"),
)

_LAST_RESORT_V, _AFTER_HOME_V = 0.1, 0.05
"""So far below `cell_land_v` a cell has enough to come down by, so far below `cell_home_v` to get home by."""
_GUID_OPTIONS = "the thrust of our setpoints would be taken for something else (vehicle.raw_thrust)"

_ARDUPILOT_GUIDED = (
    Rule(
        ("EK3_SRC1_VELXY",),
        one_of(5, 6),
        "5 (flow) or 6 (external)",
        "GUIDED needs an estimate of the motion (vehicle.flying_mode)",
    ),
)
_ARDUPILOT_LANDING = (
    Rule(("PLND_ENABLED",), one_of(1), "1", "else the landing target is not heard", 1),
    Rule(("PLND_TYPE",), one_of(1), "1 (MAVLink)", "else the landing target is not heard", 1),
)


def _guid_options(raw: bool) -> Rule:
    expected = "8 (raw thrust)" if raw else "0 (thrust is a climb rate)"
    return Rule(
        ("GUID_OPTIONS",),
        lambda value: bool(int(value) & 8) is raw and not int(value) & ~(1 | 8),
        expected,
        _GUID_OPTIONS,
        8.0 if raw else 0.0,
    )


def _low_volt(battery: BatteryConfig, cells: int) -> Rule:
    """The autopilot's landing is the last resort: after our way home, not before it."""
    least = _last_resort_v(battery, cells)
    most_v = max(battery.cell_home_v - _AFTER_HOME_V, battery.cell_land_v)
    most, better = round(most_v * cells, 2), round(battery.cell_land_v * cells, 2)
    return Rule(
        ("BATT_LOW_VOLT",),
        within(least, most),
        f"{least:g} to {most:g} V for {cells} cells (battery.cells, cell_home_v, cell_land_v)",
        "above, the autopilot lands in the aisle what could still fly home; below, it acts too late",
        better,
    )


def _critical_volt(battery: BatteryConfig, cells: int) -> Rule:
    """An ArduPilot with a critical voltage above its low one is refused arming."""
    most = _last_resort_v(battery, cells)
    return Rule(
        ("BATT_CRT_VOLT",),
        lambda value: value <= most,
        f"0, or up to {most:g} V for {cells} cells (battery.cells, cell_land_v)",
        "it has to lie below BATT_LOW_VOLT, else nothing arms",
        0,
        optional=True,
    )


def _last_resort_v(battery: BatteryConfig, cells: int) -> float:
    return round((battery.cell_land_v - _LAST_RESORT_V) * cells, 2)


def _cells_of(cells: int) -> Rule:
    return Rule(
        ("BAT1_N_CELLS", "BAT_N_CELLS"),
        one_of(cells),
        f"{cells} (battery.cells)",
        "the autopilot's own charge and low-battery landing go by it",
        cells,
    )


def _supervised(own_system_id: int) -> Rule:
    return Rule(
        ("SYSID_MYGCS", "MAV_GCS_SYSID"),
        one_of(own_system_id),
        f"{own_system_id} (vehicle.own_system_id)",
        "FS_GCS_ENABLE watches the heartbeats of that system, which must be this computer's alone",
        own_system_id,
    )


def _alone(own_system_id: int) -> Rule:
    return Rule(
        ("MAV_GCS_SYSID_HI",),
        lambda value: value <= own_system_id,
        "0",
        "above MAV_GCS_SYSID all systems up to it count as this computer: a ground station would hold off"
        " the landing",
        0,
        optional=True,
    )


RULES: dict[Firmware, tuple[Rule, ...]] = {Firmware.ARDUPILOT: _ARDUPILOT, Firmware.PX4: _PX4}


def rules_for(firmware: Firmware, job: Job) -> tuple[Rule, ...]:
    """The firmware's table, with the rules that the job adds or makes stricter in their places."""
    extra: tuple[Rule, ...] = ()
    cells = job.battery.cells
    if firmware is Firmware.ARDUPILOT:
        extra += (_supervised(job.own_system_id), _alone(job.own_system_id))
        if cells is not None:
            extra += (_low_volt(job.battery, cells), _critical_volt(job.battery, cells))
        if job.guided:
            extra += _ARDUPILOT_GUIDED
        if job.raw_thrust is not None:
            extra += (_guid_options(job.raw_thrust),)
        if job.landing_target:
            extra += _ARDUPILOT_LANDING
    elif cells is not None:
        extra += (_cells_of(cells),)
    extra += pose_rules(firmware, job.pose_output, landing_target=job.landing_target)
    stricter = {rule.names: rule for rule in extra if not rule.advised}
    other = job.range_finder if firmware is Firmware.ARDUPILOT else None
    if other is not None:
        pairs = zip(_range_finder(0), _range_finder(other), strict=True)
        stricter |= {first.names: rule for first, rule in pairs}
    better = {rule.names: rule.better for rule in extra}
    table = [
        stricter.pop(rule.names, replace(rule, better=better.get(rule.names, rule.better)))
        for rule in RULES[firmware]
    ]
    return (*table, *stricter.values())


def advice_for(firmware: Firmware, job: Job) -> tuple[Rule, ...]:
    """What the autopilot has to be set to beyond them to take our motion, where it is left to it.

    A PX4 is left as it is: PX4 1.17 in its own simulator (SIH) kept its line two to ten times worse by our
    motion and swung where its sensors shook; told to be a hundred times less sure of it, still three times
    worse at quiet ones."""
    if firmware is Firmware.PX4:
        return ()
    rules = pose_rules(firmware, job.pose_output, landing_target=job.landing_target)
    return tuple(rule for rule in rules if rule.advised)


_WAY_DOWN = frozenset(
    {
        *("GUID_TIMEOUT", "FS_GCS_ENABLE", "FS_GCS_TIMEOUT", "SYSID_MYGCS", "MAV_GCS_SYSID_HI"),
        *("COM_OBL_RC_ACT", "COM_OF_LOSS_T"),
    }
)


def way_down_rules(rules: tuple[Rule, ...]) -> tuple[Rule, ...]:
    """Those by which the autopilot itself levels and lands when this computer dies."""
    return tuple(rule for rule in rules if _WAY_DOWN.intersection(rule.names))
