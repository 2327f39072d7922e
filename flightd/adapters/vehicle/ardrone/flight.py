"""What goes to the drone next: REF and PCMD out of demand, setpoint and telemetry.

Pure: time is an argument, commands are the result.  The rules:

- Before the first navdata, and on the ground in HANDS_OFF, only COMWDG keeps the link awake: a daemon that
  starts beside a flying drone must not land it by accident.  One that is found flying is held in place for
  `unattended_s`; if nothing is demanded by then, nobody is coming, and it lands.  One that stood and took
  off in HANDS_OFF is another pilot's: not a word from us.
- FLY: flat trim once per boot of the drone, then REF with the fly bit, repeated, until the drone leaves
  LANDED.  LAND lands.  STANDBY and DISARM never change what the drone does, their fly bit follows the
  telemetry: the motors stop at the end of a landing, and in the air nothing of ours ever cuts them.
- HANDS_OFF in the air: one hover command, a command number 1, then silence.  Any command of ours would
  outrun the numbers of whoever takes over, and the 1 makes the drone obey his; if nobody comes, it lands
  itself after `general:com_watchdog` seconds.
- A mission lands by sinking: below `land_below_m`, or with a deaf sonar, a descent becomes REF's landing
  order, since this drone touches down only by its own landing.
- A flight that the drone ended by itself (battery, lost link, emergency) is over: nothing takes off again
  until FLY has been demanded anew.  The same after `link_lost_s` without navdata: by then it lands itself.
- Setpoints or telemetry that are late turn into hover at once, because the drone holds the last PCMD.
"""

from __future__ import annotations

from flightd.adapters.vehicle.ardrone import at
from flightd.adapters.vehicle.ardrone.at import AtCommand
from flightd.adapters.vehicle.ardrone.navdata import DroneState, Major
from flightd.adapters.vehicle.ardrone.refusal import (
    DisarmInFlight,
    Emergency,
    LandedByItself,
    LinkLost,
    NoNavdata,
    NotConfigured,
    StaysLanded,
    Unattended,
)
from flightd.adapters.vehicle.ardrone.settings import ArDroneSettings
from flightd.adapters.vehicle.ardrone.telemetry import NavdataTelemetry
from flightd.core.refusal import Refusal
from flightd.core.types import AttitudeSetpoint, Demand

_TRIM_REPEATS = 3
_PRESS_NS = 1_000_000_000
_RELEASE_NS = 300_000_000
_DESCENT_MPS = 0.05
_HOVER_CLIMB_MPS = 0.05


class TiltLimits:
    """Full scale of PCMD's arguments, as the drone has them in force."""

    def __init__(self, settings: ArDroneSettings) -> None:
        self.tilt_rad = settings.tilt_max_rad
        self.climb_mps = settings.climb_max_mps
        self.yaw_rate_radps = settings.yaw_rate_max_radps

    def take(self, values: dict[str, str]) -> None:
        """Scale by what the drone says it does, where it says so."""
        for key, name, unit in (
            ("control:euler_angle_max", "tilt_rad", 1.0),
            ("control:control_vz_max", "climb_mps", 1e-3),
            ("control:control_yaw", "yaw_rate_radps", 1.0),
        ):
            try:
                value = float(values[key]) * unit
            except (KeyError, ValueError):
                continue
            if 0.0 < value < 100.0:
                setattr(self, name, value)


class FlightLogic:
    """Decides REF and PCMD at each beat; see the module's rules."""

    def __init__(self, settings: ArDroneSettings, telemetry: NavdataTelemetry) -> None:
        self._settings = settings
        self._telemetry = telemetry
        self.limits = TiltLimits(settings)
        self.configured = False
        self.demand = Demand.HANDS_OFF
        self._setpoint: AttitudeSetpoint | None = None
        self._setpoint_ns = 0
        self._trims_left = _TRIM_REPEATS
        self._asked_ns: int | None = None
        self._press_ns: int | None = None
        self._flew = False
        self._sinking = False
        self._hushed = False
        self._stood = False
        self._alone_since_ns: int | None = None
        self._over: Refusal | None = None

    # what others say

    def want(self, demand: Demand) -> None:
        """The mission's demand; a change gives the drone a new chance after a flight that ended itself."""
        if demand == self.demand:
            return
        self._hushed = demand is Demand.HANDS_OFF and self._telemetry.airborne
        self.demand = demand
        self._flew = self._sinking = self._stood = False
        self._over = None
        self._asked_ns = self._press_ns = self._setpoint = self._alone_since_ns = None

    def forget_drone(self) -> None:
        """The drone came up anew: it has to be configured and trimmed again."""
        self.configured = False
        self._trims_left = _TRIM_REPEATS

    def steer(self, setpoint: AttitudeSetpoint, now_ns: int) -> None:
        self._setpoint, self._setpoint_ns = setpoint, now_ns

    # what the daemon sees

    @property
    def silent(self) -> bool:
        """Someone else may be flying: not a word from us."""
        return self._hushed

    @property
    def heard(self) -> bool:
        return self._telemetry.demo is not None

    def linked(self, now_ns: int) -> bool:
        """Whether telemetry is fresh enough to fly by."""
        return self.heard and now_ns - self._telemetry.flight_ns <= self._settings.telemetry_stale_s * 1e9

    def in_control(self, now_ns: int) -> bool:
        """The drone obeys setpoints or will once airborne, and we want it to."""
        telemetry = self._telemetry
        landing = telemetry.major == Major.LANDING and self.demand is Demand.FLY and not self._sinking
        return (
            self.demand in (Demand.KEEP, Demand.FLY, Demand.LAND)
            and self.configured
            and self.linked(now_ns)
            and not self._over
            and not landing
            and not telemetry.state & (DroneState.EMERGENCY | DroneState.COM_LOST)
        )

    def refusal(self, now_ns: int) -> Refusal | None:
        """Why the drone does not do what is demanded; None where it does."""
        if not self.heard:
            return NoNavdata()
        if (emergency := self._telemetry.emergency) is not None:
            return emergency
        if self.demand is Demand.DISARM and self._fly(now_ns):
            return DisarmInFlight()
        if self._over is not None or self.demand is not Demand.FLY:
            return self._over
        return self._take_off_refusal(now_ns)

    def _take_off_refusal(self, now_ns: int) -> Refusal | None:
        if not self.configured:
            return NotConfigured()
        waited_s = 0.0 if self._asked_ns is None else (now_ns - self._asked_ns) / 1e9
        if self._telemetry.airborne or waited_s <= self._settings.take_off_patience_s:
            return None
        return StaysLanded(self._telemetry.battery_percent)

    # what goes out

    def commands(self, now_ns: int) -> list[AtCommand]:
        """The commands of this beat; none at all means radio silence."""
        telemetry = self._telemetry
        if self.heard and self.demand is Demand.HANDS_OFF:
            self._watch(now_ns)
        if self._hushed:
            return []
        if not self.heard or (self.demand is Demand.HANDS_OFF and not telemetry.airborne):
            return [at.comwdg()]
        self.follow(now_ns)
        commands = [at.comwdg()] if telemetry.state & DroneState.COM_WATCHDOG else []
        if self._may_take_off(now_ns) and self._trims_left:
            self._trims_left -= 1
            return [*commands, at.ref(fly=False), at.ftrim(), at.hover()]
        fly = self._fly(now_ns)
        return [*commands, at.ref(fly=fly, emergency=self._press(now_ns)), self._stick(now_ns)]

    def hush(self, now_ns: int) -> list[AtCommand]:
        """The last word before silence."""
        return [at.ref(fly=self._stays_up(now_ns)), at.hover()]

    def follow(self, now_ns: int) -> None:
        """Notice that the drone took off, or ended the flight by itself; with each packet and each beat."""
        telemetry = self._telemetry
        if self.demand is not Demand.FLY or self._over:
            return
        if telemetry.airborne:
            self._flew = True
        if not self._flew:
            return
        silent_s = (now_ns - telemetry.flight_ns) / 1e9
        setpoint = self._setpoint
        low = not telemetry.height_m >= self._settings.land_below_m  # or unknown: the sonar is deaf
        if low and setpoint is not None:
            self._sinking |= setpoint.climb_mps < -_DESCENT_MPS
        if telemetry.state & DroneState.EMERGENCY:
            self._over = Emergency(telemetry.state, in_flight=True)
        elif silent_s > self._settings.link_lost_s:
            self._over = LinkLost(self._settings.link_lost_s)
        elif not self._sinking and telemetry.major in (Major.LANDING, Major.LANDED):
            self._over = LandedByItself(telemetry.battery_percent)

    def _watch(self, now_ns: int) -> None:
        """Of a drone that is to be left alone: whether another flies it, or nobody does any more."""
        if not self._telemetry.airborne:
            self._stood = True
        elif self._stood:
            self._hushed = True
        elif self._alone_since_ns is None:
            self._alone_since_ns = now_ns
        elif now_ns - self._alone_since_ns >= self._settings.unattended_s * 1e9:
            self._over = Unattended(self._settings.unattended_s)

    def _may_take_off(self, now_ns: int) -> bool:
        telemetry = self._telemetry
        landed = telemetry.major in (Major.LANDED, Major.INIT, Major.DEFAULT)
        ready = self.configured and self.linked(now_ns) and not telemetry.state & DroneState.EMERGENCY
        return self.demand is Demand.FLY and landed and ready and not (self._over or self._flew)

    def _fly(self, now_ns: int) -> bool:
        telemetry = self._telemetry
        if self.demand is Demand.FLY:
            starting = self._may_take_off(now_ns)
            if starting and self._asked_ns is None:
                self._asked_ns = now_ns
            going_up = telemetry.airborne and not self._over and not self._sinking
            return starting or going_up
        return self.demand is not Demand.LAND and not self._over and self._stays_up(now_ns)

    def _stays_up(self, now_ns: int) -> bool:
        """The drone flies and is not landing, as far as we know; after a lost link it will have landed, and
        a fly bit that greets it then would send it up again."""
        telemetry = self._telemetry
        known = now_ns - telemetry.flight_ns <= self._settings.link_lost_s * 1e9
        return known and telemetry.airborne and telemetry.major != Major.LANDING

    def _press(self, now_ns: int) -> bool:
        """The emergency bit: held until the drone leaves the emergency, let go and pressed anew if it
        does not, and only on FLY demanded after the emergency came."""
        fresh = self.demand is Demand.FLY and not self._over
        if not fresh or not self._telemetry.state & DroneState.EMERGENCY:
            self._press_ns = None
            return False
        if self._press_ns is None or now_ns - self._press_ns >= _PRESS_NS + _RELEASE_NS:
            self._press_ns = now_ns
        return now_ns - self._press_ns < _PRESS_NS

    def _stick(self, now_ns: int) -> AtCommand:
        setpoint = self._setpoint
        late = now_ns - self._setpoint_ns > self._settings.setpoint_timeout_s * 1e9
        free = self.demand is Demand.FLY and not self._sinking and not self._over and self.linked(now_ns)
        if setpoint is None or late or not free:
            return at.hover()
        tilted = setpoint.roll_rad != 0.0 or setpoint.pitch_rad != 0.0
        moving = setpoint.yaw_rate_radps != 0.0 or abs(setpoint.climb_mps) >= _HOVER_CLIMB_MPS
        if not tilted and not moving:
            return at.hover()
        limits = self.limits
        return at.pcmd(
            roll=setpoint.roll_rad / limits.tilt_rad,
            pitch=setpoint.pitch_rad / limits.tilt_rad,
            gaz=setpoint.climb_mps / limits.climb_mps,
            yaw=setpoint.yaw_rate_radps / limits.yaw_rate_radps,
        )
