"""Lines for a stream that takes nothing cost lines, never time."""

from __future__ import annotations

import io
import os

from flightd.runtime.line_writer import LineWriter


def test_lines_come_in_order_and_all_of_them() -> None:
    out = io.StringIO()
    lines = LineWriter(out)
    for number in range(500):
        assert lines.write(f"{number}\n") == len(f"{number}\n")
    lines.close()
    assert out.getvalue().split() == [str(number) for number in range(500)]
    assert lines.lost == 0


def test_who_writes_to_a_pipe_that_nobody_reads_does_not_wait() -> None:
    read_end, write_end = os.pipe()
    with os.fdopen(read_end) as reader, os.fdopen(write_end, "w") as full:
        lines = LineWriter(full, most=10)
        for _ in range(100):
            lines.write("x" * 65_000 + "\n")  # more than a pipe holds
        assert lines.lost >= 80
        taken = 100 - lines.lost
        assert [len(reader.readline()) for _ in range(taken)] == [65_001] * taken
        lines.close()


def test_a_stream_that_is_gone_ends_nothing() -> None:
    out = io.StringIO()
    out.close()
    lines = LineWriter(out)
    lines.write("to nobody\n")
    lines.close()
    assert lines.lost == 0
