"""Damaged MAVLink traffic.  `python -m tests.protocol.mavlink.damaged_traffic 1000000` runs as many cases."""

from __future__ import annotations

import json
import random
import sys
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.link.codec import Codec, FrameParser

GOLDEN = json.loads((Path(__file__).parent.parent / "mavlink_golden.json").read_text())["vectors"]
"""Frames packed by pymavlink, with their fields."""


def frames(count: int, seed: int = 0) -> list[bytes]:
    codec, rng = Codec(1, 1), random.Random(seed)
    return [
        codec.pack(dialect.MAVLink_attitude_message(i, *(rng.uniform(-3, 3) for _ in range(6))))
        for i in range(count)
    ]


def mutated(rng: random.Random, good: list[bytes]) -> bytes:
    """A damaged datagram: random, cut, with flipped, dropped, doubled or inserted bytes."""
    data = bytearray(rng.choice(good))
    match rng.randrange(6):
        case 0:
            return rng.randbytes(rng.randrange(0, 300))
        case 1:
            return bytes(data[: rng.randrange(len(data))])
        case 2:
            for _ in range(rng.randrange(1, 6)):
                data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        case 3:
            del data[rng.randrange(len(data))]
        case 4:
            data.insert(rng.randrange(len(data)), rng.randrange(256))
        case _:
            data = data[rng.randrange(len(data)) :] + rng.choice(good)[: rng.randrange(20)]
    return bytes(data)


def hammer(cases: int, seed: int = 1) -> None:
    """Damaged traffic of every kind; the sound frame sent after each must still arrive.

    In a stream one in ten thousand may be lost: a false frame that reaches into the sound one passes
    the 16-bit checksum once in 65,536 times.
    """
    rng = random.Random(seed)
    good = [bytes.fromhex(v["hex"]) for v in GOLDEN]
    (probe,) = frames(1)
    packets, stream = FrameParser(Codec(1)), FrameParser(Codec(1))
    streamed = 0
    for _ in range(cases):
        noise = mutated(rng, good)
        packets.datagram(noise)
        assert len(packets.datagram(probe)) == 1
        streamed += sum(m.get_type() == "ATTITUDE" for m in stream.stream(noise + probe))
        assert stream.pending_bytes < 300
    streamed += sum(m.get_type() == "ATTITUDE" for m in stream.stream(bytes(600)))
    assert 0 <= cases - streamed <= cases // 10_000


if __name__ == "__main__":
    hammer(int(sys.argv[1]))
    print(f"{sys.argv[1]} damaged datagrams and stream chunks: no exception, no good frame lost")
