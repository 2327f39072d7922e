"""The authenticator: only listed keys, whatever is asked."""

from __future__ import annotations

import itertools
import random

import zmq
import zmq.asyncio
from zmq.utils import z85

from flightd.adapters.ground_link.authenticator import Authenticator
from flightd.adapters.ground_link.keys import Client
from flightd.adapters.ground_link.messages.base import Role

PUBLIC = zmq.curve_keypair()[0]
KEY = z85.decode(PUBLIC)
RIGHT = [b"1.0", b"7", b"flightd", b"10.0.0.2", b"", b"CURVE", KEY]


def listening() -> tuple[zmq.asyncio.Context, Authenticator]:
    context = zmq.asyncio.Context()
    return context, Authenticator(context, {PUBLIC.decode(): Client("ann", Role.OPERATOR)})


def test_a_listed_key_comes_in_under_its_own_name_and_no_other_does() -> None:
    context, authenticator = listening()
    assert authenticator.answer(RIGHT) == [b"1.0", b"7", b"200", b"OK", PUBLIC, b""]
    other = z85.decode(zmq.curve_keypair()[0])
    assert authenticator.answer([*RIGHT[:6], other])[2] == b"400"
    assert authenticator.denied == 1
    authenticator.close()
    context.term()


def test_every_other_shape_of_question_is_refused() -> None:
    context, authenticator = listening()
    random_ = random.Random(3)
    for length, _ in itertools.product(range(10), range(200)):
        frames = [random_.randbytes(random_.randrange(40)) for _ in range(length)]
        assert authenticator.answer(frames)[2] == b"400"
    for mechanism in (b"NULL", b"PLAIN", b"GSSAPI", b"curve"):
        assert authenticator.answer([*RIGHT[:5], mechanism, KEY])[2] == b"400"
    assert authenticator.answer([*RIGHT, b"more"])[2] == b"400"
    assert authenticator.answer([b"2.0", *RIGHT[1:]])[2] == b"400"
    authenticator.close()
    context.term()
