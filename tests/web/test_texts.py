"""The texts of the pages: all that is said in English has its German, with the same figures, and no more."""

from __future__ import annotations

import errno
import functools
import gzip
import json
import os
import re
from collections import Counter
from pathlib import Path

from flightd.ground.pages import STATIC
from tests.web.page_texts import Literal, Module, read_module
from tests.web.refused_texts import NO_PAGE, ROOT, SOURCES, STAYS_ENGLISH, refused_texts, value_mistakes

APP = STATIC / "app"
GERMAN = APP / "german"
SAID = re.compile(r"\b(?:say|sayWith|english)\((?:[^()\"]*(?:\?|\?\?) *)?$")
"""Before an English text of the pages."""
FILLED = re.compile(r'\benglish\("(?:[^"\\]|\\.)*", \{')
ENTRY = re.compile(r'^  ("(?:[^"\\]|\\.)*"): ("(?:[^"\\]|\\.)*"),$', re.MULTILINE)
PLACE = re.compile(r"\{\w*\}")
SAME = {
    "Autopilot", "CSV, {separator}, {encoding}", "Codes", "Export", "Live", "Mission", "Name", "Pause",
    "Position", "STOP", "Start", "Start: {why}", "Station", "Studio", "VDMA LIF", "Version {number}",
    "Zoom", "camera.cx_px {cx}, cy_px {cy}", "camera.latency_s = {seconds}", "orange", "{exposure} ms",
    "{figure}: {share} %, {name} {other} %", "{name}: {why}",
}  # fmt: skip
"""German and English alike."""
COMPOSED = {
    "emergency in flight",
    "stop the daemon and run flightd doctor on the drone with --rock",
    "the down camera delivers no picture",
    "the front camera delivers no picture",
    "this flight uses no down camera",
    "this flight uses no front camera",
    "{figure}: {share} %, shipped {paint} {other} %",
    "{one} Hz or {other} Hz",
}
"""What the program puts together of several texts, where German has it otherwise."""
NO_TEXTS = re.compile(
    r"unattended_start = true|flightd\b.*|node, x_m, y_m.*|--\w+.*|\[vision\].*|Esc|out|(?:hall-3)|"
    r"Content-Type|AbortError|\w+State|(?:Arrow|Back)\w+|Escape|Enter|Home|End|Delete|Deutsch|English|"
    r"(?:application|image)/.*",
    re.DOTALL,
)
"""What is typed or pressed as it stands, and names of the browser's own."""
WORDS = re.compile(r"[A-Z][a-z]+\b.*[a-z]|[A-Z][a-z]{2,}")


@functools.cache
def modules() -> list[tuple[Path, Module]]:
    paths = [path for path in sorted(APP.rglob("*.js")) if path.parent != GERMAN]
    return [(path, read_module(path.read_text())) for path in paths]


def entries(path: Path) -> list[tuple[str, str]]:
    """English and German of one part of the catalogue."""
    found = [(json.loads(english), json.loads(german)) for english, german in ENTRY.findall(path.read_text())]
    assert len(found) == len(re.findall(r'^  "', path.read_text(), re.MULTILINE)), (
        f"{path}: a line that is no entry"
    )
    return found


REPORTED = {
    english: german
    for name in ("autopilot.js", "checks.js", "refusals.js", "reported.js")
    for english, german in entries(GERMAN / name)
}
CATALOGUE = [entry for path in sorted(GERMAN.glob("*.js")) for entry in entries(path)]


def is_said(literal: Literal) -> bool:
    return SAID.search(literal.before) is not None


def said() -> set[str]:
    return {literal.text for _, module in modules() for literal in module.literals if is_said(literal)}


@functools.cache
def others_say() -> str:
    """What the program says, its literals put together, what its check of values says, and the system."""
    source = "\n".join(path.read_text() for path in ROOT.rglob("*.py"))
    joined = re.sub(r'"\s*\n\s*f?"', "", source).replace("{{", "{").replace("}}", "}")
    return "\n".join([joined, *value_mistakes(), *map(os.strerror, errno.errorcode)])


def is_reported(text: str) -> bool:
    """Whether drone or station say so: as it stands, or each part between its figures."""
    parts = (part.strip(" ,;:()") for part in PLACE.split(text))
    return all(part in others_say() or part.replace(" ", "_") in others_say() for part in parts)


def test_every_text_of_the_pages_has_its_german() -> None:
    assert said() - {english for english, _ in CATALOGUE} == set()


def test_no_text_stands_in_the_catalogue_that_nobody_says_nor_one_twice() -> None:
    unsaid = {english for english, _ in CATALOGUE} - said()
    assert unsaid - set(REPORTED) == set()
    assert {text for text in unsaid if not is_reported(text)} == COMPOSED
    assert [text for text, times in Counter(english for english, _ in CATALOGUE).items() if times > 1] == []


def test_the_german_has_the_figures_of_the_english_and_is_german() -> None:
    wrong = [one for one in CATALOGUE if set(PLACE.findall(one[0])) != set(PLACE.findall(one[1]))]
    assert wrong == []
    assert {english for english, german in CATALOGUE if english == german} == SAME
    assert [german for english, german in CATALOGUE if german.count("|") > english.count("|")] == []


def test_what_stays_english_is_still_said_and_where_refusals_come_from_is_there() -> None:
    assert set(STAYS_ENGLISH) - {one.text for one in refused_texts()} == set()
    assert [one for one in (*SOURCES, *NO_PAGE) if not (ROOT / one).exists()] == []
    assert [one for one in NO_PAGE if not one.startswith(SOURCES)] == []


def test_what_is_kept_with_figures_in_it_is_matched_as_what_is_reported() -> None:
    kept = {
        literal.text
        for path, module in modules()
        for literal in module.literals
        if literal.before.endswith("english(")
        and FILLED.match(path.read_text(), literal.start - len("english("))
    }
    assert kept
    assert {text for text in kept if PLACE.search(text)} - set(REPORTED) == set()


def test_nothing_is_shown_that_is_not_looked_up() -> None:
    bare = [
        (path.name, " ".join(shown.text.split()))
        for path, module in modules()
        for shown in module.shown
        if NO_TEXTS.fullmatch(re.sub(r'^[\w-]+="|"$', "", shown.text.strip())) is None
    ]
    assert bare == []
    loose = [
        (path.name, literal.text)
        for path, module in modules()
        for literal in module.literals
        if WORDS.search(literal.text) and not is_said(literal) and NO_TEXTS.fullmatch(literal.text) is None
    ]
    assert loose == []


def test_one_who_reads_english_fetches_no_german() -> None:
    fetched = [
        path.name for path in APP.rglob("*.js") if "german/" in path.read_text() and path.parent != GERMAN
    ]
    assert fetched == ["language.js"]
    text = (APP / "language.js").read_text()
    assert 'await import("./german/catalogue.js")' in text
    assert sum(len(gzip.compress(path.read_bytes())) for path in GERMAN.glob("*.js")) < 63_000
