"""By which colour profile a drone flies: the configured one, or that of the site's paint."""

from __future__ import annotations

import dataclasses

import pytest

from flightd.app.build import profile_of
from flightd.config.paths import shipped
from flightd.config.schema import Config, load_config
from flightd.core.errors import InputError
from flightd.core.paint import NAMED_PAINTS
from flightd.site.site import Site
from flightd.site.site_file import load_site

CONFIG = load_config(shipped("sim.toml"))


def painted(paint: str) -> Site:
    return dataclasses.replace(load_site(shipped("site-demo.toml")), line_colour=paint)


def with_profile(name: str) -> Config:
    return CONFIG.with_values(vision={"profile": name})


@pytest.mark.parametrize("paint", NAMED_PAINTS)
def test_every_named_paint_flies_by_the_profile_of_its_name(paint: str) -> None:
    assert profile_of(CONFIG, painted(paint)) == paint


def test_a_tone_of_its_own_needs_a_profile_of_its_own() -> None:
    with pytest.raises(InputError, match="no profile is shipped for paint #7a3fa0; train one") as refused:
        profile_of(CONFIG, painted("#7a3fa0"))
    assert refused.value.key == "vision.profile"
    assert profile_of(with_profile("purple.npz"), painted("#7a3fa0")) == "purple.npz"
