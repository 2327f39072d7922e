"""A page of the guide as HTML for the station's page: no raw HTML, links and pictures the station's own."""

from __future__ import annotations

import itertools
import re
import threading
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from urllib.parse import urlsplit

from markdown_it import MarkdownIt
from markdown_it.common.utils import escapeHtml
from markdown_it.token import Token

from flightd.guide.pages import FOLDER, TOPICS, page

START = "index"
"""The page that leads to the others."""
PICTURES = "/api/guide/pictures/"
_PAGE = re.compile(r"(?P<topic>[a-z0-9-]+)\.md")
_ALIGNED = re.compile(r"text-align:(left|right|center)")
_CELL, _ROW = "·", "/"
"""Between the cells and the rows of a table."""
_NO_WORD = re.compile(r"[^\w\- ]")
_RENDERING = threading.Lock()
"""The libraries fill tables at their first use that another thread must not see half full."""


@dataclass(frozen=True, slots=True)
class Heading:
    """A heading below the page's title; `level` is 2 and more, as in the Markdown."""

    id: str
    text: str
    level: int


@dataclass(frozen=True, slots=True)
class Section:
    """What stands under one heading: its words without any mark-up."""

    heading: str
    id: str
    text: str


@dataclass(frozen=True, slots=True)
class RenderedPage:
    """A page of the guide.  In `html` headings are one level down: the station's page has its own first."""

    topic: str
    title: str
    html: str
    headings: tuple[Heading, ...]
    sections: tuple[Section, ...]


def topics() -> tuple[str, ...]:
    """Every page in reading order, the start first."""
    return (START, *TOPICS)


@cache
def rendered(topic: str) -> RenderedPage:
    """The page on `topic`, one of `topics()`.  From any thread."""
    found = page(topic)
    with _RENDERING:
        parser = _parser()
        tokens = parser.parse(found.text)
        headings = tuple(_named(tokens))
        sections = tuple(_sections(tokens, found.title))
        for token in _all(tokens):
            _adapt(token)
        html = str(parser.renderer.render(tokens, parser.options, {}))
    return RenderedPage(topic, found.title, html, headings, sections)


def _parser() -> MarkdownIt:
    parser = MarkdownIt("commonmark", {"html": False, "linkify": False}).enable("table")
    parser.add_render_rule("table_open", _table_open)
    parser.add_render_rule("table_close", _table_close)
    for kind in ("fence", "code_block"):
        parser.add_render_rule(kind, _code)
    return parser


def _table_open(*_: object) -> str:
    return '<div class="scroll" tabindex="0"><table>\n'


def _table_close(*_: object) -> str:
    return "</table></div>\n"


def _code(_renderer: object, tokens: list[Token], place: int, *_: object) -> str:
    """A block of code that can be scrolled by keyboard."""
    return f'<pre tabindex="0"><code>{escapeHtml(tokens[place].content)}</code></pre>\n'


def _all(tokens: Iterable[Token]) -> Iterator[Token]:
    for token in tokens:
        yield token
        yield from _all(token.children or ())


def _named(tokens: list[Token]) -> Iterator[Heading]:
    """Give each heading its id; those below the title."""
    taken: dict[str, int] = {}
    for token, content in itertools.pairwise(tokens):
        if token.type != "heading_open":
            continue
        text, level = _plain(content), int(token.tag[1:])
        slug = _NO_WORD.sub("", text.lower()).strip().replace(" ", "-")
        taken[slug] = taken.get(slug, 0) + 1
        name = slug if taken[slug] == 1 else f"{slug}_{taken[slug] - 1}"
        token.attrSet("id", name)
        if level > 1:
            yield Heading(name, text, level)


def _sections(tokens: list[Token], title: str) -> Iterator[Section]:
    heading, name, words = title, "", list[str]()
    within_heading = False
    for token in tokens:
        if token.type == "heading_open":
            yield Section(heading, name, " ".join(words))
            words, within_heading, name = [], True, str(token.attrGet("id") or "")
        elif token.type == "heading_close":
            within_heading = False
        elif token.type == "inline" and within_heading:
            heading = _plain(token)
        elif token.type in {"inline", "fence", "code_block"}:
            words.append(" ".join(_plain(token).split()))
        elif token.type in {"td_close", "th_close"}:
            words.append(_CELL)
        elif token.type == "tr_close" and words[-1:] == [_CELL]:
            words[-1] = _ROW
    yield Section(heading, name, " ".join(words))


def _plain(token: Token) -> str:
    if not token.children:
        return token.content
    kept = (child.content if child.type in {"text", "code_inline"} else " " for child in token.children)
    return " ".join("".join(kept).split())


def _adapt(token: Token) -> None:
    """Make a token the station's: its links, pictures, levels and alignments."""
    if token.type in {"heading_open", "heading_close"}:
        token.tag = f"h{min(int(token.tag[1:]) + 1, 6)}"
    elif token.type == "link_open":
        _adapt_link(token)
    elif token.type == "image":
        source = str(token.attrGet("src") or "")
        token.attrSet("src", PICTURES + source.removeprefix("pictures/"))
        token.attrSet("loading", "lazy")
    elif token.type in {"th_open", "td_open"} and (style := token.attrs.pop("style", None)):
        aligned = _ALIGNED.search(str(style))
        if aligned:  # a style in the mark-up is forbidden by the station's own policy
            token.attrSet("class", f"to-{aligned[1]}")


def _adapt_link(token: Token) -> None:
    target = str(token.attrGet("href") or "")
    parts = urlsplit(target)
    inner = _PAGE.fullmatch(parts.path)
    if parts.scheme or parts.netloc:
        token.attrSet("target", "_blank")
        token.attrSet("rel", "noopener noreferrer")
    elif inner is not None:
        below = "" if inner["topic"] == START else f"/{inner['topic']}"
        token.attrSet("href", f"/guide{below}" + (f"#{parts.fragment}" if parts.fragment else ""))


def picture_folder() -> str:
    """Where the guide's pictures lie."""
    return str(FOLDER / "pictures")
