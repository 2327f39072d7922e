"""The protocol's documentation is complete, and its numbers are what they say."""

from __future__ import annotations

import json

import msgspec
import pytest

from flightd.adapters.ground_link.messages.base import finite
from flightd.adapters.ground_link.protocol import ANSWERS, PARTS, PUBLISHED, REQUESTS, encode
from flightd.adapters.ground_link.protocol_text import fields_of, markdown, schema

TAGS = {"op", "answer"}


@pytest.mark.parametrize("message", [*PUBLISHED, *REQUESTS, *ANSWERS, *PARTS])
def test_every_field_of_every_message_is_described(message: type[msgspec.Struct]) -> None:
    assert message.__doc__
    described = {name: text for name, _, text in fields_of(message)}
    assert described
    assert [name for name, text in described.items() if not text and name not in TAGS] == []


def test_the_text_holds_every_message() -> None:
    text = markdown()
    for message in (*PUBLISHED, *REQUESTS, *ANSWERS, *PARTS):
        assert f"**{message.__name__}**" in text
    definitions = json.loads(msgspec.json.encode(schema()))["$defs"]
    assert {message.__name__ for message in (*PUBLISHED, *REQUESTS, *ANSWERS)} <= set(definitions)


def test_what_is_no_number_becomes_null() -> None:
    assert finite(float("nan")) is None
    assert finite(float("inf")) is None
    assert encode({"x": float("nan")}) == b'{"x":null}'
