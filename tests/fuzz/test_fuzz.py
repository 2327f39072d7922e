"""A few thousand cases of each fuzzer in the gate, and the driver itself."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.fuzz import config, log, messages, scenario, site
from tests.fuzz.drive import EscapedError, Target, fuzz

TARGETS: dict[str, Callable[[Path], Target]] = {
    "messages": messages.target,
    "config": config.target,
    "site": site.target,
    "scenario": scenario.target,
    "log": log.target,
}


@pytest.mark.parametrize("name", TARGETS)
def test_no_mutation_of_good_input_escapes(name: str, tmp_path: Path) -> None:
    target = TARGETS[name](tmp_path)
    outcome = fuzz(target, 1500, seed=7)
    assert 0 < outcome.refused < outcome.cases, "both good and bad input were met"
    assert outcome.corpus > len(target.seeds), "new code was reached by mutation"


@pytest.mark.parametrize("name", TARGETS)
def test_no_bytes_at_all_escape(name: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    target = TARGETS[name](tmp_path_factory.mktemp("fuzz"))
    refused: list[bool] = []

    @given(st.one_of(st.binary(max_size=300), st.text(max_size=200).map(str.encode)))
    @settings(max_examples=150)
    def attempt(data: bytes) -> None:
        refused.append(target.attempt(data))

    attempt()
    assert sum(refused) > 0.9 * len(refused), "hardly anything that is thrown together is in order"


def test_an_escaped_exception_is_told_with_its_input() -> None:
    def attempt(data: bytes) -> bool:
        if data == b"7":
            raise KeyError("escaped")
        return False

    def digit(rng: random.Random, corpus: Sequence[bytes]) -> bytes:
        return str(rng.randrange(10)).encode()

    with pytest.raises(EscapedError, match="brittle") as told:
        fuzz(Target("brittle", (b"0",), digit, attempt), 1000)
    assert told.value.data == b"7"
    assert isinstance(told.value.__cause__, KeyError)
