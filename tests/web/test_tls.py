"""The station's own certificate: one line for wrong files, and strict transport with right ones."""

from __future__ import annotations

import json
import ssl
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from flightd.core.errors import InputError
from flightd.ground.tls import read_certificate
from tests.rigs.certificates import make_certificate, make_expired_certificate, openssl
from tests.web.chromium import ROOT, station
from tests.web.people_rig import PASSWORD, with_people


def test_a_certificate_tells_the_names_that_it_is_for(tmp_path: Path) -> None:
    cert, key = make_certificate(tmp_path)
    found = read_certificate(cert, key)
    assert found is not None
    assert found.names == ("localhost", "*.depot.example")
    assert read_certificate(None, None) is None


def test_wrong_files_are_one_clear_line(tmp_path: Path) -> None:
    cert, key = make_certificate(tmp_path)
    other_cert, other_key = make_certificate(tmp_path, "other")
    past, past_key = make_expired_certificate(tmp_path)
    client, client_key = make_certificate(tmp_path, "client", "-addext", "extendedKeyUsage=clientAuth")
    locked = tmp_path / "locked.key"
    openssl("pkey", "-in", str(key), "-aes256", "-passout", "pass:words", "-out", str(locked))
    locked.chmod(0o600)
    text = tmp_path / "words.txt"
    text.write_text("no certificate\n")
    text.chmod(0o600)
    for files, said in (
        ((cert, None), "--tls-cert, --tls-key: belong together"),
        ((None, key), "--tls-cert, --tls-key: belong together"),
        ((tmp_path / "none.pem", key), "--tls-cert .*none.pem: cannot be read: No such file"),
        ((tmp_path, key), "--tls-cert .*: cannot be read: Is a directory"),
        ((text, key), "--tls-cert .*words.txt: is no PEM file"),
        ((cert, text), "--tls-key .*words.txt: is no PEM file"),
        ((key, cert), "--tls-"),
        ((cert, other_key), "--tls-key .*other.key: does not belong to the certificate"),
        ((other_cert, key), "--tls-key .*station.key: does not belong to the certificate"),
        ((cert, locked), "--tls-key .*locked.key: is locked by a passphrase; give one without"),
        ((past, past_key), "--tls-cert .*past.pem: certificate has expired; have it renewed"),
        ((client, client_key), "--tls-cert .*client.pem: "),
    ):
        with pytest.raises(InputError, match=said) as refused:
            read_certificate(*files)
        assert "\n" not in str(refused.value)
    key.chmod(0o644)
    with pytest.raises(InputError, match=r"everybody on this machine can read it; chmod o= .*station\.key"):
        read_certificate(cert, key)


def test_beyond_this_machine_it_starts_only_with_people_and_tls(tmp_path: Path) -> None:
    cert, key = make_certificate(tmp_path)
    tls = ["--tls-cert", str(cert), "--tls-key", str(key)]
    state = tmp_path / "state"

    def refusal(*words: str) -> str:
        command = [sys.executable, "-m", "flightd", "ground", "--listen", "0.0.0.0:0", "--state", str(state)]
        done = subprocess.run(
            [*command, *words],
            cwd=ROOT, capture_output=True, text=True, timeout=60, check=False,
        )  # fmt: skip
        assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
        return done.stderr

    assert refusal() == (
        "flightd: --listen 0.0.0.0: reaches beyond this machine, and the station has nobody who could sign"
        " in and no TLS; flightd ground people add NAME --role admin, then give --tls-cert FILE"
        " --tls-key FILE\n"
    )
    assert "has nobody who could sign in; flightd ground people add" in refusal(*tls)
    with_people(state)
    assert "has no TLS; give --tls-cert FILE --tls-key FILE" in refusal()
    with station([], "0.0.0.0:0", state=state, options=tls) as listening:
        url = listening.replace("0.0.0.0", "127.0.0.1")
        trusting = ssl.create_default_context(cafile=str(cert))
        with urllib.request.urlopen(f"{url}/api/session", context=trusting, timeout=20) as answer:
            assert answer.headers["Strict-Transport-Security"] == "max-age=31536000"
            assert {"login": True, "name": ""}.items() <= json.loads(answer.read()).items()
        said = f'{{"name":"otto","password":"{PASSWORD}"}}'.encode()
        headers = {"Origin": url, "Content-Type": "application/json"}
        request = urllib.request.Request(f"{url}/api/session", said, headers)
        with urllib.request.urlopen(request, context=trusting, timeout=20) as answer:
            cookie = answer.headers["Set-Cookie"]
        assert cookie.startswith("__Host-flightd=")
        assert "; Secure" in cookie
        old = ssl.create_default_context(cafile=str(cert))
        old.maximum_version = ssl.TLSVersion.TLSv1_2
        with urllib.request.urlopen(f"{url}/", context=old, timeout=20) as answer:
            assert answer.status == 200
