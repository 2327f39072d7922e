"""What can happen to a mission, most urgent first."""

from __future__ import annotations

import enum


class Trigger(enum.Enum):
    """Tried in this order: what keeps people safe stands first."""

    PILOT_TOOK = "the pilot took control"
    DOWN_TO_SWAP = "down on the pad for a fresh battery"
    DISARMED = "the vehicle disarmed"
    STOP = "stop ordered"
    TELEMETRY_LOST = "vehicle telemetry lost"
    HEIGHT_LOST = "height lost"
    BATTERY_CRITICAL = "battery critical"
    LAND_HERE = "landing ordered"
    GROUND_LOST = "ground link lost"
    LINES_LOST_LONG = "lines lost for too long"
    POSITION_UNKNOWN = "position not found again"
    TIMED_OUT = "the phase took too long"
    LINES_LOST = "lines lost"
    HOLD = "pause ordered"
    POSITION_DOUBTED = "position doubted"
    LINES_FOUND = "lines found"
    POSITION_SURE = "position sure again"
    FOUND_FLYING = "found flying"
    UNATTENDED = "nobody took over after the restart"
    READY = "ready"
    ARMED = "armed"
    AT_HEIGHT = "at flying height"
    ACQUIRED = "position acquired"
    ARRIVED = "arrived"
    SCAN_DUE = "locations to scan"
    AT_VIEW = "view reached"
    VIEW_DONE = "view scanned"
    DWELLED = "dwell over"
    TURNED = "turned"
    ROUTE_DONE = "route done"
