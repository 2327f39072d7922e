"""Text in pictures is searched for beside the flight: bounded, told, and never in its way."""

from __future__ import annotations

import asyncio
import importlib.util
import os
import re
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from flightd.adapters.store.sqlite import SqliteStore
from flightd.app.counting import text_searcher
from flightd.app.counting.store_writer import StoreWriter
from flightd.app.counting.text_searcher import TextSearcher
from flightd.config.label_text import LabelTextConfig
from flightd.core.inventory import LocationState
from flightd.core.label_values import LabelValue, ValueKind, ValueSource
from flightd.core.scanning import Finding
from flightd.runtime.clock import LoopClock
from flightd.vision.shelf import text_reader
from tests.rigs.event_loops import real
from tests.rigs.waiting import until

PATTERNS = (LabelTextConfig(kind="lot", pattern=r"LOT (\w+)"),)
LOT = LabelValue(ValueKind.LOT, "B1", "", ValueSource.TEXT, 0.95)


def finding(number: int) -> Finding:
    return Finding(number, f"A-{number}", LocationState.UNREADABLE, 0.9, (), "", "A1", 1.0, 2.0, 1.5, 0.1)


def searching() -> Callable[[bytes], tuple[LabelValue, ...] | None]:
    """In place of the networks: a picture says what it is."""

    def search(jpeg: bytes) -> tuple[LabelValue, ...] | None:
        if jpeg == b"deadly":
            os._exit(1)
        if jpeg == b"endless":
            threading.Event().wait()
        return None if jpeg == b"broken" else (LOT,)

    return search


class Told:
    """A store that only keeps texts."""

    def __init__(self) -> None:
        self.kept: dict[str, Sequence[LabelValue]] = {}

    def keep_texts(self, observation: str, texts: Sequence[LabelValue], asked: str) -> None:
        self.kept[observation] = texts


def test_what_is_counted_is_searched_and_kept_with_its_look(tmp_path: Path) -> None:
    async def flight() -> None:
        with (
            SqliteStore(tmp_path) as store,
            TextSearcher(store, PATTERNS, said.append, make=searching) as texts,
            StoreWriter(store, "r", 0, LoopClock(), said.append, on_written=texts.put) as writer,
        ):
            tasks = [asyncio.create_task(texts.run()), asyncio.create_task(writer.run(said.append))]
            writer.put(finding(1), b"a picture")
            writer.put(finding(2), b"")
            writer.put(replace(finding(3), state=LocationState.EMPTY), b"another picture")
            await until(lambda: texts.searched == 1 and writer.written == 3, within_s=60)
            assert texts.unsearched == 0
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            assert [seen.texts for seen in store.history("A-1")] == [(LOT,)]
            assert [seen.texts for seen in store.history("A-2")] == [()]

    said: list[str] = []
    real(flight())
    assert said == []


def test_without_the_extra_one_line_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    words = r"\[\[scan\.text\]\]: printed text is not read, it needs what is not installed \(extra ocr\)"
    assert re.match(words, str(text_reader.needs_extra()))
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: object())
    assert text_reader.needs_extra() is None


def test_what_is_not_searched_is_counted_and_told(monkeypatch: pytest.MonkeyPatch) -> None:
    async def flight() -> None:
        with TextSearcher(store, PATTERNS, said.append, make=searching) as texts:
            for number in range(4):
                texts.put(f"old {number}", b"a picture")
            assert texts.dropped == 1
            for name in ("broken", "deadly"):
                texts.put(name, name.encode())
            assert (texts.dropped, texts.unsearched) == (3, 6)
            task = asyncio.create_task(texts.run())
            await until(lambda: texts.lost == 2, within_s=60)
            texts.put("alive again", b"a picture")
            await until(lambda: texts.searched == 2, within_s=60)
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)

    monkeypatch.setattr(text_searcher, "_MOST_WAITING", 3)
    store, said = Told(), list[str]()
    real(flight())
    assert store.kept == {"old 3": (LOT,), "alive again": (LOT,)}
    (line,) = said
    assert line.startswith(
        "inventory: 5 pictures were not searched for printed text; flightd inventory texts"
    )


def test_a_process_that_hangs_is_replaced_and_its_picture_told(monkeypatch: pytest.MonkeyPatch) -> None:
    async def flight() -> None:
        with TextSearcher(store, PATTERNS, said.append, make=searching) as texts:
            task = asyncio.create_task(texts.run())
            texts.put("hangs", b"endless")
            texts.put("alive again", b"a picture")
            await until(lambda: texts.searched == 1, within_s=60)
            for number in range(2):
                texts.put(f"hangs {number}", b"endless")
            texts.put("never", b"a picture")
            await until(lambda: texts.lost == 3, within_s=60)
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)

    monkeypatch.setattr(text_searcher, "_LONGEST_S", 0.1)
    store, said = Told(), list[str]()
    real(flight())
    assert store.kept == {"alive again": (LOT,)}
    assert "no more in this flight" in said[0]
    assert said[1].startswith("inventory: 4 pictures were not searched")


def test_what_is_written_at_the_end_of_a_flight_is_told_as_not_searched(tmp_path: Path) -> None:
    async def flight() -> None:
        with (
            SqliteStore(tmp_path) as store,
            TextSearcher(store, PATTERNS, said.append, make=searching) as texts,
            StoreWriter(store, "r", 0, LoopClock(), said.append, on_written=texts.put) as writer,
        ):
            writer.put(finding(1), b"a picture")
            writer.put(replace(finding(2), state=LocationState.EMPTY), b"another picture")

    said: list[str] = []
    real(flight())
    (line,) = said
    assert line.startswith("inventory: 1 pictures were not searched")
