"""Errors carry what they say in fields, and put it into one line."""

from __future__ import annotations

import pickle
import sys

import pytest

from flightd.core.errors import FlightdError, InputError, TransientError
from flightd.core.extras import MissingExtraError, missing_extra
from flightd.site.ways import NoWayError

SETUPTOOLS = ['av>=12; extra == "ardrone"', 'textual>=1.0; extra == "ground"', "numpy>=1.26"]
HATCHLING = ["av>=12; extra == 'ardrone'", "textual>=1.0; extra == 'ground'", "numpy>=1.26"]


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (InputError("cannot be read"), "cannot be read"),
        (InputError("cannot be read", file="a.toml"), "a.toml: cannot be read"),
        (
            InputError("must be above 0", file="a.toml", key="camera.fps"),
            "a.toml: camera.fps: must be above 0",
        ),
        (InputError("unknown", key="--format pdf", remedy="choose csv"), "--format pdf: unknown; choose csv"),
        (NoWayError("no way"), "no way"),
    ],
)
def test_the_line_is_made_of_the_fields(error: FlightdError, text: str) -> None:
    assert str(error) == text


def test_an_error_comes_whole_out_of_another_process() -> None:
    error = TransientError("died", file="camera", key="fps", remedy="wait")
    back = pickle.loads(pickle.dumps(error))
    assert (type(back), vars(back), str(back)) == (TransientError, vars(error), str(error))
    extra = pickle.loads(pickle.dumps(missing_extra("ground", "watch", SETUPTOOLS)))
    assert isinstance(extra, MissingExtraError)
    assert extra.extra == "ground"


@pytest.mark.parametrize("declared", [SETUPTOOLS, HATCHLING])
def test_a_missing_extra_says_how_to_get_its_packages_for_this_python(declared: list[str]) -> None:
    error = missing_extra("ground", "flightctl watch", declared)
    assert error.remedy == f"{sys.executable} -m pip install 'textual>=1.0'"
    assert str(error).startswith("flightctl watch needs what is not installed (extra ground); ")
    assert "flightd[" not in str(error), "no package index need know flightd"


def test_a_missing_extra_of_an_uninstalled_checkout_is_installed_from_it() -> None:
    assert missing_extra("xlsx", "the XLSX export", []).remedy.endswith("-m pip install -e '.[xlsx]'")
