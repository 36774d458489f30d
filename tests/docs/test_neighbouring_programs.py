"""Pages for users of neighbouring programs: their files and commands work in order, and print what the pages show."""

import pytest

from tests.docs.tutorials import blocks, walk_of

PAGES = ("abaqus", "cad", "co_simulation", "exudyn", "matlab", "mbdyn", "openfast", "simulink")


@pytest.mark.parametrize("page", PAGES)
def test_the_commands_of_the_page_work_and_print_what_it_shows(page, tmp_path):
    assert any(language == "text" and not remark for remark, language, _ in blocks(page))
    folder = tmp_path / "empty"
    folder.mkdir()
    walk = walk_of(page, folder)
    assert list(walk.missing) == []
    assert "fault of the program" not in walk.said
