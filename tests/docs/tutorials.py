"""Pages whose files and commands a reader goes through in their order, in an empty folder.

A page has blocks of `sh`, which are run, blocks with the name of a file in a remark before them, which are written, and
other blocks of `text`, which hold lines that the commands before them print. `python -m tests.docs.tutorials` draws the
pictures of all pages anew; `python -m tests.docs.tutorials tutorial_rotor` those of one page, and says what it prints.
"""

import contextlib
import importlib
import io
import json
import os
import re
import runpy
import shlex
import shutil
import struct
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from tests.root import ROOT

DOCS = ROOT / "docs"
PAGES = (
    "getting_started", "tutorial_body", "tutorial_vehicle", "tutorial_rotor", "tutorial_robot", "tutorial_element",
)  # fmt: skip
BLOCK = re.compile(r"(?:<!-- ([^\n]+) -->\n)?```(sh|python|toml|text)\n(.*?)```", re.DOTALL)
NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?")
PROGRAMS = ("cms", "floatframe")
ENVIRONMENT = os.environ | {"PYTHONPATH": str(ROOT), "COLUMNS": "120", "MPLBACKEND": "Agg"}
TOLERANCE = 0.05  #: of a number on a page: meshes and last digits depend on the versions of libraries


@dataclass(frozen=True)
class Walk:
    """What a page's commands left in a folder and printed."""

    folder: Path
    said: str
    missing: tuple[str, ...]  #: lines of the page that its commands did not print


def blocks(page):
    """Return (remark before the block, language, content) in the order of the page."""
    return [match.groups() for match in BLOCK.finditer((DOCS / f"{page}.md").read_text())]


def go_through(page, folder, run=None):
    """Write the files and run the commands of a page in an empty folder.

    `run(content, folder)` runs a block of commands and returns what it prints; default: `run_in_shell`.
    """
    said, last, missing = "", "", []
    for remark, language, content in blocks(page):
        if language == "text" and not remark:
            missing += [line for line in content.splitlines() if not is_printed(line, last)]
        elif language != "sh":
            (folder / remark).parent.mkdir(exist_ok=True)
            (folder / remark).write_text(content)
        elif remark != "not run":
            last = (run or run_in_shell)(content, folder)
            said += last
    return Walk(folder, said, tuple(missing))


def run_in_shell(content, folder):
    """Run commands as a reader does: each is a process."""
    programs = folder.parent / "programs"
    programs.mkdir(exist_ok=True)
    for name, module in (("cms", "-m cms.cli"), ("floatframe", "-m floatframe.cli"), ("python", "")):
        (programs / name).write_text(f'#!/bin/sh\nexec "{sys.executable}" {module} "$@"\n')
        (programs / name).chmod(0o755)
    environment = ENVIRONMENT | {"PATH": f"{programs}:{os.environ['PATH']}"}
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", content], cwd=folder, env=environment, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, f"{content}{done.stdout[-2000:]}{done.stderr}"
    return done.stdout + done.stderr


def run_here(content, folder):
    """Run commands in this process, one after another, which saves the imports of each."""
    out = io.StringIO()
    for words in map(shlex.split, content.splitlines()):
        sys.argv = words if words[0] in PROGRAMS else words[1:]
        try:
            with contextlib.chdir(folder), contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
                if words[0] in PROGRAMS:
                    importlib.import_module(f"{words[0]}.cli").main()
                else:
                    assert words[0] == "python", f"expected one of python, {', '.join(PROGRAMS)}, got {words[0]}"
                    runpy.run_path(words[1], run_name="__main__")
        except SystemExit as end:
            if end.code:
                raise RuntimeError(f"{shlex.join(words)}: {out.getvalue()}") from end
    return out.getvalue()


def walk_of(page, folder):
    """Go through a page in a process of its own, in which all commands run."""
    code = f"from tests.docs.tutorials import store_walk; store_walk({page!r}, {str(folder)!r})"
    done = subprocess.run([sys.executable, "-c", code], env=ENVIRONMENT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return Walk(folder, **json.loads(folder.with_suffix(".json").read_text()))


def store_walk(page, folder):
    """Go through a page in this process, and write what was printed beside the folder."""
    folder = Path(folder)
    sys.path.insert(0, str(folder))
    walk = go_through(page, folder, run_here)
    folder.with_suffix(".json").write_text(json.dumps({"said": walk.said, "missing": walk.missing}))


def is_printed(line, said):
    """Whether a line of a page is among those printed: the same words, and numbers within TOLERANCE."""
    words, numbers = parts(line)
    for printed in said.splitlines():
        found, values = parts(printed)
        if words == found and all(abs(a - b) <= TOLERANCE * abs(a) for a, b in zip(numbers, values, strict=True)):
            return True
    return False


def parts(line):
    """Return the words of a line with a mark for each number, and the numbers."""
    return NUMBER.sub("#", line).split(), [float(number) for number in NUMBER.findall(line)]


def pictures(page):
    """Return the files of a page's pictures, by the names that the commands give them."""
    named = re.findall(rf"!\[[^\]]+\]\(({page}_([a-z_]+\.png))\)", (DOCS / f"{page}.md").read_text())
    return {name: DOCS / file for file, name in named}


def size_of(picture):
    """Return width and height of a PNG."""
    return struct.unpack(">II", picture.read_bytes()[16:24])


def main(pages):
    """Go through pages, and store their pictures; print what the commands of a single page print."""
    for page in pages or PAGES:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name) / "empty"
            folder.mkdir()
            walk = walk_of(page, folder) if page != "getting_started" else go_through(page, folder)
            for picture, target in pictures(page).items():
                shutil.copy(folder / picture, target)
        print(walk.said if len(pages) == 1 else "", f"{page}: lines that were not printed: {walk.missing}", sep="")


if __name__ == "__main__":
    main(sys.argv[1:])
