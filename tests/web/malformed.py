"""Malformed messages of every kind that reach a station by a socket, each made from its number alone."""

from __future__ import annotations

import base64
import json
import random
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from flightd.core.errors import InputError
from flightd.ground.messages import read_act, read_page_message
from tests.fuzz.mutate import spoil_bytes, spoil_text

_ACTS = (b'{"id":"12345678","command":"goto","node":"A4"}', b'{"id":"12345678","command":"stop"}')
_PAGE = (
    b'{"say":"want","pictures":[{"drone":"demo","camera":"down"}]}',
    b'{"say":"drawn"}',
    b'{"say":"echo","number":1.5}',
    b'{"say":"act","number":1,"drone":"demo","act":{"id":"12345678","command":"stop"}}',
)
_DECISION = b'{"id":"12345678","place":"AL-01-1-1","what":"fine","who":"ann","seen_s":null,"note":""}'
_SET = b'{"name":"hall","paint":"yellow"}'
_PLAN = b'{"id":"12345678","drone":"nobody","nodes":["A1","A2"],"levels":[1],"best_order":true}'
_RECOUNT = b'{"store":"monday","places":["AL-01-1-1"]}'
_SIGN_IN = b'{"name":"otto","password":"correct horse battery"}'
_ODD_VALUES: tuple[Any, ...] = (
    None, True, -1, 1e308, 2**70, "", "\x00", "x" * 3000, [], [[]], {}, {"": {}}, "\ufffd", "../../etc",
)  # fmt: skip
_ANY_WORDS = {"seen_s", "note", "who", "name", "password"}
"""Fields in which an odd value may be in order."""
_MAY_LACK = {"note", "node", "levels", "best_order"}
_PATHS = (
    "/api/stock/place?store=monday&code=", "/api/stock/find?store=monday&text=", "/api/flights/",
    "/api/guide/pages/", "/api/stock/picture?store=monday&name=", "/static/", "/api/guide/pictures/",
    "/api/stock/export?store=monday&format=", "/api/guide/search?q=", "/api/flights?known=",
    "/api/studio/sets/", "/api/studio/sets/hall/pictures/", "/api/studio/profiles/",
    "/api/missions?site=", "/api/missions/estimate?drone=nobody&node=",
    "/api/stock/expected?store=monday&format=",
)  # fmt: skip


@dataclass(frozen=True)
class Station:
    """Where it listens, and the cookie of an admin: what strangers send is refused sooner."""

    host: str
    origin: str
    cookie: str


@dataclass(frozen=True)
class Malformed:
    """`data` to be sent; over a WebSocket that was opened in order, or as the first bytes of a connection.
    `refused` says that it must not be taken; else it may have stayed in order, or nearly so."""

    kind: str
    data: bytes
    over_socket: bool
    refused: bool = True


def malformed(number: int, station: Station) -> Malformed:
    """The message with this number."""
    draw = random.Random(number)
    if number % 2:
        make_frames = draw.choice(_FRAMES)
        return Malformed(make_frames.__name__, make_frames(draw), over_socket=True)
    make, refused = draw.choice(_REQUESTS)
    return Malformed(make.__name__, make(draw, station), over_socket=False, refused=refused)


def opening(station: Station) -> bytes:
    """The handshake of a page."""
    headers = {**_own(station), "Connection": "Upgrade", "Upgrade": "websocket"}
    headers |= {"Sec-WebSocket-Version": "13", "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA=="}
    return _request("GET", "/live", headers)


def _own(station: Station) -> dict[str, str]:
    return {"Host": station.host, "Origin": station.origin, "Cookie": station.cookie}


def _request(method: str, path: str, headers: dict[str, str], body: bytes = b"") -> bytes:
    lines = [f"{method} {path} HTTP/1.1", *(f"{name}: {value}" for name, value in headers.items()), "", ""]
    return "\r\n".join(lines).encode("utf-8", "surrogateescape") + body


def _post(draw: random.Random, station: Station, path: str, body: bytes, **more: str) -> bytes:
    headers = {**_own(station), "Content-Type": "application/json", "Content-Length": str(len(body)), **more}
    return _request("POST", path, headers, body)


def bytes_of_nothing(draw: random.Random, _: Station) -> bytes:
    return (
        b"\x00" + draw.randbytes(draw.randrange(1, 600)) if draw.random() < 0.9 else b"\x16\x03\x01\x02\x00"
    )


def request_line(draw: random.Random, station: Station) -> bytes:
    line = draw.choice(
        (
            "GET  / HTTP/1.1", "GET / HTTP/9.9", "G\x00T / HTTP/1.1", "GET /", "GET / HTTP/1.1 x",
            "\tGET / HTTP/1.1", "GET / HTTPS/1.1", " / HTTP/1.1", "GET /\x01 HTTP/1.1", "GET / http/1.1",
            "()<> / HTTP/1.1",
        )
    )  # fmt: skip
    return f"{line}\r\nHost: {station.host}\r\nX-Number: {draw.random()}\r\n\r\n".encode()


def headers(draw: random.Random, station: Station) -> bytes:
    bad = draw.choice(
        (
            "No Colon", "Bad Name: x", "Nul: a\x00b", "Host: second.example", ": none", "Content-Length: -1",
            "Content-Length: 1e3", "Content-Length: 5\r\nContent-Length: 6", "Transfer-Encoding: gzip",
            "X: " + "a" * draw.randrange(70_000, 200_000),
            "\r\n".join(f"X-{i}: {'b' * 900}" for i in range(90)),
            "Content-Length: " + "9" * 40, "Cr: a\rb",
        )
    )  # fmt: skip
    return f"GET /?{draw.random()} HTTP/1.1\r\nHost: {station.host}\r\n{bad}\r\n\r\n".encode()


def hosts_and_origins(draw: random.Random, station: Station) -> bytes:
    own = _own(station)
    name, value = draw.choice(
        (
            ("Host", "evil.example"), ("Host", station.host + "0"), ("Host", ""), ("Host", "[::1"),
            ("Origin", "null"), ("Origin", "http://evil.example"), ("Origin", station.origin + "0"),
            ("Origin", station.origin.replace("http:", "https:")), ("Sec-Fetch-Site", "cross-site"),
            ("Host", draw.randbytes(20).hex()), ("Authorization", "Bearer " + draw.randbytes(20).hex()),
            ("Authorization", draw.randbytes(20).hex()), ("Cookie", draw.randbytes(20).hex()),
        )
    )  # fmt: skip
    path = draw.choice(("/api/stock", "/api/session/x", "/drones/demo/acts"))
    body = draw.choice(_ACTS)
    headers = {**own, name: value, "Content-Type": "application/json", "Content-Length": str(len(body))}
    return _request("POST", path, headers, body)


def broken_json(draw: random.Random, station: Station) -> bytes:
    return _post(draw, station, "/drones/demo/acts", _broken(draw, read_act, _ACTS))


def wrong_types(draw: random.Random, station: Station) -> bytes:
    path, good = draw.choice(
        (
            ("/drones/demo/acts", _ACTS[0]), ("/api/session", _SIGN_IN),
            ("/api/stock/decisions?store=monday", _DECISION), ("/api/missions/fly", _PLAN),
            ("/api/studio/sets", _SET), ("/api/missions/recount", _RECOUNT),
        )
    )  # fmt: skip
    document = json.loads(good)
    if draw.random() < 0.2:
        document = draw.choice(_ODD_VALUES)
    elif draw.random() < 0.3:
        del document[draw.choice([key for key in document if key not in _MAY_LACK])]
    else:
        key = draw.choice([key for key in document if key not in _ANY_WORDS] or ["more"])
        document[key] = draw.choice([value for value in _ODD_VALUES if not (key == "node" and value == "")])
        document["more"] = draw.random()
    return _post(draw, station, path, json.dumps(document).encode())


def deep_or_long(draw: random.Random, station: Station) -> bytes:
    body = draw.choice((b"[" * 2000, b'{"id":' * 600, b'"' + b"x" * draw.randrange(4097, 90_000) + b'"'))
    return _post(draw, station, draw.choice(("/drones/demo/acts", "/api/session")), body)


def wrong_kind(draw: random.Random, station: Station) -> bytes:
    kind = draw.choice(("text/plain", "", "application/jsonp", "multipart/form-data; boundary=x", "\x7f"))
    path = draw.choice(
        ("/drones/demo/acts", "/api/session", "/api/stock/decisions?store=monday", "/api/missions/fly")
    )
    return _post(draw, station, path, draw.choice(_ACTS), **{"Content-Type": kind})


def broken_chunks(draw: random.Random, station: Station) -> bytes:
    body = draw.choice((b"zz\r\n{}\r\n", b"-1\r\n\r\n", b"5\r\nab", b"ffffffffffffffffff\r\n", b"2\r\n{}xx"))
    headers = {**_own(station), "Content-Type": "application/json", "Transfer-Encoding": "chunked"}
    return _request("POST", "/drones/demo/acts", headers, body + draw.randbytes(8))


def wrong_methods(draw: random.Random, station: Station) -> bytes:
    method = draw.choice(("PUT", "DELETE", "PATCH", "TRACE", "CONNECT", "OPTIONS", "PROPFIND", "X" * 30))
    return _request(
        method,
        draw.choice(("/", "/api/stock", "/drones/demo/acts")),
        {**_own(station), "Content-Length": "0"},
    )


def handshakes(draw: random.Random, station: Station) -> bytes:
    lines = opening(station).decode().split("\r\n")
    key, version = "Sec-WebSocket-Key", "Sec-WebSocket-Version"
    name = draw.choice((key, version))
    at = next(i for i, line in enumerate(lines) if line.startswith(name))
    odd = ("X: x", f"{version}: 12", f"{key}: \x01", f"{version}: x", f"{name}:", f"{name}: {'x' * 300}")
    lines[at] = draw.choice(odd)
    return "\r\n".join(lines).encode()


def odd_questions(draw: random.Random, station: Station) -> bytes:
    odd = draw.choice(
        (
            "%00", "%ff%fe", "..%2f..%2fetc%2fpasswd", "%2e%2e/", "\udcff", "'%20OR%201=1--", "%", "%zz",
            "9" * 300,
            "-1", "nan", "x" * 3000, "%F0%9F%9A%81", "{aisle.__class__}", "a&store=&code=b", "a;b",
        )
    )  # fmt: skip
    return _request("GET", draw.choice(_PATHS) + odd, {**_own(station), "Connection": "close"})


def spoilt(draw: random.Random, station: Station) -> bytes:
    corpus = [
        _request("GET", "/", _own(station)),
        opening(station),
        _post(draw, station, "/drones/nobody/acts", _ACTS[1]),
        _post(draw, station, "/api/stock/decisions?store=monday", _DECISION),
        _post(draw, station, "/api/missions/fly", _PLAN),
        _request("GET", "/api/stock/find?store=monday&text=%2800%29340123450002439853", _own(station)),
    ]
    return spoil_bytes(draw, corpus)


_REQUESTS: tuple[tuple[Callable[[random.Random, Station], bytes], bool], ...] = (
    (bytes_of_nothing, True), (request_line, True), (headers, True), (hosts_and_origins, True),
    (broken_json, True), (wrong_types, True), (deep_or_long, True), (wrong_kind, True), (broken_chunks, True),
    (wrong_methods, True), (handshakes, True), (odd_questions, False), (spoilt, False),
)  # fmt: skip


def frame(opcode: int, payload: bytes, *, final: bool = True, rsv: int = 0, masked: bool = True) -> bytes:
    """A frame of a client, in order or not."""
    head = bytes([(0x80 if final else 0) | rsv << 4 | opcode])
    mask = 0x80 if masked else 0
    if len(payload) < 126:
        head += bytes([mask | len(payload)])
    elif len(payload) < 1 << 16:
        head += struct.pack(">BH", mask | 126, len(payload))
    else:
        head += struct.pack(">BQ", mask | 127, len(payload))
    return head + (b"\x00" * 4 if masked else b"") + payload


def words(draw: random.Random) -> bytes:
    return frame(1, _broken(draw, read_page_message, _PAGE, utf8=True))


def words_as_bytes(draw: random.Random) -> bytes:
    return frame(2, _broken(draw, read_page_message, _PAGE))


def odd_documents(draw: random.Random) -> bytes:
    document = json.loads(draw.choice(_PAGE))
    document["say"] = draw.choice([*_ODD_VALUES, "land", "want ", "WANT"])
    return frame(1, json.dumps(draw.choice([document, [document], document["say"]])).encode())


def deep_words(draw: random.Random) -> bytes:
    return frame(1, draw.choice((b"[" * 2000, b'{"say":' * 500, b'{"say":"want","pictures":' + b"[" * 900)))


def no_text(draw: random.Random) -> bytes:
    return frame(1, b'{"say":"\xff\xfe' + draw.randbytes(20))


def masks(draw: random.Random) -> bytes:
    return frame(1, draw.choice(_PAGE), masked=False)


def opcodes(draw: random.Random) -> bytes:
    return frame(draw.choice((3, 4, 5, 6, 7, 11, 12, 13, 14, 15)), draw.randbytes(draw.randrange(100)))


def reserved_bits(draw: random.Random) -> bytes:
    return frame(draw.choice((1, 2, 9)), draw.choice(_PAGE), rsv=draw.randrange(1, 8))


def long_pings(draw: random.Random) -> bytes:
    return frame(draw.choice((9, 10)), draw.randbytes(draw.randrange(126, 4000)))


def cut_pings(draw: random.Random) -> bytes:
    return frame(draw.choice((8, 9, 10)), b"x", final=False)


def lone_ends(draw: random.Random) -> bytes:
    return frame(0, draw.randbytes(draw.randrange(100)))


def two_begins(draw: random.Random) -> bytes:
    return frame(1, b'{"say":', final=False) + frame(1, b'"drawn"}')


def lengths(draw: random.Random) -> bytes:
    length = draw.choice((1 << 63, (1 << 64) - 1, 1 << 62, 1 << 40, 4097, 1 << 20))
    return struct.pack(">BBQ", 0x81, 0xFF, length) + b"\x00" * 4 + draw.randbytes(64)


def long_words(draw: random.Random) -> bytes:
    return frame(1, b'"' + b"x" * draw.randrange(4096, 70_000) + b'"')


def closings(draw: random.Random) -> bytes:
    code = draw.choice((0, 999, 1004, 1005, 1006, 1015, 2000, 65535))
    return draw.choice((frame(8, struct.pack(">H", code)), frame(8, b"\x03"), frame(8, b"\x03\xe8\xff\xfe")))


def bytes_for_frames(draw: random.Random) -> bytes:
    return bytes([draw.choice((0x83, 0xF1, 0x0B, 0x70))]) + draw.randbytes(draw.randrange(20, 300))


_FRAMES: tuple[Callable[[random.Random], bytes], ...] = (
    words, words_as_bytes, odd_documents, deep_words, no_text, masks, opcodes, reserved_bits, long_pings,
    cut_pings, lone_ends, two_begins, lengths, long_words, closings, bytes_for_frames,
)  # fmt: skip


def _broken(
    draw: random.Random, read: Callable[[bytes], object], corpus: tuple[bytes, ...], utf8: bool = False
) -> bytes:
    """What `read` does not take, no longer than a message may be; as text, where it has to be."""
    while True:
        made = spoil_text(draw, corpus)[:4000]
        if utf8:
            made = made.decode(errors="replace").encode()
        try:
            read(made)
        except InputError:
            return made


def b64(data: bytes) -> str:
    """To tell a message in a failure."""
    return base64.b64encode(data[:400]).decode()
