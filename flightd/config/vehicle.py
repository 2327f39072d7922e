"""The vehicle's section of the configuration."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar, Literal, Self, TypeAlias

from pydantic import Field, model_validator

from flightd.config.section import Section

PoseChoice: TypeAlias = Literal["auto", "none", "odometry", "vision_position"]
_SPEAKING = frozenset({"ardupilot", "px4"})
"""Kinds that the adapter of our own speaks to."""
DEFAULT_ORIGIN_DEG = 51.4778, 0.0
"""Greenwich: a hall whose earth's field is another has to give its own."""
_STATIONS = frozenset({245, 255})
"""System ids by which ground stations and their libraries go."""


class VehicleConfig(Section):
    """The link to the autopilot, and what it is given besides setpoints."""

    files: ClassVar = ("signing_key", "signing_stamp")

    name: str = Field(
        "",
        max_length=80,
        description="the drone's name in flight logs and reports; empty: this computer's name",
    )
    kind: Literal["ardupilot", "px4", "ardrone", "mavsdk"] = Field(
        "ardupilot", description="which adapter flies"
    )
    url: str = Field(
        "udpin://127.0.0.1:14550", description="udpin://, udpout://, tcp://HOST:PORT or serial:///dev/X:BAUD"
    )
    system_id: int = Field(1, ge=1, le=255, description="MAVLink system id of the vehicle")
    own_system_id: int = Field(
        191,
        ge=1,
        le=255,
        description="ArduCopter: MAVLink system id of this computer's heartbeats, which nobody else may have:"
        " it lands when it does not hear them any more (its SYSID_MYGCS)",
    )
    flying_mode: Literal["guided_nogps", "guided"] = Field(
        "guided_nogps",
        description="ArduCopter: the mode to fly in; guided only where it estimates its position",
    )
    raw_thrust: bool | None = Field(
        None,
        description="ArduCopter: true: bit 3 of GUID_OPTIONS must be set, our own height loop flies; "
        "false: it must not be; left out: either, as the autopilot says",
    )
    signing_key: Path | None = Field(
        None, description="MAVLink 2 signing: the secret key file, from `flightd keygen`; none: unsigned"
    )
    signing_stamp: Path | None = Field(
        None, description="where the newest signing time stamp is kept; none: beside the key, as KEY.stamp"
    )
    pose_output: PoseChoice = Field(
        "auto",
        description="message that tells the autopilot's estimator of our motion, at 30 Hz at most, so that "
        "its attitude stays true; auto: odometry where an ArduCopter's or PX4's parameters take it",
    )
    origin_deg: tuple[
        Annotated[float, Field(ge=-90, le=90)],
        Annotated[float, Field(ge=-180, le=180)],
    ] = Field(
        DEFAULT_ORIGIN_DEG,
        description="ArduCopter in flying_mode guided that takes pose_output: the hall's latitude and "
        "longitude, roughly: its compass is held against the earth's field there before it arms",
    )
    range_finder: int | None = Field(
        None,
        ge=0,
        le=255,
        description="id of the DISTANCE_SENSOR to fly by; left out: of those that look down the one that "
        "measures best as the vehicle stands",
    )
    landing_target: bool = Field(
        False, description="tell the autopilot's precision landing where the home pad is, near it"
    )

    @model_validator(mode="after")
    def _only_what_the_adapter_can(self) -> Self:
        if "own_system_id" in self.model_fields_set and self.kind != "ardupilot":
            raise ValueError('own_system_id is for ArduCopter: take it out, or set kind = "ardupilot"')
        if self.own_system_id in _STATIONS:
            raise ValueError(
                f"own_system_id {self.own_system_id} is what ground stations have: one that is left running "
                "would keep the drone in the air when this computer dies; give another"
            )
        if self.kind == "ardupilot" and self.own_system_id == self.system_id:
            raise ValueError(
                f"own_system_id {self.own_system_id} is the vehicle's system_id: a gimbal or a bridge that "
                "has it, too, would keep the autopilot from landing when this computer dies; give another"
            )
        if self.kind != "ardupilot" and self.flying_mode != "guided_nogps":
            raise ValueError('flying_mode is ArduCopter\'s: take it out, or set kind = "ardupilot"')
        if self.kind != "ardupilot" and self.raw_thrust is not None:
            raise ValueError('raw_thrust is ArduCopter\'s: take it out, or set kind = "ardupilot"')
        speaks = self.kind in _SPEAKING
        for key, wanted in (
            ("signing_key", self.signing_key is not None),
            ("pose_output", self.pose_output not in {"auto", "none"}),
            ("range_finder", self.range_finder is not None),
        ):
            if wanted and not speaks:
                raise ValueError(f'{key} needs kind = "ardupilot" or "px4", not "{self.kind}"')
        if self.signing_stamp is not None and self.signing_key is None:
            raise ValueError("signing_stamp without signing_key: give the key too, or take it out")
        if self.landing_target and self.pose_output in {"auto", "none"}:
            raise ValueError(
                'landing_target needs pose_output = "odometry": precision landing flies by the autopilot\'s '
                "own position, which must not be left to its parameters"
            )
        return self

    @property
    def shares_pose(self) -> bool:
        """Whether it is told of our motion, if its parameters take it."""
        return self.pose_output != "none" and self.kind in _SPEAKING

    @property
    def sends_default_origin(self) -> bool:
        """Whether an autopilot that takes our motion is told an origin, and not one of the hall's."""
        guided = self.flying_mode == "guided" and self.shares_pose
        return guided and self.origin_deg == DEFAULT_ORIGIN_DEG

    @property
    def stamp_file(self) -> Path | None:
        """Where the signing time stamp is kept; None on an unsigned link."""
        if self.signing_key is None:
            return None
        return self.signing_stamp or self.signing_key.with_name(f"{self.signing_key.name}.stamp")
