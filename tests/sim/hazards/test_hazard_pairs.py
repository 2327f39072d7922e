"""What the random pairs of faults are drawn from: every kind there is, in every stage of the flight."""

from __future__ import annotations

from typing import get_args

from flightd.app.simulation.sweep_routes import ROUTES, route_by_seed
from flightd.sim.scenario.fault_schema import Fault
from tests.sim.hazards.hazard_pairs import LEFT_OUT, STAGES, draw_pair

SEEDS = range(1, 401)


def test_every_kind_of_fault_is_drawn_or_left_out_for_a_reason() -> None:
    union, _ = get_args(Fault)
    known = {kind for fault in get_args(union) for kind in get_args(fault.model_fields["kind"].annotation)}
    drawn = {fault.kind for seed in SEEDS for fault in draw_pair(seed).fault}
    assert drawn | LEFT_OUT.keys() == known
    assert not drawn & LEFT_OUT.keys()


def test_the_moments_reach_every_stage_of_either_route() -> None:
    for in_stages, least in ((False, 5), (True, 20)):
        for route in ROUTES:
            seeds = (seed for seed in SEEDS if route_by_seed(seed) is route)
            faults = [fault for seed in seeds for fault in draw_pair(seed, in_stages=in_stages).fault]
            for stage, windows_s in STAGES[route].items():
                met = [f for f in faults if any(a <= (f.at_s or -1.0) <= b for a, b in windows_s)]
                assert len(met) >= least, (route.name, stage)


def test_in_stages_both_faults_of_a_pair_come_in_one() -> None:
    for seed in SEEDS:
        at_s = [f.at_s for f in draw_pair(seed, in_stages=True).fault if f.at_s is not None]
        stages = STAGES[route_by_seed(seed)].values()
        assert any(all(any(a <= t <= b for a, b in stage) for t in at_s) for stage in stages)
