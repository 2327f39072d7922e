"""[[scan.text]]: a pattern that cannot say one value is refused before anything opens."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from flightd.config.schema import parse_config
from flightd.core.errors import InputError


def config_with(**text: Any) -> Any:
    return parse_config({"mission": {"site": "hall.toml"}, "scan": {"text": [text]}}, Path("hall.toml"))


def test_patterns_are_read() -> None:
    (lot,) = config_with(kind="lot", pattern=r"LOT (\w+)").scan.text
    assert (lot.kind, lot.is_date) == ("lot", False)
    assert config_with(kind="expiry", pattern="(.*)", dates=["%b %Y"]).scan.text[0].is_date


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ({"kind": "lot", "pattern": "LOT ("}, "no regular expression"),
        ({"kind": "lot", "pattern": "(a{99999999999})"}, "no regular expression"),
        ({"kind": "lot", "pattern": "LOT"}, "has 0 groups; put the value alone in parentheses"),
        ({"kind": "lot", "pattern": "(L)(O)"}, "has 2 groups"),
        ({"kind": "expiry", "pattern": "(.*)"}, 'kind = "expiry" needs dates'),
        ({"kind": "lot", "pattern": "(.*)", "dates": ["%d.%m.%Y"]}, "is no date, leave out dates"),
        ({"kind": "expiry", "pattern": "(.*)", "dates": ["%d.%m."]}, "needs a year"),
        ({"kind": "expiry", "pattern": "(.*)", "dates": ["%Y"]}, "a month"),
        ({"kind": "colour", "pattern": "(.*)"}, "scan.text"),
    ],
)
def test_what_cannot_say_one_value_is_refused(text: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=r"scan\.text") as refused:
        config_with(**text)
    assert words in str(refused.value)
