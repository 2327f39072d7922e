"""One drone as Foxglove is shown it: what its link tells, in Foxglove's schemas, on the station's clock."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, TypeAlias

from flightd.adapters.foxglove.cameras import calibration, cameras_on_drone
from flightd.adapters.foxglove.frames import Frames, drone_on_map, time_of
from flightd.adapters.foxglove.schemas import (
    CAMERA_CALIBRATION,
    FRAME_TRANSFORMS,
    POSE_IN_FRAME,
    SCENE_UPDATE,
    JsonObject,
)
from flightd.adapters.foxglove.warehouse import warehouse_scene
from flightd.adapters.ground_link.messages.floor import CameraOptics
from flightd.adapters.ground_link.messages.published import StatusReport
from flightd.core.preview import CameraName
from flightd.ground.messages import LinkPicture
from flightd.vision.jpeg import jpeg_size

_APART_NS = 2_000_000_000
"""A status that seems older than this is none that was long on its way: the clocks run apart, or one was
set."""


@dataclass(frozen=True, slots=True)
class Told:
    """A message: `fields` are all of the schema.  One that is `standing` holds until the next one, for those
    who come later, too."""

    topic: str
    schema: str
    fields: JsonObject
    stamp_ns: int
    standing: bool = False


@dataclass(frozen=True, slots=True)
class Pictured:
    """A JPEG picture."""

    topic: str
    frame: str
    jpeg: bytes
    stamp_ns: int


Message: TypeAlias = Told | Pictured

SCHEMAS: Mapping[str, str] = MappingProxyType(
    {
        "scene": SCENE_UPDATE,
        "camera_frames": FRAME_TRANSFORMS,
        "drone_frame": FRAME_TRANSFORMS,
        "pose": POSE_IN_FRAME,
        **{f"{camera}_camera/calibration": CAMERA_CALIBRATION for camera in CameraName},
    }
)
"""The topics of a drone besides its pictures, without its name, and what they are."""


class StationTime:
    """Turns a drone's stamps into this station's, by the status that was quickest on its way."""

    def __init__(self) -> None:
        self._behind_ns: int | None = None

    def heard(self, stamp_ns: int, received_ns: int) -> None:
        """Something just made, stamped by the drone, was received by the station's clock."""
        behind_ns = received_ns - stamp_ns
        if self._behind_ns is None or not 0 <= behind_ns - self._behind_ns <= _APART_NS:
            self._behind_ns = behind_ns

    def forget(self) -> None:
        """The drone has another clock from now on."""
        self._behind_ns = None

    def at(self, stamp_ns: int, received_ns: int) -> int:
        """A drone's stamp on the station's clock; when it was received, as long as nothing was heard."""
        return received_ns if self._behind_ns is None else stamp_ns + self._behind_ns


class DroneView:
    """Makes the messages of one drone."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._frames = Frames("map", f"{name}/drone", f"{name}/")
        self._time = StationTime()
        self._session = ""
        self._optics: dict[CameraName, CameraOptics] = {}
        self._sizes: dict[CameraName, tuple[int, int]] = {}

    def welcome(self, value: Mapping[str, Any], received_ns: int) -> Iterator[Told]:
        """The warehouse and the cameras: what stands for this flight."""
        if value["session"] != self._session:
            self._session = value["session"]
            self._time.forget()
            self._sizes.clear()
        floor = value["floor"]
        self._frames = Frames(f"{floor.name}/map", self._frames.drone, self._frames.of_cameras)
        self._optics = {optics.camera: optics for optics in value["optics"]}
        yield self._told("scene", warehouse_scene(floor, received_ns, self._frames), received_ns)
        mounted = cameras_on_drone(self._optics.values(), received_ns, self._frames)
        yield self._told("camera_frames", mounted, received_ns)
        for camera in self._optics:
            yield self._calibrated(camera, received_ns)

    def status(self, report: StatusReport, received_ns: int) -> Iterator[Told]:
        """Where it is; nothing before it knows that."""
        self._time.heard(report.stamp_ns, received_ns)
        at, vehicle = report.position, report.vehicle
        if at is None:
            return
        stamp_ns = self._time.at(report.stamp_ns, received_ns)
        leaning = (0.0, 0.0) if vehicle is None else (vehicle.roll_rad, vehicle.pitch_rad)
        place = at.x_m, at.y_m, report.height_m or 0.0
        frame = drone_on_map(stamp_ns, place, (*leaning, at.yaw_rad), self._frames)
        yield self._told("drone_frame", frame, stamp_ns, standing=False)
        (moved,) = frame["transforms"]
        pose = {
            "timestamp": time_of(stamp_ns),
            "frame_id": self._frames.map,
            "pose": {"position": moved["translation"], "orientation": moved["rotation"]},
        }
        yield self._told("pose", pose, stamp_ns, standing=False)

    def picture(self, camera: CameraName, shown: LinkPicture, received_ns: int) -> Iterator[Message]:
        """A picture; before it the lens at its size, where that is another one than the last picture's."""
        stamp_ns = self._time.at(shown.answer.stamp_ns, received_ns)
        size_px = jpeg_size(shown.jpeg)
        if size_px is not None and camera in self._optics and self._sizes.get(camera) != size_px:
            self._sizes[camera] = size_px
            yield self._calibrated(camera, stamp_ns)
        yield Pictured(image_topic(self._name, camera), self._frames.camera(camera), shown.jpeg, stamp_ns)

    def _calibrated(self, camera: CameraName, stamp_ns: int) -> Told:
        fields = calibration(self._optics[camera], stamp_ns, self._frames, self._sizes.get(camera))
        return self._told(f"{camera}_camera/calibration", fields, stamp_ns)

    def _told(self, topic: str, fields: JsonObject, stamp_ns: int, *, standing: bool = True) -> Told:
        return Told(f"/{self._name}/{topic}", SCHEMAS[topic], fields, stamp_ns, standing)


def image_topic(drone: str, camera: CameraName) -> str:
    """The topic of a camera's pictures."""
    return f"/{drone}/{camera}_camera/image"
