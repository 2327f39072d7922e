"""What is asked and answered to look after a drone on the ground: its checks and its settings."""

from __future__ import annotations

from typing import Annotated, Any, TypeAlias

import msgspec
from msgspec import Meta

from flightd.adapters.ground_link.messages.base import ClientRequest, DaemonAnswer
from flightd.core.paint import PROFILE_NAME
from flightd.core.preview import CameraName

MOST_PROFILE_BYTES = 16384
"""Of a colour profile that is sent; a trained one has some 2,500."""

_Person = Annotated[str, Meta(max_length=64, description="who asks, for audit log and versions")]


Value: TypeAlias = (
    bool
    | int
    | float
    | Annotated[str, Meta(max_length=200)]
    | Annotated[tuple[bool | int | float | Annotated[str, Meta(max_length=200)], ...], Meta(max_length=200)]
    | None
)
"""A configuration key's value; null: left out, its default holds."""


class AskDoctor(ClientRequest, frozen=True, tag="doctor"):
    """What the drone finds of itself beside its running daemon; operators only, while it stands on the
    ground.  Answer: `doctor`."""


class FixParameter(ClientRequest, frozen=True, tag="fix"):
    """Write the better value of an autopilot's parameter that `doctor` told of, and read it back; operators
    only, while it stands disarmed.  Answer: `doctor`, looked at anew."""

    name: Annotated[str, Meta(min_length=1, max_length=32, description="of the parameter")]
    person: _Person = ""


class AskSettings(ClientRequest, frozen=True, tag="settings"):
    """The configuration as it stands, with what each key means; operators only, while it stands on the
    ground.  Answer: `settings`."""


class ProposeSettings(ClientRequest, frozen=True, tag="propose"):
    """Change keys of the configuration's file; operators only, while it stands disarmed.  The drone checks it
    as a whole, with its site, before it writes.  Answer: `settings`, as they stand then."""

    base: Annotated[str, Meta(max_length=64, description="`tag` of the `settings` that the person saw")]
    changes: Annotated[
        dict[Annotated[str, Meta(max_length=80)], Value],
        Meta(max_length=64, description='by key, as "mission.height_m"; null: leave it out'),
    ]
    person: _Person = ""


class TakeSettingsBack(ClientRequest, frozen=True, tag="take_back"):
    """Bring a kept version of the configuration back: a proposal like any other.  Answer: `settings`."""

    base: Annotated[str, Meta(max_length=64, description="`tag` of the `settings` that the person saw")]
    version_kept: Annotated[int, Meta(ge=1, le=10**9, description="`number` of a kept version")]
    person: _Person = ""


class InstallProfile(ClientRequest, frozen=True, tag="install_profile"):
    """Lay a colour profile beside the configuration's file and have `vision.profile` name it: a change of
    settings like any other; operators only, while it stands disarmed.  Answer: `settings`, as they stand
    then."""

    base: Annotated[str, Meta(max_length=64, description="`tag` of the `settings` that the person saw")]
    name: Annotated[
        str,
        Meta(
            max_length=40,
            pattern=rf"^{PROFILE_NAME}\Z",
            description="of the profile: small letters, digits and hyphens",
        ),
    ]
    content: Annotated[
        bytes,
        Meta(max_length=MOST_PROFILE_BYTES, description="of the profile's file, in base64; 16 KiB at most"),
    ]
    file_hash: Annotated[str, Meta(max_length=64, description="SHA-256 of the file, in hexadecimal digits")]
    person: _Person = ""


class Restart(ClientRequest, frozen=True, tag="restart"):
    """End the daemon so that systemd starts it anew, by its changed settings; operators only, while it stands
    disarmed.  Answer: `accepted`."""

    person: _Person = ""


Maintenance: TypeAlias = (
    AskDoctor | FixParameter | AskSettings | ProposeSettings | TakeSettingsBack | InstallProfile | Restart
)
"""What looks after a drone on the ground."""


class CheckReport(msgspec.Struct, frozen=True):
    """One thing that was looked at."""

    name: Annotated[str, Meta(description="what was looked at")]
    level: Annotated[str, Meta(description="ok, warning, error, or unseen: only without the daemon")]
    text: Annotated[str, Meta(description="what was found")]
    remedy: Annotated[str, Meta(description="what a person can do about it, else empty")] = ""
    fix: Annotated[str, Meta(description="name for `fix`, where the drone can mend it itself")] = ""


class ExposureReport(msgspec.Struct, frozen=True):
    """How a camera is set to expose, and how it was read back; the doctor's checks say what that means."""

    camera: Annotated[CameraName, Meta(description="which camera's")]
    section: Annotated[str, Meta(description="of the configuration, with its keys")]
    refused: Annotated[str, Meta(description="why flightd cannot set this camera, else empty")]
    set_exposure_s: Annotated[float | None, Meta(description="exposure it was set to, s; null: left to it")]
    set_gain: Annotated[float | None, Meta(description="gain it was set to; null: left to it")]
    set_anti_flicker_hz: Annotated[int, Meta(description="mains it was set to, Hz; 0: left to it")]
    manual: Annotated[bool | None, Meta(description="read back: by hand, not automatic; null: not told")]
    exposure_s: Annotated[float | None, Meta(description="read back, s; null: not told")]
    gain: Annotated[float | None, Meta(description="read back, the camera's own number; null: not told")]
    anti_flicker_hz: Annotated[int | None, Meta(description="read back, Hz, 0: off; null: not told")]
    blur_px: Annotated[
        float | None,
        Meta(
            description="of the floor at `mission.speed_mps` from `mission.height_m`, px; null: the exposure "
            "is not known, or it looks elsewhere"
        ),
    ]


class DoctorAnswer(DaemonAnswer, frozen=True, tag="doctor"):
    """What the drone finds of itself."""

    fit: Annotated[bool, Meta(description="no error among the checks")]
    checks: Annotated[tuple[CheckReport, ...], Meta(description="one by one")]
    versions: Annotated[dict[str, str], Meta(description="program, firmware, Python, libraries")]
    log: Annotated[tuple[str, ...], Meta(description="the daemon's newest log lines, oldest first")]
    outcome: Annotated[str, Meta(description="after `fix`: what was written and read back")] = ""
    exposures: Annotated[
        tuple[ExposureReport, ...], Meta(description="of the cameras that are fitted, the down camera first")
    ] = ()


class KeyReport(msgspec.Struct, frozen=True):
    """A key of the configuration: what it takes, and what it means."""

    section: Annotated[str, Meta(description="its table in the file")]
    key: Annotated[str, Meta(description="its name there")]
    type: Annotated[str, Meta(description="what it takes, in words of the file's format")]
    unit: Annotated[str, Meta(description="of its numbers, else empty")]
    range: Annotated[str, Meta(description="values that are taken, else empty")]
    default: Annotated[str, Meta(description='as the file writes it; "required": there is none')]
    text: Annotated[str, Meta(description="what it means")]
    fixed: Annotated[str, Meta(description="why no ground station can change it, else empty")]


class KeyChange(msgspec.Struct, frozen=True):
    """A key before and after a change."""

    key: Annotated[str, Meta(description="section and name")]
    before: Annotated[Value, Meta(description="null: left out")]
    after: Annotated[Value, Meta(description="null: left out")]


class KeptVersion(msgspec.Struct, frozen=True):
    """The configuration as it stood before a change, and the change."""

    number: Annotated[int, Meta(description="for `take_back`; counts from 1")]
    utc: Annotated[str, Meta(description="when it was changed, UTC")]
    client: Annotated[str, Meta(description="whose key changed it")]
    person: Annotated[str, Meta(description="who, as he said")]
    changes: Annotated[tuple[KeyChange, ...], Meta(description="what was changed then")]


class SettingsAnswer(DaemonAnswer, frozen=True, tag="settings"):
    """The configuration's file as it stands."""

    file: Annotated[str, Meta(description="its path on the drone")]
    tag: Annotated[str, Meta(description="names these contents; give it with a proposal")]
    table: Annotated[dict[str, Any], Meta(description="what the file gives; the rest has its default")]
    keys: Annotated[tuple[KeyReport, ...], Meta(description="every key, in the order of the sections")]
    sections: Annotated[dict[str, str], Meta(description="what each section is")]
    versions: Annotated[tuple[KeptVersion, ...], Meta(description="kept versions, newest first")]
    pending: Annotated[bool, Meta(description="the file is not what the daemon runs by: at its next start")]
    locked: Annotated[str, Meta(description="why nothing can be changed from the ground, else empty")]
    restarts: Annotated[bool, Meta(description="`restart` works: systemd starts the daemon anew")]
