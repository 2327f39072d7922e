"""The shipped guide as HTML, and the search over it."""

from __future__ import annotations

import re
import threading
from concurrent.futures import ThreadPoolExecutor
from urllib.parse import urlsplit

import pytest
from markdown_it import MarkdownIt

from flightd.ground.guide_pages import rendering
from flightd.ground.guide_pages.rendering import (
    PICTURES,
    RenderedPage,
    Section,
    picture_folder,
    rendered,
    topics,
)
from flightd.ground.guide_pages.search import GuideSearch, Hit
from flightd.guide.pages import FOLDER
from tests.rigs.event_loops import in_real_time
from tests.web.served import served


@pytest.fixture(scope="module")
def search() -> GuideSearch:
    return GuideSearch([rendered(topic) for topic in topics()])


def test_every_page_that_is_shipped_can_be_read() -> None:
    assert {f"{topic}.md" for topic in topics()} == {path.name for path in FOLDER.glob("*.md")}
    for topic in topics():
        page = rendered(topic)
        assert page.title
        assert page.html.startswith("<h2 ")


def test_pages_that_are_asked_for_at_once_are_rendered_one_after_the_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The Markdown library's tables, filled at their first use, are no other thread's to read meanwhile."""
    inside = threading.Semaphore(1)

    def parser() -> MarkdownIt:
        assert inside.acquire(blocking=False), "another page is being rendered"
        threading.Event().wait(0.01)
        inside.release()
        return MarkdownIt("commonmark")

    monkeypatch.setattr(rendering, "_parser", parser)
    with ThreadPoolExecutor(4) as threads:
        assert len(list(threads.map(rendered.__wrapped__, topics()[:4]))) == 4


@pytest.mark.parametrize("topic", topics())
def test_links_and_pictures_of_a_page_lead_somewhere(topic: str) -> None:
    page = rendered(topic)
    for link in re.findall(r'href="([^"]*)"', page.html):
        if link.startswith("http"):
            continue
        parts = urlsplit(link)
        other = parts.path.removeprefix("/guide").strip("/") or ("index" if parts.path else topic)
        assert other in topics(), link
        if parts.fragment:
            assert f'id="{parts.fragment}"' in rendered(other).html, link
    for source in re.findall(r'<img[^>]* src="([^"]*)"', page.html):
        assert source.startswith(PICTURES)
        assert (FOLDER / "pictures" / source.removeprefix(PICTURES)).is_file(), source


@pytest.mark.parametrize("topic", topics())
def test_nothing_of_a_page_is_forbidden_by_the_stations_own_policy(topic: str) -> None:
    html = rendered(topic).html
    assert " style=" not in html
    assert not re.search(r"<(script|iframe|object|style)|\bon[a-z]+=\"", html)


def test_raw_html_is_shown_and_never_run(tmp_path: object, monkeypatch: pytest.MonkeyPatch) -> None:
    from flightd.ground.guide_pages import rendering
    from flightd.guide.pages import GuidePage

    hostile = (
        "# T\n\nS.\n\n<script>alert(1)</script> <img src=x onerror=alert(1)>\n\n[a](javascript:alert(1))\n\n"
        "## <b>B</b>\n\n| a |\n|--:|\n| `<i>` |\n\n```sh\n<u>\n```\n"
    )
    monkeypatch.setattr(rendering, "page", lambda topic: GuidePage(topic, "T", "S.", hostile))
    html = rendering.rendered.__wrapped__("made-up").html
    assert not re.search(r"<(script|img|b|i|u)\b", html)
    assert "javascript:" not in re.sub(r">[^<]*<", "><", html)
    assert "&lt;script&gt;" in html
    assert 'class="to-right"' in html


def found(search: GuideSearch, query: str) -> list[Hit]:
    return search.find(query)


def test_a_page_about_it_comes_before_pages_that_mention_it(search: GuideSearch) -> None:
    assert found(search, "ground station")[0].topic == "ground-station"
    assert found(search, "battery")[0].heading == "[battery]"
    assert found(search, "flightd sim --seeds")[0].heading == "flightd sim"


@pytest.mark.parametrize("query", ["range finder", "RANGE  Finder", "finder range", "rang find"])
def test_every_word_has_to_be_there_from_its_beginning(query: str, search: GuideSearch) -> None:
    hits = found(search, query)
    assert hits
    for hit in hits:
        page = rendered(hit.topic)
        section = next(one for one in page.sections if one.id == hit.id)
        text = f"{page.title} {section.heading} {section.text}".casefold()
        assert "rang" in text
        assert "find" in text


def test_hits_show_the_words_in_their_context(search: GuideSearch) -> None:
    for hit in found(search, "charge pad"):
        marked = [text.casefold() for text, is_hit in hit.parts if is_hit]
        assert all(text in {"charge", "pad"} for text in marked)
        assert len("".join(text for text, _ in hit.parts)) < 300


@pytest.mark.parametrize("query", ["", "   ", "()[]*+?\\", "-- . -", "nosuchwordatall"])
def test_a_query_that_nothing_holds_finds_nothing(query: str, search: GuideSearch) -> None:
    assert found(search, query) == []


def test_letters_that_fold_to_several_do_not_move_the_marks() -> None:
    text = "ßßß İstanbul word " * 5 + "wanted here"
    page = RenderedPage("t", "Title", "", (), (Section("Heading", "h", text),))
    (hit,) = GuideSearch([page]).find("wanted")
    assert [text for text, is_hit in hit.parts if is_hit] == ["wanted"]


@in_real_time
async def test_pages_hits_and_pictures_are_served() -> None:
    async with served() as station:
        assert (await station.ask("GET", "/api/guide"))[0] == 200
        code, text = await station.ask("GET", "/api/guide/pages/hazards")
        assert code == 200
        assert "telemetry_stale" in text
        code, text = await station.ask("GET", "/api/guide/search?q=range%20finder")
        assert code == 200
        assert "range finder" in text
        assert (await station.ask("GET", f"/api/guide/search?q={'x' * 5000}"))[0] == 200
        assert (await station.ask("GET", "/api/guide/pages/nothing"))[0] == 404
        assert (await station.ask("GET", PICTURES + "layers.svg"))[0] == 200
    assert picture_folder().endswith("pictures")
