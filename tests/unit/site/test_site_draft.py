"""A site file that is edited keeps its comments and its form, and holds exactly what the editor says."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.core.errors import InputError
from flightd.site.file_blocks import same
from flightd.site.site_draft import Element, SiteDraft, draft_of, draft_text, keeps_comments, read_draft
from flightd.site.site_file import parse_site

CONFIGS = Path(__file__).parents[3] / "configs"
TEXT = """\
# The hall, measured in May.

[site]   # one a file
name = "hall"
ceiling_m = 6.0     # under the sprinklers

# the long one
[[aisle]]
id = "A"
x_m = 0.0
y_m = 0
spacing_m = [
    1.5,  # to the pillar
    1.2,
]
# beside the wall
shelves = ["left"]

# the short one
[[aisle]]
id = "B"
x_m = 0.0
y_m = 3.0     # from A, by tape
spacing_m = [1.5, 1.2]

[[cross]]
nodes = ["A1", "B1"]
# the charger
[[pad]]
id = "home"
node = "A1"
# end of file
"""


def edited(draft: SiteDraft, table: str, index: int, **values: Any) -> SiteDraft:
    elements = list(draft.lists[table])
    elements[index] = Element({**elements[index].values, **values}, elements[index].at)
    return SiteDraft(draft.site, {**draft.lists, table: tuple(elements)}, draft.text)


def test_what_nobody_changed_stays_as_it_is_byte_for_byte() -> None:
    for path in CONFIGS.glob("site-*.toml"):
        text = path.read_text()
        assert draft_text(read_draft(text, "x")) == text
    assert draft_text(read_draft(TEXT.replace("\n", "\r\n"), "x")) == TEXT.replace("\n", "\r\n")


def test_one_number_changes_one_line() -> None:
    text = draft_text(edited(read_draft(TEXT, "x"), "aisle", 1, y_m=3.25))
    assert text == TEXT.replace("y_m = 3.0     # from A, by tape", "y_m = 3.25     # from A, by tape")


def test_comments_between_numbers_and_beside_keys_stay() -> None:
    draft = edited(read_draft(TEXT, "x"), "aisle", 0, spacing_m=[1.5, 1.3, 2.0], shelf_height_m=4.0)
    text = draft_text(draft)
    assert "1.5,  # to the pillar" in text
    assert '# beside the wall\nshelves = ["left"]\nshelf_height_m = 4.0\n\n# the short one' in text
    assert tomllib.loads(text)["aisle"][0]["spacing_m"] == [1.5, 1.3, 2.0]


def test_a_table_goes_with_its_comments_and_leaves_the_others() -> None:
    draft = read_draft(TEXT, "x")
    without = SiteDraft(draft.site, {**draft.lists, "aisle": draft.lists["aisle"][:1], "cross": ()}, TEXT)
    text = draft_text(without)
    assert "the short one" not in text
    assert "from A" not in text
    assert all(words in text for words in ("the long one", "the charger", "end of file", "measured in May"))


def test_a_new_table_stands_behind_the_one_it_follows() -> None:
    draft = read_draft(TEXT, "x")
    new = Element({"id": "C", "x_m": 0.0, "y_m": 6.0, "spacing_m": [1.5, 1.2]})
    lists = {**draft.lists, "aisle": (*draft.lists["aisle"], new)}
    lists["marker"] = (Element({"id": 7, "dictionary": "4x4_50", "x_m": 0.7, "y_m": 0.8}),)
    text = draft_text(SiteDraft({**draft.site, "interlock": True}, lists, TEXT))
    assert '[[aisle]]\nid = "C"\nx_m = 0.0\ny_m = 6.0\nspacing_m = [1.5, 1.2]\n\n[[cross]]' in text
    assert text.endswith('# end of file\n\n[[marker]]\nid = 7\ndictionary = "4x4_50"\nx_m = 0.7\ny_m = 0.8\n')
    assert "# under the sprinklers\ninterlock = true\n" in text


def test_tables_in_another_order_take_their_comments_along() -> None:
    draft = read_draft(TEXT, "x")
    turned = SiteDraft(draft.site, {**draft.lists, "aisle": draft.lists["aisle"][::-1]}, TEXT)
    text = draft_text(turned)
    assert text.index("# the short one") < text.index("# the long one")
    assert [aisle["id"] for aisle in tomllib.loads(text)["aisle"]] == ["B", "A"]


def test_a_header_within_a_text_is_none() -> None:
    text = TEXT.replace('name = "hall"', 'name = """\nhall\n[[aisle]]\n"""')
    draft = edited(read_draft(text, "x"), "aisle", 1, y_m=4.0)
    assert draft_text(draft) == text.replace("3.0     #", "4.0     #")


def test_a_form_that_has_no_blocks_is_written_anew_and_says_so() -> None:
    aisle = '[[aisle]]\nid="A"\nx_m=0\ny_m=0\nspacing_m=[2]\n'
    text = f'# mine\nsite.name = "x"\npad = [{{id = "home", node = "A1"}}]\n{aisle}'
    draft = read_draft(text, "x")
    assert not keeps_comments(draft)
    new = draft_text(edited(draft, "aisle", 0, y_m=1.0))
    assert new.startswith("# mine\n")
    assert parse_site(new, "x").aisles[0].y_m == 1.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[site", "not valid TOML"),
        ("site = 3", "site: not written as [site]"),
        ("[[site]]\n", "site: not written as [site]"),
        ("[aisle]\n", r"aisle: not written as [[aisle]]"),
        ("[other]\n", "other: unknown table; known are site, aisle"),
        ("[site]\nname = 2026-01-01\n", "with plain values"),
        ("[site]\nceiling_m = inf\n", "with plain values"),
        ("a = " + "[" * 3000, "x: n"),
    ],
)
def test_what_is_no_site_file_is_refused_in_words(text: str, words: str) -> None:
    with pytest.raises(InputError) as refused:
        read_draft(text, "x")
    assert words in str(refused.value)


@pytest.mark.parametrize("at", [2, -1, 10**9])
def test_elements_that_were_none_of_the_text_are_refused(at: int) -> None:
    draft = read_draft(TEXT, "x")
    with pytest.raises(InputError):
        draft_text(SiteDraft(draft.site, {"aisle": (Element({"id": "Z"}, at),)}, TEXT))


_metres = st.floats(-1000, 1000).map(lambda value: round(value, 3))
_text = st.text(max_size=12).filter(lambda text: "\0" not in text)
_values = st.one_of(_metres, st.integers(-99, 99), st.booleans(), _text, st.lists(_metres, max_size=5))
_keys = st.sampled_from(["id", "x_m", "y_m", "spacing_m", "nodes", "new key", "ü"])
_tables = st.dictionaries(_keys, _values, max_size=5)


@given(data=st.data())
def test_any_edit_is_what_is_read_again_and_no_comment_of_a_kept_table_is_lost(data: st.DataObject) -> None:
    draft = read_draft(TEXT, "x")
    lists: dict[str, tuple[Element, ...]] = {}
    kept = {"measured in May"}
    words = {"aisle": ["the long one", "the short one"], "pad": ["the charger"], "cross": []}
    for name in ("aisle", "cross", "pad", "keep_out"):
        ats = data.draw(st.permutations(range(len(draft.lists[name]))))
        ats = ats[: data.draw(st.integers(0, len(ats)))]
        elements = [Element(data.draw(_tables | st.just(draft.lists[name][at].values)), at) for at in ats]
        for _ in range(data.draw(st.integers(0, 2))):
            elements.insert(data.draw(st.integers(0, len(elements))), Element(data.draw(_tables)))
        lists[name] = tuple(elements)
        kept |= {words[name][at] for at in ats if words.get(name)}
    new = SiteDraft(data.draw(_tables), lists, TEXT)
    text = draft_text(new)
    assert same(tomllib.loads(text), new.tables())
    assert [comment for comment in kept if comment not in text] == []
    again = read_draft(text, "x")
    assert draft_text(again) == text


def test_a_draft_of_nothing_is_written_in_the_files_own_order() -> None:
    tables = {"site": {"name": "n"}, "pad": [{"node": "A1", "id": "home"}], "aisle": [{"id": "A"}]}
    assert draft_text(draft_of(tables)) == (
        '[site]\nname = "n"\n\n[[aisle]]\nid = "A"\n\n[[pad]]\nid = "home"\nnode = "A1"\n'
    )
