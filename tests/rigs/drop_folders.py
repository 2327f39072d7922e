"""What every folder shared with a warehouse system does, wherever it lies."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

from flightd.core.errors import UnavailableError
from flightd.ground.shared_folder import SharedFolder


def check_files_come_and_go(
    there: SharedFolder, drop: Callable[[bytes], object], size: int, then: bytes
) -> None:
    """Of `expected.inbox` in wms.toml, where a.csv lies with `size` bytes; `drop` writes it anew, as
    `then`.  Left behind are taking/a.csv and done/a.csv.txt, which says `then`."""
    first = there.listed()["a.csv"]
    assert (first[0], there.listed("done")) == (size, {})
    drop(then)
    assert there.listed()["a.csv"] != first
    assert there.read("a.csv", len(then)) == then
    there.move("a.csv", "taking/a.csv")
    for content in (b"first", b"then"):
        there.write("done/a.csv.txt", content)
    refused = f"wms.toml: expected.inbox: {re.escape(there.address)}: a.csv cannot be read: "
    with pytest.raises(UnavailableError, match=refused):
        there.read("a.csv", 1)
    there.close()
