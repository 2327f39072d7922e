"""On photographs of real floors a line's sigma covers its error."""

from __future__ import annotations

from pathlib import Path

import pytest

from flightd.studies.evaluate import evaluate
from flightd.vision.training.line_score import Gate

PHOTOGRAPHS = Path(__file__).parents[3].parent / "shared" / "real" / "lines"
ONE_SIGMA = 0.68


@pytest.mark.skipif(
    not PHOTOGRAPHS.is_dir(), reason="the labelled photographs do not lie beside the checkout (shared/real)"
)
def test_two_thirds_of_the_errors_on_photographs_are_within_one_sigma() -> None:
    scores, _, _ = evaluate(PHOTOGRAPHS, ("combined",), None, Gate(), None)
    rho, theta = scores["combined"].within_sigma_parts()
    assert rho >= ONE_SIGMA
    assert theta >= ONE_SIGMA
