"""The page for newcomers: its files and commands work in their order, in an empty folder, and make its pictures.

`python -m tests.docs.test_getting_started` draws the pictures of the page anew.
"""

import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from tests.root import ROOT

PAGE = ROOT / "docs" / "getting_started.md"
BLOCK = re.compile(r"(?:<!-- ([^\n]+) -->\n)?```(sh|python|toml)\n(.*?)```", re.DOTALL)
MOST_WORDS = 1200


def blocks():
    """Yield (remark before the block, language, content) in the order of the page."""
    return [match.groups() for match in BLOCK.finditer(PAGE.read_text())]


def go_through(folder):
    """Write the files and run the commands of the page; return what the commands printed."""
    programs = folder.parent / "programs"
    programs.mkdir()
    for name, module in (("cms", "-m cms.cli"), ("floatframe", "-m floatframe.cli"), ("python", "")):
        (programs / name).write_text(f'#!/bin/sh\nexec "{sys.executable}" {module} "$@"\n')
        (programs / name).chmod(0o755)
    environment = os.environ | {"PATH": f"{programs}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT), "COLUMNS": "120"}
    said = ""
    for remark, language, content in blocks():
        if language != "sh":
            (folder / remark).write_text(content)
        elif remark != "not run":
            made = subprocess.run(
                ["bash", "-euo", "pipefail", "-c", content], cwd=folder, env=environment, capture_output=True,
                text=True, check=False,
            )  # fmt: skip
            assert made.returncode == 0, f"{content}{made.stdout[-2000:]}{made.stderr}"
            said += made.stdout + made.stderr
    return said


def pictures():
    """Return the files of the page's pictures, by the names that the commands give them."""
    named = re.findall(r"!\[[^\]]+\]\((getting_started_([a-z]+\.png))\)", PAGE.read_text())
    return {name: ROOT / "docs" / file for file, name in named}


def size_of(picture):
    """Return width and height of a PNG."""
    return struct.unpack(">II", picture.read_bytes()[16:24])


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    folder = tmp_path_factory.mktemp("newcomer") / "empty"
    folder.mkdir()
    return folder, go_through(folder)


def test_every_command_of_the_page_works_in_an_empty_folder(walk):
    folder, said = walk
    for name in ("arm.msh", "arm.h5", "swing.h5", "stiff.h5", "stiffness.csv"):
        assert (folder / name).stat().st_size > 0
    assert "swing passes" in said
    assert "fault of the program" not in said


def test_the_page_tells_the_results_of_its_commands(walk):
    folder, said = walk
    text = PAGE.read_text()
    mass = re.search(r"Check the mass in the output \(([0-9.]+) kg\)", text)[1]
    assert re.search(rf"mass +{mass}\d* kg", said)
    assert "'hinge.angle value': 'rad'" in said
    rows = [line.split(",") for line in (folder / "stiffness.csv").read_text().splitlines()[1:]]
    angles, stresses = ([float(row[k]) for row in rows] for k in (1, 2))
    assert angles == sorted(angles, reverse=True)
    assert stresses[1] < min(stresses[0], stresses[2])


def test_the_pictures_of_the_page_are_those_of_its_commands(walk):
    folder, _ = walk
    assert set(pictures()) == {"swing.png", "stiffness.png"}
    for name, shown in pictures().items():
        assert size_of(shown) == size_of(folder / name)


def test_the_page_is_short_and_names_every_file_that_it_asks_for():
    text = PAGE.read_text()
    assert len(text.split()) <= MOST_WORDS
    for remark, language, _ in blocks():
        assert language == "sh" or f"`{remark}`" in text


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        made = Path(name) / "empty"
        made.mkdir()
        go_through(made)
        for picture, target in pictures().items():
            shutil.copy(made / picture, target)
