"""Key files, the allow-list, and when the link refuses to start."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import pytest
import zmq
import zmq.auth

from flightd.adapters.ground_link.keys import Client, KeyPair, load_clients, load_pair, load_public, make_keys
from flightd.adapters.ground_link.messages.base import Role
from flightd.config.ground import GroundConfig, is_loopback
from flightd.config.schema import load_config
from flightd.core.errors import InputError

ROOT = Path(__file__).parents[3]


def test_new_keys_are_zmqs_own_files_and_the_secret_is_private(tmp_path: Path) -> None:
    public, secret = make_keys(tmp_path, "laptop")
    pair = load_pair(secret)
    assert load_public(public) == pair.public
    assert zmq.curve_public(pair.secret.encode()).decode() == pair.public
    assert zmq.auth.load_certificate(secret) == (pair.public.encode(), pair.secret.encode())
    assert secret.stat().st_mode & 0o777 == 0o600
    with pytest.raises(InputError, match="there already"):
        make_keys(tmp_path, "laptop")
    with pytest.raises(InputError, match="key name"):
        make_keys(tmp_path, "../evil")


def test_a_secret_key_that_others_can_read_is_refused(tmp_path: Path) -> None:
    _, secret = make_keys(tmp_path, "laptop")
    secret.chmod(0o640)
    with pytest.raises(InputError, match="chmod 600"):
        load_pair(secret)


def test_what_is_no_key_is_named(tmp_path: Path) -> None:
    public, _ = make_keys(tmp_path, "laptop")
    with pytest.raises(InputError, match="key_secret"):
        load_pair(public)
    with pytest.raises(InputError, match=r"no-such\.key"):
        load_public(tmp_path / "no-such.key")
    (tmp_path / "junk.key").write_text("hello\n")
    with pytest.raises(InputError, match="holds no key"):
        load_public(tmp_path / "junk.key")
    (tmp_path / "short.key").write_text(f'curve\n    public-key = "{"#" * 40}"\n')
    with pytest.raises(InputError, match="damaged"):
        load_public(tmp_path / "short.key")


def _key() -> str:
    return zmq.curve_keypair()[0].decode()


def test_the_allow_list_says_who_is_who(tmp_path: Path) -> None:
    one, two = _key(), _key()
    file = tmp_path / "clients"
    file.write_text(f"# ground station\noperator {one} desk\n\nviewer {two} wall\n")
    assert load_clients(file) == {one: Client("desk", Role.OPERATOR), two: Client("wall", Role.VIEWER)}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("admin KEY desk\n", ":1: role 'admin'"),
        ("operator desk\n", ":1: expected ROLE PUBLIC-KEY NAME"),
        ("# x\noperator nonsense desk\n", ":2: 'nonsense' is not a public key"),
        ("operator KEY a/b\n", "client name"),
        ("operator KEY desk\nviewer KEY wall\n", ":2: wall: key or name"),
        ("# nobody\n", "lists no client"),
    ],
)
def test_a_wrong_allow_list_is_named_by_its_line(tmp_path: Path, text: str, said: str) -> None:
    file = tmp_path / "clients"
    file.write_text(text.replace("KEY", _key()))
    with pytest.raises(InputError) as refused:
        load_clients(file)
    assert said in str(refused.value)


@pytest.mark.parametrize("host", ["127.0.0.1", "127.8.0.1", "::1", "localhost"])
def test_this_machine_needs_no_keys(host: str) -> None:
    assert is_loopback(host)
    assert GroundConfig(listen=host).server_key is None


KEYS: dict[str, Any] = {"server_key": Path("k"), "clients": Path("c"), "audit": Path("a")}


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.7", "drone.local", "*", "wlan0"])
def test_beyond_this_machine_it_refuses_without_keys_allow_list_and_audit(host: str) -> None:
    for count in range(3):
        for some in itertools.combinations(KEYS.items(), count):
            with pytest.raises(ValueError, match=r"belong together|beyond this machine"):
                GroundConfig(listen=host, **dict(some))
    assert GroundConfig(listen=host, **KEYS).listen == host


def test_the_refusal_is_one_line_that_names_the_section(tmp_path: Path) -> None:
    config = tmp_path / "flightd.toml"
    config.write_text('[mission]\nsite = "x.toml"\n[ground]\nlisten = "0.0.0.0"\n')
    with pytest.raises(InputError, match=r"flightd.toml: ground: .*needs server_key and clients and audit"):
        load_config(config)


def test_key_files_are_found_beside_the_configuration(tmp_path: Path) -> None:
    config = tmp_path / "flightd.toml"
    text = 'server_key = "keys/d.key_secret"\nclients = "keys/clients"\naudit = "/var/log/x"\n'
    config.write_text(f'[mission]\nsite = "x.toml"\n[ground]\nlisten = "0.0.0.0"\n{text}')
    ground = load_config(config).ground
    assert ground.server_key == tmp_path / "keys" / "d.key_secret"
    assert ground.audit == Path("/var/log/x")


def test_without_a_word_the_link_is_off() -> None:
    assert load_config(ROOT / "configs" / "sim.toml").ground.listen == ""


def test_key_files_of_an_earlier_version_are_still_read(tmp_path: Path) -> None:
    public, secret = (half.decode() for half in zmq.curve_keypair())
    halves = f'    public-key = "{public}"\n    secret-key = "{secret}"\n'
    file = tmp_path / "old.key_secret"
    file.write_text(f'metadata\n    name = "old"\ncurve\n{halves}')
    file.chmod(0o600)
    assert load_pair(file) == KeyPair(public, secret)


def test_new_keys_leave_nothing_else_behind_and_no_file_is_written_over(tmp_path: Path) -> None:
    (tmp_path / "desk.key_secret").write_text("precious")
    with pytest.raises(InputError, match=r"desk\.key_secret: there already"):
        make_keys(tmp_path, "desk")
    assert (tmp_path / "desk.key_secret").read_text() == "precious"
    make_keys(tmp_path, "wall")
    assert {path.name for path in tmp_path.iterdir()} == {"desk.key_secret", "wall.key", "wall.key_secret"}
