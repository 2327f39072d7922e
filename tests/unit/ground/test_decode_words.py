"""What a person typed and a message does not take, in a person's words."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from flightd.core.errors import InputError
from flightd.ground.json_http import decoded
from flightd.ground.site_page.new_site import NewSite

SOUND: dict[str, Any] = {"name": "hall", "aisles": 2, "nodes": 6, "spacing_m": [1.5], "pitch_m": 3.0}
RACKS: dict[str, Any] = {"levels_m": [0.3], "bay_width_m": 1.35, "positions": 1}


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"aisles": -5}, "aisles is less than 1"),
        ({"aisles": 27}, "aisles is more than 26"),
        ({"aisles": 1.5}, "aisles is no whole number"),
        ({"aisles": None}, "aisles is not given"),
        ({"name": ""}, "name is empty or too short"),
        ({"name": "x" * 81}, "name is longer than 80"),
        ({"spacing_m": [1.5, 0.0]}, "spacing_m[1] is not above 0"),
        ({"racks": {**RACKS, "bay_width_m": 0.1}}, "racks.bay_width_m is less than 0.2"),
        ({"length": 3}, "Object contains unknown field `length`"),
    ],
)
def test_it_names_the_field_and_its_limit(wrong: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as refused:
        decoded(msgspec.json.encode({**SOUND, **wrong}), NewSite, "a new site")
    assert str(refused.value) == f"not a new site: {words}"
