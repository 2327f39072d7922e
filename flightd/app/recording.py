"""What a flight was flown by, into its log and out again, so that the flight can be replayed."""

from __future__ import annotations

from dataclasses import dataclass

from flightd.adapters.foxglove.cameras import calibration, cameras_on_drone
from flightd.adapters.foxglove.frames import IN_LOG
from flightd.adapters.foxglove.schemas import (
    CAMERA_CALIBRATION,
    FRAME_TRANSFORMS,
    SCENE_UPDATE,
    WellKnown,
)
from flightd.adapters.foxglove.warehouse import warehouse_scene
from flightd.adapters.ground_link.camera_optics import camera_optics
from flightd.adapters.ground_link.floor_status import floor_status
from flightd.app.flight_orders import configured_order
from flightd.config.schema import Config
from flightd.core.flight_order import FlightOrder
from flightd.core.learnt import LearntSensors
from flightd.core.preview import CameraName
from flightd.core.topics import Document, Topic
from flightd.ports import Recorder
from flightd.replay.flown_by import FLOWN_BY, flown_config, flown_site
from flightd.replay.log import FlightLog
from flightd.site.site import Site
from flightd.site.site_file import site_toml

_CALIBRATIONS = {CameraName.DOWN: Topic.DOWN_CALIBRATION, CameraName.FRONT: Topic.FRONT_CALIBRATION}
SETTING_TOPICS = FLOWN_BY | {Topic.ORDER, Topic.LEARNT}


@dataclass(frozen=True, slots=True)
class FlightSetting:
    """All that a pilot is made of."""

    config: Config
    site: Site
    order: FlightOrder
    learnt: LearntSensors | None = None


def record_setting(recorder: Recorder, now_ns: int, setting: FlightSetting) -> None:
    """Keep what a flight is flown by."""
    recorder.record(Topic.MAP, now_ns, Document(site_toml(setting.site)))
    recorder.record(Topic.CONFIG, now_ns, Document(setting.config.model_dump_json(indent=1)))
    recorder.record(Topic.ORDER, now_ns, setting.order)
    if setting.learnt is not None:
        recorder.record(Topic.LEARNT, now_ns, setting.learnt)
    _record_for_viewers(recorder, now_ns, setting)


def _record_for_viewers(recorder: Recorder, now_ns: int, setting: FlightSetting) -> None:
    """The warehouse and the cameras, as Foxglove draws them; nothing here reads them again."""
    optics = camera_optics(setting.config)
    scene = warehouse_scene(floor_status(setting.site), now_ns, IN_LOG)
    recorder.record(Topic.SCENE, now_ns, WellKnown(SCENE_UPDATE, scene))
    cameras = cameras_on_drone(optics, now_ns, IN_LOG)
    recorder.record(Topic.CAMERA_FRAMES, now_ns, WellKnown(FRAME_TRANSFORMS, cameras))
    for camera in optics:
        message = WellKnown(CAMERA_CALIBRATION, calibration(camera, now_ns, IN_LOG))
        recorder.record(_CALIBRATIONS[camera.camera], now_ns, message)


def recorded_setting(log: FlightLog) -> FlightSetting:
    """What a recorded flight was flown by; the log holds SETTING_TOPICS.  A log without an order is of a
    time when the configuration was recorded with the order laid over it.  InputError for a log without
    configuration or map."""
    config, site = flown_config(log), flown_site(log)
    orders, learnt = log.messages(FlightOrder), log.messages(LearntSensors)
    order = orders[-1] if orders else configured_order(config)
    return FlightSetting(config, site, order, learnt[-1] if learnt else None)
