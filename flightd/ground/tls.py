"""The station's own certificate, looked at before it serves anybody: one clear line for wrong files."""

from __future__ import annotations

import ssl
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from flightd.core.errors import InputError

CERT, KEY = "--tls-cert", "--tls-key"
_FLIGHTS = 8
_WHY = {
    "KEY_VALUES_MISMATCH": (KEY, "does not belong to the certificate"),
    "NO_START_LINE": ("", "is no PEM file"),
    "PEM_LIB": ("", "is no PEM file, or does not fit the other one"),
    "EE_KEY_TOO_SMALL": (CERT, "its key is too short"),
    "CA_MD_TOO_WEAK": (CERT, "is signed with a hash that is broken"),
}


@dataclass(frozen=True, slots=True)
class Certificate:
    """Two PEM files that fit each other; `names` are the DNS names that browsers take it for."""

    cert: Path
    key: Path
    names: tuple[str, ...]


def read_certificate(cert: Path | None, key: Path | None) -> Certificate | None:
    """None where neither is given.  InputError for one without the other, files that cannot be read, are
    none, do not fit each other, or whose certificate is out of date."""
    if cert is None and key is None:
        return None
    if cert is None or key is None:
        raise InputError("belong together", key=f"{CERT}, {KEY}")
    for option, file in ((CERT, cert), (KEY, key)):
        try:
            file.read_bytes()
        except OSError as err:
            raise InputError(f"cannot be read: {err.strerror}", key=f"{option} {file}") from None
    if key.stat().st_mode & stat.S_IRWXO:
        raise InputError(
            "everybody on this machine can read it", key=f"{KEY} {key}", remedy=f"chmod o= {key}"
        )
    _read(cert, key)
    return Certificate(cert, key, _names(cert, key))


def _read(cert: Path, key: Path) -> ssl.SSLContext:
    def ask() -> NoReturn:
        raise InputError("is locked by a passphrase", key=f"{KEY} {key}", remedy="give one without")

    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        context.load_cert_chain(cert, key, ask)
    except ssl.SSLError as err:
        reason = err.reason or ("PEM_LIB" if "PEM lib" in str(err) else "")
        option, why = _WHY.get(reason, ("", f"cannot be used: {err.reason or err}"))
        files = {CERT: cert, KEY: key}
        option = option or _culprit(cert, key)
        where = f"{option} {files[option]}" if option else f"{CERT} {cert}, {KEY} {key}"
        raise InputError(why, key=where) from None
    return context


def _culprit(cert: Path, key: Path) -> str:
    """The option of the file that has not what it should have in it; empty where both look right."""
    if b"-----BEGIN CERTIFICATE-----" not in cert.read_bytes():
        return CERT
    if b"PRIVATE KEY-----" not in key.read_bytes():
        return KEY
    return ""


def _names(cert: Path, key: Path) -> tuple[str, ...]:
    """The DNS names in it, as a client reads them that trusts this certificate and no other: the handshake is
    played through in memory, which looks at the dates and the purpose, too."""
    client_context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    client_context.check_hostname = False
    client_context.verify_flags |= ssl.VERIFY_X509_PARTIAL_CHAIN
    try:
        client_context.load_verify_locations(cert)
        to_client, to_server = ssl.MemoryBIO(), ssl.MemoryBIO()
        client = client_context.wrap_bio(to_client, to_server)
        server = _read(cert, key).wrap_bio(to_server, to_client, server_side=True)
        for _ in range(_FLIGHTS):
            done = [_goes_on(side) for side in (client, server)]
            if all(done):
                break
    except ssl.SSLCertVerificationError as err:
        why = err.verify_message or "no browser would take it"
        raise InputError(why, key=f"{CERT} {cert}", remedy="have it renewed, and look at the clock") from None
    except ssl.SSLError as err:
        raise InputError(f"cannot be used: {err.reason or err}", key=f"{CERT} {cert}") from None
    found: Any = client.getpeercert()
    return tuple(name.lower() for kind, name in found.get("subjectAltName", ()) if kind == "DNS")


def _goes_on(side: ssl.SSLObject) -> bool:
    try:
        side.do_handshake()
    except ssl.SSLWantReadError:
        return False
    return True
