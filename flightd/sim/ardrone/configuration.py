"""The drone's configuration: keys, rights and profiles.

Common keys exist once.  Session, user and application keys have a default profile and any number of
custom ones; a custom profile is written only by a CONFIG right behind CONFIG_IDS naming the ids in force.
A write that is not allowed, or not of the key's type, changes nothing and is acknowledged like any other.
"""

from __future__ import annotations

import enum
import math
import re
from collections.abc import Callable
from dataclasses import dataclass

DEFAULT_ID = "00000000"
_ID = re.compile(r"[0-9a-f]{8}")


class Category(enum.Enum):
    COMMON = "common"
    SESSION = "session"
    USER = "profile"
    APPLICATION = "application"


@dataclass(frozen=True, slots=True)
class Ids:
    """What CONFIG_IDS names, in its order."""

    session: str = DEFAULT_ID
    user: str = DEFAULT_ID
    application: str = DEFAULT_ID

    def of(self, category: Category) -> str:
        named = {
            Category.SESSION: self.session,
            Category.USER: self.user,
            Category.APPLICATION: self.application,
        }
        return named.get(category, DEFAULT_ID)


@dataclass(frozen=True, slots=True)
class Key:
    """`writable` is the right in the default profile; custom profiles may always be written."""

    default: str
    kind: type[bool | int | float | str]
    category: Category = Category.COMMON
    writable: bool = True


def _limits() -> dict[str, Key]:
    triples = {"": (12.0, 700.0, 100.0), "indoor_": (12.0, 700.0, 100.0), "outdoor_": (20.0, 1000.0, 200.0)}
    keys: dict[str, Key] = {}
    for prefix, (tilt_deg, climb_mmps, yaw_degps) in triples.items():
        keys[f"control:{prefix}euler_angle_max"] = Key(f"{math.radians(tilt_deg):.6f}", float, Category.USER)
        keys[f"control:{prefix}control_vz_max"] = Key(f"{climb_mmps:.6f}", float, Category.USER)
        keys[f"control:{prefix}control_yaw"] = Key(f"{math.radians(yaw_degps):.6f}", float, Category.USER)
    return keys


KEYS: dict[str, Key] = {
    "general:num_version_soft": Key("2.4.8", str, writable=False),
    "general:navdata_demo": Key("FALSE", bool),
    "general:navdata_options": Key("65537", int),
    "general:com_watchdog": Key("2", int),
    "general:video_enable": Key("TRUE", bool),
    "general:vision_enable": Key("TRUE", bool),
    "general:vbat_min": Key("9000", int, writable=False),
    "general:flying_time": Key("0", int, writable=False),
    "control:control_level": Key("0", int, Category.APPLICATION),
    **_limits(),
    "control:altitude_max": Key("3000", int),
    "control:altitude_min": Key("50", int),
    "control:control_iphone_tilt": Key("0.349066", float, Category.USER),
    "control:outdoor": Key("FALSE", bool),
    "control:flight_without_shell": Key("FALSE", bool),
    "control:autonomous_flight": Key("FALSE", bool),
    "control:manual_trim": Key("FALSE", bool, Category.USER),
    "control:flying_mode": Key("0", int, Category.SESSION),
    "control:hovering_range": Key("1000", int, Category.SESSION),
    "control:flight_anim": Key("0,0", str),
    "pic:ultrasound_freq": Key("8", int),
    "video:codec_fps": Key("30", int, Category.SESSION, writable=False),
    "video:video_codec": Key("129", int, Category.SESSION, writable=False),
    "video:bitrate": Key("1000", int, Category.APPLICATION, writable=False),
    "video:max_bitrate": Key("1000", int, Category.SESSION, writable=False),
    "video:bitrate_ctrl_mode": Key("0", int, Category.APPLICATION, writable=False),
    "video:video_channel": Key("0", int, Category.SESSION),
    "video:video_on_usb": Key("TRUE", bool),
    "leds:leds_anim": Key("0,0,0", str),
    "detect:detect_type": Key("3", int, Category.SESSION),
    "network:ssid_single_player": Key("ardrone2", str),
    "network:owner_mac": Key("00:00:00:00:00:00", str),
    "network:wifi_mode": Key("0", int),
    "custom:session_id": Key(DEFAULT_ID, str),
    "custom:profile_id": Key(DEFAULT_ID, str),
    "custom:application_id": Key(DEFAULT_ID, str),
}

_ID_KEYS = {
    "custom:session_id": Category.SESSION,
    "custom:profile_id": Category.USER,
    "custom:application_id": Category.APPLICATION,
}

_CHECKS: dict[type, Callable[[str], bool]] = {
    bool: lambda text: text in ("TRUE", "FALSE"),
    int: lambda text: re.fullmatch(r"-?[0-9]{1,10}", text) is not None,
    float: lambda text: re.fullmatch(r"-?[0-9]{1,10}(\.[0-9]{0,12})?", text) is not None,
    str: lambda _text: True,
}


class Configuration:
    """The values in force, and who may change which."""

    def __init__(self) -> None:
        self._defaults = {name: key.default for name, key in KEYS.items()}
        self._custom: dict[tuple[Category, str], dict[str, str]] = {}

    @property
    def ids(self) -> Ids:
        """The profiles in force."""
        return Ids(*(self._defaults[f"custom:{name}_id"] for name in ("session", "profile", "application")))

    def write(self, name: str, value: str, ids: Ids | None) -> bool:
        """Write for the client that named `ids` right before (None: it named none); True if it took."""
        key = KEYS.get(name)
        if key is None or not _CHECKS[key.kind](value):
            return False
        if name in _ID_KEYS:
            return self._switch(name, value)
        own = self.ids.of(key.category)
        if ids == self.ids and own != DEFAULT_ID:
            self._custom.setdefault((key.category, own), {})[name] = value
        elif key.writable:
            self._defaults[name] = value
        else:
            return False
        if name == "control:outdoor":
            self._select_limits("outdoor_" if value == "TRUE" else "indoor_")
        return True

    def text(self, name: str) -> str:
        """The value in force."""
        key = KEYS[name]
        custom = self._custom.get((key.category, self.ids.of(key.category)), {})
        return custom.get(name, self._defaults[name])

    def number(self, name: str) -> float:
        return float(self.text(name))

    def flag(self, name: str) -> bool:
        return self.text(name) == "TRUE"

    def dump(self) -> bytes:
        """All values in force as the configuration port sends them, closed by a NUL byte."""
        lines = [f"{name} = {self.text(name)}\n" for name in KEYS]
        return "".join(lines).encode("ascii", "replace") + b"\0"

    def dump_ids(self) -> bytes:
        """The stored custom profiles."""
        parts: list[str] = []
        blocks = (
            ("applis", Category.APPLICATION),
            ("profiles", Category.USER),
            ("sessions", Category.SESSION),
        )
        for title, category in blocks:
            parts.append(f"[{title}]\n")
            parts += [f"{name},\n" for kind, name in self._custom if kind is category]
        return "".join(parts).encode("ascii") + b"\0"

    def _switch(self, name: str, value: str) -> bool:
        category = _ID_KEYS[name]
        if value.startswith("-"):
            for stored in [
                key for key in self._custom if key[0] is category and value in ("-all", f"-{key[1]}")
            ]:
                del self._custom[stored]
                if self._defaults[name] == stored[1]:
                    self._defaults[name] = DEFAULT_ID
            return True
        if _ID.fullmatch(value) is None:
            return False
        if value != DEFAULT_ID:
            self._custom.setdefault((category, value), {})
        self._defaults[name] = value
        return True

    def _select_limits(self, prefix: str) -> None:
        for limit in ("euler_angle_max", "control_vz_max", "control_yaw"):
            name = f"control:{limit}"
            chosen = self.text(f"control:{prefix}{limit}")
            own = self._custom.get((Category.USER, self.ids.user))
            if own is not None:
                own[name] = chosen
            self._defaults[name] = chosen
