"""Passwords by argon2id, and keys of programs: neither is kept as it is.

A password is slow to try by design (64 MiB and three passes, RFC 9106's second choice).  A key is 256 random
bits, which nobody guesses: a quick hash is enough, and each request of a program has to pass it.
"""

from __future__ import annotations

import hashlib
import secrets
import unicodedata

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError

from flightd.core.errors import InputError

LEAST_CHARS, MOST_CHARS = 10, 200
KEY_PREFIX = "flightd_"
"""So that whoever finds a key in a file knows what it opens."""

_hasher = PasswordHasher()


def hashed_password(password: str, name: str) -> str:
    """The hash of a new password of `name`.  InputError for one that is soon guessed.  Slow."""
    plain = _plain(password)
    if not LEAST_CHARS <= len(plain) <= MOST_CHARS:
        raise InputError(f"a password has {LEAST_CHARS} to {MOST_CHARS} characters")
    if plain.casefold() in {name.casefold() * times for times in range(1, 8)} or len(set(plain)) < 4:
        raise InputError("this password is soon guessed", remedy="take several words without a bond")
    return _hasher.hash(plain)


class PasswordCheck:
    """Whether a password is right; where there is none it takes as long as where there is.  Slow, and of any
    thread."""

    def __init__(self) -> None:
        self._nobody = _hasher.hash(secrets.token_hex())

    def fits(self, password: str, kept: str) -> bool:
        """`kept` is the hash; empty where nobody has that name, or only a key."""
        try:
            return _hasher.verify(kept or self._nobody, _plain(password)) and bool(kept)
        except (VerificationError, InvalidHashError):
            return False


def new_key() -> str:
    """A key for a program, to be shown once."""
    return KEY_PREFIX + secrets.token_urlsafe(32)


def hashed_secret(secret: str) -> bytes:
    """What is kept of a key, or of a session's id."""
    return hashlib.sha256(secret.encode("utf-8", "surrogateescape")).digest()


def _plain(password: str) -> str:
    """The same however a keyboard composes its letters."""
    return unicodedata.normalize("NFKC", password)
