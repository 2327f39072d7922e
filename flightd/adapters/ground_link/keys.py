"""CURVE keys in files, and the list of the clients that may come in.

Key files are those of ZMQ's own tools (`NAME.key`, `NAME.key_secret`).  The allow-list holds a line
`ROLE PUBLIC-KEY NAME` for each client; lines that begin with "# " are comments (a key may hold a "#").
They are read by `zmq.auth`.  Own code writes them: pyzmq 27.3's `create_certificates` leaves the secret
readable for everybody (mode 0644 at the usual umask) and writes over a key that is there already.
"""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import zmq
import zmq.auth
from zmq.utils import z85

from flightd.adapters.ground_link.messages.base import Role
from flightd.core.errors import InputError

_NAME = re.compile(r"[A-Za-z0-9._-]{1,48}")


@dataclass(frozen=True, slots=True)
class KeyPair:
    """A CURVE25519 key pair, each half 40 characters of Z85."""

    public: str
    secret: str


@dataclass(frozen=True, slots=True)
class Client:
    """Who is behind a key."""

    name: str
    role: Role


def make_keys(folder: Path, name: str) -> tuple[Path, Path]:
    """Write a new pair as `name.key` and `name.key_secret` (mode 0600) and give the two paths.

    InputError for a bad name, files that are there already and folders that cannot be written."""
    if not _NAME.fullmatch(name):
        raise InputError(f"key name {name!r}: use up to 48 letters, digits, dots, dashes and underscores")
    public, secret = (half.decode() for half in zmq.curve_keypair())
    paths = folder / f"{name}.key", folder / f"{name}.key_secret"
    halves = f'    public-key = "{public}"\n', f'    public-key = "{public}"\n    secret-key = "{secret}"\n'
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path in paths:
            if path.exists():
                raise InputError(f"{path}: there already; choose another name, or delete it first")
        for path, half, mode in zip(paths, halves, (0o644, 0o600), strict=True):
            handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
            with os.fdopen(handle, "w", encoding="ascii") as file:
                file.write(f'metadata\n    name = "{name}"\ncurve\n{half}')
    except OSError as err:
        raise InputError(f"{folder}: cannot write the keys: {err.strerror}") from None
    return paths


def load_public(path: Path) -> str:
    """The public half in a key file.  InputError if there is none."""
    return _load(path)[0]


def load_pair(path: Path) -> KeyPair:
    """Both halves from a secret key file.  InputError if it is missing, is not one, or others can read it."""
    public, secret = _load(path)
    if secret is None:
        raise InputError(f"{path}: holds no secret key; give the file that ends in .key_secret")
    if path.stat().st_mode & 0o077:
        raise InputError(f"{path}: others can read this secret key; chmod 600 it")
    return KeyPair(public, secret)


def load_clients(path: Path) -> Mapping[str, Client]:
    """The allow-list: public key -> who it is.  InputError naming the line that is wrong."""
    try:
        lines = path.read_text(encoding="ascii").splitlines()
    except OSError as err:
        raise InputError(f"{path}: cannot read the list of clients: {err.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: not plain text: expected lines of ROLE PUBLIC-KEY NAME") from None
    clients: dict[str, Client] = {}
    for number, line in enumerate(lines, start=1):
        if not line.strip() or line.startswith("# "):
            continue
        words = line.split()
        where = f"{path}:{number}"
        if len(words) != 3:
            raise InputError(f"{where}: expected ROLE PUBLIC-KEY NAME, as `flightctl keygen` prints it")
        role, key, name = words
        if role not in set(Role):
            raise InputError(f"{where}: role {role!r}: expected {' or '.join(Role)}")
        if not _is_key(key):
            raise InputError(f"{where}: {key!r} is not a public key: 40 characters, from NAME.key")
        if not _NAME.fullmatch(name):
            raise InputError(f"{where}: client name {name!r}: use letters, digits, dots, dashes, underscores")
        if key in clients or any(client.name == name for client in clients.values()):
            raise InputError(f"{where}: {name}: key or name is in the list already")
        clients[key] = Client(name, Role(role))
    if not clients:
        raise InputError(f"{path}: lists no client; add the line that `flightctl keygen` prints")
    return clients


def _load(path: Path) -> tuple[str, str | None]:
    try:
        public, secret = zmq.auth.load_certificate(path)
    except OSError as err:
        raise InputError(f"{path}: cannot read the key: {err.strerror or 'no such file'}") from None
    except ValueError:
        raise InputError(f"{path}: holds no key; make one with `flightctl keygen`") from None
    halves = [half.decode(errors="replace") for half in (public, secret) if half is not None]
    if not all(map(_is_key, halves)):
        raise InputError(f"{path}: the key in it is damaged; make a new one with `flightctl keygen`")
    return halves[0], halves[1] if len(halves) > 1 else None


def _is_key(text: str) -> bool:
    """40 characters of Z85 that stand for 32 bytes."""
    if len(text) != 40 or not text.isascii():
        return False
    try:
        return len(z85.decode(text)) == 32
    except (KeyError, ValueError, struct.error):
        return False
