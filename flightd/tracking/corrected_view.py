"""Lens, mount and attitude by what the floor's filter has learnt of them.  Pure."""

from __future__ import annotations

from flightd.core.geometry import Lens, Mount
from flightd.core.types import Attitude
from flightd.tracking.floor_filter import FloorFilter
from flightd.tracking.motion_model import MOUNT_PITCH, MOUNT_ROLL, MOUNT_YAW, PITCH, ROLL, SCALE


def corrected_lens(lens: Lens, held: FloorFilter) -> Lens:
    """The camera's lens."""
    return lens.longer_by(1.0 / (1.0 + held.mean(SCALE)))


def corrected_attitude(told: Attitude, held: FloorFilter) -> Attitude:
    """The attitude; its yaw stays the vehicle's own."""
    return told.leant_by(held.mean(ROLL), held.mean(PITCH))


def corrected_mount(mount: Mount, held: FloorFilter) -> Mount:
    """The camera's mount."""
    return Mount(
        mount.yaw_rad + held.mean(MOUNT_YAW),
        mount.offset_m,
        mount.roll_rad + held.mean(MOUNT_ROLL),
        mount.pitch_rad + held.mean(MOUNT_PITCH),
    )
