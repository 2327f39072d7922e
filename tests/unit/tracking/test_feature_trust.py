"""Features are believed once they move as lines say that the floor does."""

from __future__ import annotations

import random

import pytest

from flightd.tracking.feature_trust import FeatureTrust

FRAME_NS, DT_S = 33_333_333, 1 / 30


def flown(share: float, frames: int = 60, speed_mps: float = 0.6, lines: bool = True) -> FeatureTrust:
    """Along x with features that move with `share` of the floor's motion."""
    trust, rng = FeatureTrust(), random.Random(2)
    for n in range(frames):
        x = share * speed_mps * DT_S * n
        seen = {id_: (id_ * 0.1 - x + rng.gauss(0, 0.004), rng.gauss(0, 0.004)) for id_ in range(5)}
        trust.step(seen, (speed_mps, 0.0) if lines else (None, None), n * FRAME_NS)
    return trust


def test_what_moves_with_the_floor_is_believed() -> None:
    assert flown(1.0).holds


@pytest.mark.parametrize("share", [0.0, 0.2, 2.0])
def test_dust_shadows_and_mirrored_lamps_are_not(share: float) -> None:
    assert not flown(share).holds


def test_nothing_is_believed_before_lines_have_told_a_way() -> None:
    assert not flown(1.0, lines=False).holds
    assert not flown(1.0, speed_mps=0.01).holds
    assert not FeatureTrust().holds
