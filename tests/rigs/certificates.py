"""Certificates as openssl makes them, for a test alone."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest


def openssl(*words: str) -> None:
    """Run openssl; a test without it is skipped, but not where everything has to run."""
    found = shutil.which("openssl")
    if found is None:
        text = "no openssl on this machine: apt install openssl"
        if os.environ.get("CI") == "true":
            pytest.fail(text)
        pytest.skip(text)
    subprocess.run([found, *words], check=True, capture_output=True)


_CA = """
[ca]
default_ca = here
[here]
dir = {0}
database = {0}/index.txt
new_certs_dir = {0}
rand_serial = yes
default_md = sha256
policy = any
[any]
commonName = supplied
"""


def make_expired_certificate(folder: Path) -> tuple[Path, Path]:
    """A certificate of a day in 2020, and its key."""
    cert, key, request, config = (folder / f"past.{kind}" for kind in ("pem", "key", "csr", "cnf"))
    (folder / "index.txt").touch()
    config.write_text(_CA.format(folder))
    openssl(
        "req", "-new", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-subj",
        "/CN=past", "-keyout", str(key), "-out", str(request),
    )  # fmt: skip
    openssl(
        "ca", "-batch", "-config", str(config), "-selfsign", "-keyfile", str(key), "-in", str(request),
        "-startdate", "20200101000000Z", "-enddate", "20200102000000Z", "-out", str(cert),
    )  # fmt: skip
    key.chmod(0o600)
    return cert, key


def make_certificate(folder: Path, name: str = "station", *more: str) -> tuple[Path, Path]:
    """A certificate signed by itself for localhost and 127.0.0.1, and its key."""
    cert, key = folder / f"{name}.pem", folder / f"{name}.key"
    openssl(
        "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes",
        "-days", "30", "-subj", "/CN=station",
        "-addext", "subjectAltName=DNS:localhost,DNS:*.Depot.example,IP:127.0.0.1",
        "-keyout", str(key), "-out", str(cert), *more,
    )  # fmt: skip
    key.chmod(0o600)
    return cert, key
