"""Parameters over MAVLink: read, list, set."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.sim.autopilot.link import Message

COPTER_PARAMETERS: dict[str, float] = {
    "SYSID_THISMAV": 1,
    "SYSID_MYGCS": 191,
    "AHRS_EKF_TYPE": 3,
    "EK2_ENABLE": 0,
    "EK3_ENABLE": 1,
    "EK3_SRC1_POSXY": 0,
    "EK3_SRC1_VELXY": 0,
    "EK3_SRC1_POSZ": 1,
    "EK3_SRC1_VELZ": 0,
    "EK3_SRC1_YAW": 1,
    "GPS_TYPE": 0,
    "VISO_TYPE": 0,
    "VISO_DELAY_MS": 10,
    "VISO_VEL_M_NSE": 0.1,
    "FLOW_TYPE": 0,
    "RNGFND1_TYPE": 20,
    "RNGFND1_ORIENT": 25,
    "PLND_ENABLED": 0,
    "ARMING_CHECK": 1,
    "DISARM_DELAY": 10,
    "FS_THR_ENABLE": 3,
    "FS_GCS_ENABLE": 5,
    "FS_GCS_TIMEOUT": 0.5,
    "FS_EKF_ACTION": 1,
    "FS_EKF_THRESH": 0.8,
    "RC_OPTIONS": 32,
    "BATT_LOW_VOLT": 9.9,
    "BATT_LOW_TIMER": 10,
    "BATT_FS_LOW_ACT": 1,
    "GUID_OPTIONS": 0,
    "GUID_TIMEOUT": 0.3,
    "WPNAV_SPEED_UP": 250,
    "WPNAV_SPEED_DN": 150,
    "WPNAV_ACCEL_Z": 250,
    "PSC_JERK_Z": 20,
    "LAND_SPEED": 90,
    "ANGLE_MAX": 3000,
    "MOT_THST_HOVER": 0.35,
    "MOT_HOVER_LEARN": 2,
}
"""ArduCopter 4.5's names and units, set up for flight without position."""


PX4_PARAMETERS: dict[str, float | int] = {
    "MAV_SYS_ID": 1,
    "MAV_FWDEXTSP": 1,
    "MPC_THR_HOVER": 0.5,
    "MPC_THR_MIN": 0.12,
    "MPC_MANTHR_MIN": 0.08,
    "MPC_LAND_SPEED": 0.7,
    "COM_OF_LOSS_T": 1.0,
    "COM_OBL_RC_ACT": 4,
    "COM_RCL_EXCEPT": 4,
    "COM_RC_OVERRIDE": 3,
    "COM_RC_IN_MODE": 1,
    "BAT1_N_CELLS": 3,
    "COM_DISARM_PRFLT": 10.0,
    "COM_DISARM_LAND": 2.0,
    "COM_ARM_WO_GPS": 1,
    "EKF2_GPS_CTRL": 0,
    "EKF2_EV_CTRL": 0,
    "EKF2_EV_DELAY": 0.0,
    "EKF2_EV_NOISE_MD": 0,
    "EKF2_HGT_REF": 0,
    "LNDMC_Z_VEL_MAX": 0.25,
    "BAT_LOW_THR": 0.15,
}
"""PX4 v1.15's names and units, set up for flight without position; whole numbers are INT32."""


class ParameterServer:
    """A table that answers PARAM_REQUEST_READ, PARAM_REQUEST_LIST and PARAM_SET.

    As on ArduPilot an unknown name is answered by silence, and a value that is not finite is not taken.
    With `bytewise` whole numbers travel as PX4 sends them: the four bytes of an INT32 in the float's place.
    """

    def __init__(self, values: Mapping[str, float | int], *, bytewise: bool = False) -> None:
        too_long = [name for name in values if len(name) > 16]
        if too_long:
            raise ValueError(f"parameter names longer than 16 characters: {too_long}")
        self._values: dict[str, float] = dict(values)
        self.locked: set[str] = set()
        """Parameters that answer a PARAM_SET with the value they keep."""
        self._whole = frozenset(name for name in values if bytewise and isinstance(values[name], int))

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def __setitem__(self, name: str, value: float) -> None:
        if name not in self._values:
            raise KeyError(name)
        self._values[name] = value

    def answer(self, message: Message, reply: Callable[[Message], None]) -> None:
        """Serve one PARAM_* message, sending what it asks for by `reply`."""
        kind = message.get_type()
        if kind == "PARAM_REQUEST_LIST":
            for name in self._values:
                reply(self._value(name))
            return
        if kind == "PARAM_REQUEST_READ" and message.param_index >= 0:
            names = list(self._values)
            if message.param_index < len(names):
                reply(self._value(names[message.param_index]))
            return
        name = str(message.param_id)
        if name not in self._values:
            return
        if kind == "PARAM_SET" and name not in self.locked:
            self._set(name, message.param_value)
        reply(self._value(name))

    def _set(self, name: str, value: float) -> None:
        if name in self._whole:
            self._values[name] = struct.unpack("<i", struct.pack("<f", value))[0]
        elif math.isfinite(value):
            self._values[name] = value

    def _value(self, name: str) -> Message:
        value, kind = self._values[name], dialect.MAV_PARAM_TYPE_REAL32
        if name in self._whole:
            value, kind = struct.unpack("<f", struct.pack("<i", value))[0], dialect.MAV_PARAM_TYPE_INT32
        return dialect.MAVLink_param_value_message(
            name.encode(),
            value,
            kind,
            len(self._values),
            list(self._values).index(name),
        )
