"""The page for newcomers: its files and commands work in their order, in an empty folder, and make its pictures."""

import re

import pytest

from tests.docs.tutorials import DOCS, blocks, go_through, pictures, size_of

PAGE = "getting_started"
MOST_WORDS = 1200


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    folder = tmp_path_factory.mktemp("newcomer") / "empty"
    folder.mkdir()
    return go_through(PAGE, folder)


def test_every_command_of_the_page_works_in_an_empty_folder(walk):
    for name in ("arm.msh", "arm.h5", "swing.h5", "stiff.h5", "stiffness.csv"):
        assert (walk.folder / name).stat().st_size > 0
    assert "swing passes" in walk.said
    assert "fault of the program" not in walk.said


def test_the_page_tells_the_results_of_its_commands(walk):
    text = (DOCS / f"{PAGE}.md").read_text()
    mass = re.search(r"Check the mass in the output \(([0-9.]+) kg\)", text)[1]
    assert re.search(rf"mass +{mass}\d* kg", walk.said)
    assert "'hinge.angle value': 'rad'" in walk.said
    rows = [line.split(",") for line in (walk.folder / "stiffness.csv").read_text().splitlines()[1:]]
    angles, stresses = ([float(row[k]) for row in rows] for k in (1, 2))
    assert angles == sorted(angles, reverse=True)
    assert stresses[1] < min(stresses[0], stresses[2])


def test_the_pictures_of_the_page_are_those_of_its_commands(walk):
    assert set(pictures(PAGE)) == {"swing.png", "stiffness.png"}
    for name, shown in pictures(PAGE).items():
        assert size_of(shown) == size_of(walk.folder / name)


def test_the_page_is_short_and_names_every_file_that_it_asks_for():
    text = (DOCS / f"{PAGE}.md").read_text()
    assert len(text.split()) <= MOST_WORDS
    for remark, language, _ in blocks(PAGE):
        assert language == "sh" or f"`{remark}`" in text
