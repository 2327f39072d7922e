"""The driver of every fuzzer: mutate what reached new code, and stop at the first escaped exception."""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

from flightd.core.errors import FlightdError
from tests.fuzz.mutate import Mutate

_PACKAGE = str(Path(__file__).parents[2] / "flightd")
_TRACED_EVERY = 16
"""Tracing lines costs ten times the case itself: only so many cases may enter the corpus."""

_CORPUS = 4000


@dataclass(frozen=True)
class Target:
    """What is fuzzed: `attempt` takes the bytes of one case and raises nothing for any of them; what it
    documents to raise it catches itself, and says by True that the input was refused."""

    name: str
    seeds: tuple[bytes, ...]
    mutate: Mutate
    attempt: Callable[[bytes], bool]


@dataclass(frozen=True)
class Outcome:
    cases: int
    refused: int
    corpus: int
    lines: int


class EscapedError(AssertionError):
    """An exception that is not documented; `data` is the input that caused it."""

    def __init__(self, target: str, case: int, data: bytes) -> None:
        super().__init__(f"{target}: case {case} raised, see the cause; its input: {data[:400]!r}")
        self.data = data


def fuzz(target: Target, count: int, seed: int = 1, said: Callable[[Outcome], None] | None = None) -> Outcome:
    """Run `count` cases.  EscapedError with the input and the cause at the first that raises."""
    rng = random.Random(seed)
    corpus, lines = list(target.seeds), _Lines()
    refused = 0
    for case in range(count):
        data = target.mutate(rng, corpus)
        try:
            if case % _TRACED_EVERY:
                refused += target.attempt(data)
            else:
                with lines.watched():
                    refused += target.attempt(data)
                if lines.found_new() and len(corpus) < _CORPUS:
                    corpus.append(data)
        except Exception as err:
            raise EscapedError(target.name, case, data) from err
        if said is not None and case % 100_000 == 99_999:
            said(Outcome(case + 1, refused, len(corpus), len(lines.seen)))
    return Outcome(count, refused, len(corpus), len(lines.seen))


class _Lines:
    """The lines of flightd that were ever reached."""

    def __init__(self) -> None:
        self.seen: set[tuple[str, int]] = set()
        self._before = 0

    @contextmanager
    def watched(self) -> Iterator[None]:
        outer = sys.gettrace()
        sys.settrace(self._called)
        try:
            yield
        finally:
            sys.settrace(outer)

    def found_new(self) -> bool:
        before, self._before = self._before, len(self.seen)
        return len(self.seen) > before

    def _called(self, frame: FrameType, event: str, arg: Any) -> Any:
        return self._line if frame.f_code.co_filename.startswith(_PACKAGE) else None

    def _line(self, frame: FrameType, event: str, arg: Any) -> Any:
        self.seen.add((frame.f_code.co_filename, frame.f_lineno))
        return self._line


def in_one_line(err: FlightdError) -> bool:
    """True; AssertionError where the error for a person is not the one line that it has to be."""
    assert "\n" not in str(err).strip(), f"more than a line: {err}"
    return True


@contextmanager
def scratch() -> Iterator[Path]:
    """A folder in memory, if the machine has one."""
    memory = Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=memory if memory.is_dir() else None) as folder:
        yield Path(folder)


def main(make: Callable[[Path], Target]) -> None:
    """The command line of one fuzzer.  Exit 1 at an escaped exception; its input is left in a file."""
    parser = argparse.ArgumentParser()
    parser.add_argument("count", type=int)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    began = time.monotonic()

    def say(outcome: Outcome) -> None:
        rate = outcome.cases / (time.monotonic() - began)
        print(f"{outcome.cases} cases, {outcome.refused} refused, corpus {outcome.corpus}, "
              f"{outcome.lines} lines reached, {rate:.0f}/s", flush=True)  # fmt: skip

    with scratch() as folder:
        target = make(folder)
        try:
            say(fuzz(target, options.count, options.seed, say))
        except EscapedError as err:
            left = Path(tempfile.gettempdir()) / f"fuzz-{target.name}.bin"
            left.write_bytes(err.data)
            print(f"{err}\nits input is in {left}", file=sys.stderr)
            raise
