"""MAVLink 2 signing: the key, and a time stamp that never goes back, not even over a restart."""

from __future__ import annotations

import contextlib
import logging
import os
import secrets
import tempfile
import threading
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.core.errors import InputError
from flightd.ports import Clock
from flightd.runtime.durable_files import replace_file

_LOG = logging.getLogger(__name__)
KEY_BYTES = 32

_EPOCH_UNIX_S = 1_420_070_400
"""2015-01-01 UTC."""
_NS_PER_UNIT = 10_000
_RESERVE = 30 * 100_000
"""Half a minute of time stamps is claimed on disk in advance, so a crash cannot bring one back.  No more: an
autopilot that is a minute behind us is not believed, and each restart begins at what was claimed."""
_RENEW = _RESERVE // 2
"""So much ahead of the claim's end a new one is written, aside: a disk may take its time."""


def read_key(path: Path) -> bytes:
    """The 32 secret bytes in a file of 64 hex digits (or 32 raw bytes) that only its owner may read."""
    try:
        data = path.read_bytes()
        mode = path.stat().st_mode
    except OSError as err:
        raise InputError(f"signing key {path}: {err.strerror}: make one with flightd keygen") from err
    if mode & 0o077:
        raise InputError(f"signing key {path} can be read by others: chmod 600 {path}")
    if len(data) != KEY_BYTES:
        try:
            data = bytes.fromhex(data.decode("ascii").strip())
        except ValueError:
            data = b""
    if len(data) != KEY_BYTES:
        raise InputError(f"signing key {path} is not 64 hex digits or 32 bytes: make one with flightd keygen")
    return data


def make_key(path: Path) -> None:
    """Write 32 new secret bytes as 64 hex digits to a new file of mode 0600.

    InputError when the file is there already or cannot be written."""
    try:
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(handle, "w", encoding="ascii") as file:
            file.write(f"{secrets.token_hex(KEY_BYTES)}\n")
    except FileExistsError:
        raise InputError(f"{path}: there already; choose another name, or delete it first") from None
    except OSError as err:
        raise InputError(f"{path}: cannot write the key: {err.strerror}") from None


def setup_message(system_id: int, key: bytes, unix_time_s: float) -> Any:
    """SETUP_SIGNING for the autopilot, its time stamps to begin now."""
    component = dialect.MAV_COMP_ID_AUTOPILOT1
    return dialect.MAVLink_setup_signing_message(system_id, component, list(key), signing_time(unix_time_s))


def signing_time(unix_time_s: float) -> int:
    """The time stamp of a moment; 0 for one before signing was invented (a computer without its clock)."""
    return max(round((unix_time_s - _EPOCH_UNIX_S) * 1e5), 0)


class Signing:
    """Signs what a codec packs and checks what it decodes, with one key on one link.

    The time stamp (10 us units since 2015) follows the clock from `unix_time_s` at the start, but starts
    no lower than the one kept in `state`; unsigned frames are refused, those of a radio modem excepted.
    """

    def __init__(
        self, key: bytes, clock: Clock, unix_time_s: float, state: Path | None = None, link_id: int = 0
    ) -> None:
        if len(key) != KEY_BYTES:
            raise ValueError(f"a signing key has {KEY_BYTES} bytes, not {len(key)}")
        self._key = key
        self._clock = clock
        self._state = state
        self._link_id = link_id
        self._start_ns = clock.now_ns()
        self._start = max(signing_time(unix_time_s), _kept(state))
        self._claimed = 0
        self._writer: threading.Thread | None = None
        self._refused_told = False
        self.refused = 0

    def attach(self, mav: Any) -> None:
        """Switch a pymavlink codec to signing."""
        mav.signing.secret_key = self._key
        mav.signing.link_id = self._link_id
        mav.signing.sign_outgoing = True
        mav.signing.allow_unsigned_callback = _radio_only
        self.before_pack(mav)

    def before_pack(self, mav: Any) -> None:
        """Let the time stamp follow the clock; pymavlink itself only counts the frames."""
        elapsed = (self._clock.now_ns() - self._start_ns) // _NS_PER_UNIT
        mav.signing.timestamp = max(mav.signing.timestamp, self._start + elapsed)
        self._claim(mav.signing.timestamp)

    def _claim(self, timestamp: int) -> None:
        """Have time stamps beyond this one on the disk before they are used."""
        ahead = self._claimed - timestamp
        if ahead > _RENEW or (self._writer is not None and self._writer.is_alive()):
            return
        self._claimed = timestamp + _RESERVE
        if ahead < 1:
            self._keep(self._claimed)
            return
        place = (self._claimed,)
        self._writer = threading.Thread(target=self._keep, args=place, name="signing time stamp", daemon=True)
        self._writer.start()

    def _keep(self, timestamp: int) -> None:
        """On the disk before this returns.  One that refuses does not stop the flight: it is told once, until
        it takes the time stamp again."""
        if self._state is None:
            return
        try:
            _replace(self._state, str(timestamp))
        except OSError as err:
            if not self._refused_told:
                self._refused_told = True
                _LOG.warning(
                    "vehicle.signing_stamp %s cannot be written: %s; started anew while its clock is wrong,"
                    " the autopilot would not believe this computer",
                    self._state,
                    err.strerror or err,
                )
        else:
            self._refused_told = False

    def decode(self, mav: Any, frame: bytearray) -> Any | None:
        """The message, or None when signature or checksum is wrong.

        pymavlink remembers a frame's time stamp before it has checked the signature: one forged frame
        from the future would lock the true sender out.  Here a refused frame leaves no trace.
        """
        stamps = mav.signing.stream_timestamps
        signed = frame[0] == dialect.PROTOCOL_MARKER_V2 and frame[2] & dialect.MAVLINK_IFLAG_SIGNED
        stream = (frame[-13], frame[5], frame[6]) if signed else None
        before = stamps.get(stream)
        message = None
        try:
            message = mav.decode(frame)
        except dialect.MAVError:
            self.refused += 1
        if message is None or not message.get_signed():  # a modem's frame passes with any signature
            if before is not None:
                stamps[stream] = before
            else:
                stamps.pop(stream, None)
        return message


def _radio_only(_mav: Any, message_id: int) -> bool:
    return message_id == int(dialect.MAVLINK_MSG_ID_RADIO_STATUS)


def _kept(state: Path | None) -> int:
    if state is None:
        return 0
    try:
        return int(state.read_text(encoding="ascii"))
    except FileNotFoundError:
        return 0
    except (OSError, ValueError) as err:
        raise InputError(f"signing time stamp {state}: {err}: remove the file if the clock is right") from err


def _replace(state: Path, text: str) -> None:
    """The file as a whole, on the disk before this returns.  OSError when that refuses."""
    fd, name = tempfile.mkstemp(dir=state.parent, prefix=state.name)
    try:
        os.close(fd)
        replace_file(state, Path(name), text.encode("ascii"))
    except OSError:
        with contextlib.suppress(OSError):  # it may have been moved already
            Path(name).unlink()  # else a full disk gathers one each half minute
        raise
