"""Each tutorial: its files and commands work in their order, print what the page shows, and make its pictures."""

import re

import pytest

from tests.docs.tutorials import DOCS, PAGES, blocks, is_printed, pictures, size_of, walk_of

TUTORIALS = PAGES[1:]
MOST_WORDS = 1000  #: of prose; files and commands count apart


@pytest.mark.parametrize("page", TUTORIALS)
def test_a_tutorial_works_and_prints_and_draws_what_it_shows(page, tmp_path):
    folder = tmp_path / "empty"
    folder.mkdir()
    walk = walk_of(page, folder)
    assert list(walk.missing) == []
    assert "fault of the program" not in walk.said
    assert pictures(page)
    for name, shown in pictures(page).items():
        assert size_of(shown) == size_of(folder / name)


@pytest.mark.parametrize("page", PAGES)
def test_a_tutorial_is_short_and_ends_with_exercises_and_where_to_go(page):
    text = (DOCS / f"{page}.md").read_text()
    for remark, language, _ in blocks(page):
        assert not remark or language == "sh" or f"`{remark}`" in text
    assert len(re.sub(r"```.*?```", "", text, flags=re.DOTALL).split()) <= MOST_WORDS
    exercises, where = text.split("## Exercises\n")[1].split("## Where to go next\n")
    assert re.findall(r"^(\d)\. ", exercises, re.MULTILINE) == ["1", "2", "3"]
    assert len(re.findall(r"\]\(", where)) >= 3


def test_a_line_is_printed_if_its_words_are_the_same_and_its_numbers_close():
    said = " mass   1.571 kg\nfirst: 4 pass"
    assert is_printed("mass 1.570 kg", said)
    assert not is_printed("mass 1.7 kg", said)
    assert not is_printed("mass 1.571 t", said)
    assert not is_printed("mass", said)
