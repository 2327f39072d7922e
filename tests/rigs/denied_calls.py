"""System calls that a service's limits forbid, denied to this process and its children as systemd denies
them: by a filter in the kernel, for ever."""

from __future__ import annotations

import ctypes
import errno
import platform
import struct

_NUMBERS = {
    "x86_64": {"setpriority": 141, "adjtimex": 159, "clock_adjtime": 305},
    "aarch64": {"setpriority": 140, "adjtimex": 171, "clock_adjtime": 266},
}
_NO_NEW_PRIVILEGES, _SET_SECCOMP, _FILTER = 38, 22, 2
_LOAD_NUMBER, _SKIP_UNLESS_EQUAL, _RETURN = 0x20, 0x15, 0x06
_ALLOW, _FAIL = 0x7FFF0000, 0x00050000


def is_known() -> bool:
    """Whether this machine's numbers of the calls are."""
    return platform.machine() in _NUMBERS


def deny(call: str) -> None:
    """From now on this call, and what the C library makes of it, fails with EPERM."""
    steps = (
        (_LOAD_NUMBER, 0, 0, 0),
        (_SKIP_UNLESS_EQUAL, 0, 1, _NUMBERS[platform.machine()][call]),
        (_RETURN, 0, 0, _FAIL | errno.EPERM),
        (_RETURN, 0, 0, _ALLOW),
    )
    code = ctypes.create_string_buffer(b"".join(struct.pack("HBBI", *step) for step in steps))
    program = struct.pack("HxxxxxxP", len(steps), ctypes.addressof(code))
    system = ctypes.CDLL(None, use_errno=True)
    for words in ((_NO_NEW_PRIVILEGES, 1, 0, 0, 0), (_SET_SECCOMP, _FILTER, ctypes.c_char_p(program), 0, 0)):
        if system.prctl(*words) != 0:
            raise OSError(ctypes.get_errno(), "prctl")
