"""Every phase is known wherever phases are shown or answered."""

from __future__ import annotations

from flightd.core.types import CommandKind, Phase
from flightd.replay.report.charts import PHASE_TONE
from tests.rigs.possible_commands import possible_in


def test_the_report_has_a_colour_for_every_phase() -> None:
    assert set(PHASE_TONE) == set(Phase)


def test_a_vehicle_that_was_found_flying_can_be_landed_from_the_ground_and_nothing_else() -> None:
    assert possible_in(Phase.RECOVER) == {CommandKind.LAND, CommandKind.STOP}
