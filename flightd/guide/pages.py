"""The guide's pages: which there are, what each is about, and where a word stands in them."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).parent

TOPICS = (
    "first-flight",
    "your-warehouse",
    "counting",
    "real-drone",
    "cameras",
    "service",
    "ground-station",
    "store",
    "exchange",
    "fleet",
    "ground-link",
    "hazards",
    "safety-case",
    "troubleshooting",
    "configuration",
    "commands",
    "glossary",
    "simulation",
    "vision",
    "architecture",
    "contributing",
)
"""In reading order; each is the file `TOPIC.md` of this folder."""

_COMMENT = re.compile(r"^<!--.*?-->\n", re.DOTALL | re.MULTILINE)
_HEADING = re.compile(r"^#+ ")


@dataclass(frozen=True, slots=True)
class GuidePage:
    """One page: `summary` is the sentence below its title, `text` the Markdown without its comments."""

    topic: str
    title: str
    summary: str
    text: str


@dataclass(frozen=True, slots=True)
class Hit:
    """A line of a page that holds what was searched for, and the heading it stands under."""

    topic: str
    heading: str
    line: str


def page(topic: str) -> GuidePage:
    """The page on `topic`, one of TOPICS."""
    text = _COMMENT.sub("", (FOLDER / f"{topic}.md").read_text(encoding="utf-8"))
    title, summary, *_ = (block.strip() for block in text.split("\n\n"))
    return GuidePage(topic, _HEADING.sub("", title), " ".join(summary.split()), text)


def pages() -> list[GuidePage]:
    """Every page, in reading order."""
    return [page(topic) for topic in TOPICS]


def nearest(topic: str) -> list[str]:
    """The topics whose names are most like `topic`, best first; none where nothing is like it."""
    inside = [name for name in TOPICS if topic and (topic in name or name in topic)]
    alike = difflib.get_close_matches(topic, TOPICS, n=3, cutoff=0.5)
    return list(dict.fromkeys([*inside, *alike]))[:3]


def search(word: str) -> Iterator[Hit]:
    """Every line that holds `word`, capitals or not."""
    wanted = word.casefold()
    for found in pages():
        heading, in_block = found.title, False
        for line in found.text.splitlines():
            in_block ^= line.startswith("```")
            if not in_block and _HEADING.match(line):
                heading = _HEADING.sub("", line)
            if wanted in line.casefold():
                yield Hit(found.topic, heading, line.strip())
