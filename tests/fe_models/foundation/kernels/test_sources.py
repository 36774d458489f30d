"""What kernels are made of decides whether their cache holds: no change of a source runs with stale code."""

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from fe_models.foundation.kernels.sources import PACKAGES, digests, source_files, syntax_of
from tests.root import ROOT

ENTRY = "floatframe.engine.kernels.entry"


def source_digest(module: str, root: Path = ROOT) -> int:
    return digests(module, root)[0]


def copy_of_sources(root: Path) -> Path:
    """Copy the modules of the project into a folder."""
    for package in PACKAGES:
        shutil.copytree(ROOT / package, root / package, ignore=lambda folder, names: [
            name for name in names if name == "__pycache__" or ("." in name and not name.endswith((".py", ".pyi")))
        ])  # fmt: skip
    return root


def rooms_of_kernels() -> list[Path]:
    kernels = ROOT / "floatframe" / "engine" / "kernels"
    return [kernels, *sorted(path for path in kernels.rglob("*") if (path / "__init__.py").is_file())]


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    return copy_of_sources(tmp_path_factory.mktemp("copy"))


FAR = [  # outside the folder of the kernels, which take codes from there
    "floatframe/model/joints/rows/kinds.py",
    "floatframe/model/functions/expressions.py",
    "floatframe/engine/kernels/model.py",
]


def first_module(room: Path) -> str:
    found = next(path for path in source_files(ENTRY) if path.parent == room and path.name != "__init__.py")
    return found.relative_to(ROOT).as_posix()


ROOMS = [first_module(room) for room in rooms_of_kernels()]


@pytest.mark.parametrize("name", sorted({*ROOMS, *FAR}))
def test_the_digest_sees_a_change_in_every_room_and_where_codes_come_from(copy, name):
    before = source_digest(ENTRY, root=copy)
    assert before == source_digest(ENTRY)  # the copy is faithful
    path = copy / name
    text = path.read_text()
    try:
        path.write_text(with_another_name(text))
        assert source_digest(ENTRY, root=copy) != before
        path.write_text(text.replace('"""', '"""In other words.\n\n', 1) + "\n\n# a comment\n")
        assert source_digest(ENTRY, root=copy) == before
    finally:
        path.write_text(text)
    assert source_digest(ENTRY, root=copy) == before


def with_another_name(text: str) -> str:
    """Return a source whose last name is another one."""
    last = max((node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Name)), key=place_of)
    lines = text.splitlines()
    row, column = place_of(last)
    lines[row - 1] = f"{lines[row - 1][:column]}other_{lines[row - 1][column:]}"
    return "\n".join(lines)


def place_of(node: ast.Name) -> tuple[int, int]:
    return node.lineno, node.col_offset


SOURCE = """
'A module.'
A = 1.0  # m

def law(x, y=2.0):
    'Return a force.'
    if x > 0.0:
        'no docstring'
        return A * x - y
    return 0.0
"""


@pytest.mark.parametrize(("old", "new"), [
    ("A module.", "Another."), ("Return a force.", "Return a moment."), ("# m", "# mm\n\n# more"), ("# m", ""),
    ("    'Return a force.'\n", ""), ("A * x - y", "(A * x\n                - y)"), ("2.0):", "2.0,):"),
])  # fmt: skip
def test_words_about_a_source_make_no_difference(old, new):
    assert old in SOURCE
    assert syntax_of(SOURCE.replace(old, new).encode()) == syntax_of(SOURCE.encode())


@pytest.mark.parametrize(("old", "new"), [
    ("1.0", "2.0"), ("1.0", "1"), ("A * x - y", "A * x + y"), ("x > 0.0", "x >= 0.0"), ("y=2.0", "y=3.0"),
    ("    return 0.0", "        return 0.0"), ("no docstring", "no words"), ("def law", "@small\ndef law"),
    ("A *", "-A *"),
])  # fmt: skip
def test_every_change_of_the_syntax_counts(old, new):
    assert old in SOURCE
    assert syntax_of(SOURCE.replace(old, new, 1).encode()) != syntax_of(SOURCE.encode())


def test_a_record_that_cannot_be_read_or_written_leaves_the_sources_as_they_are(tmp_path):
    """A half-written record is made again; with no folder for one, comments count too."""
    (tmp_path / "floatframe").mkdir()
    module = tmp_path / "floatframe" / "kernel.py"
    module.write_text("A = 1  # m\n")
    key = source_digest("floatframe.kernel", root=tmp_path)
    (record,) = (tmp_path / "floatframe" / "__pycache__").iterdir()
    record.write_text(record.read_text().split()[0])
    assert source_digest("floatframe.kernel", root=tmp_path) == key
    module.write_text("A = 1  # mm\n")
    assert source_digest("floatframe.kernel", root=tmp_path) == key
    record.unlink()
    record.parent.rmdir()
    record.parent.write_text("no folder")
    of_mm = source_digest("floatframe.kernel", root=tmp_path)
    module.write_text("A = 1  # m\n")
    assert len({key, of_mm, source_digest("floatframe.kernel", root=tmp_path)}) == 3


def test_the_digest_does_not_change_with_what_kernels_do_not_import(copy):
    before = source_digest(ENTRY, root=copy)
    (copy / "floatframe" / "results" / "trajectory.py").write_text("")
    assert source_digest(ENTRY, root=copy) == before


def test_imports_are_found_as_python_reads_them():
    """Against Python's own parser, for every module of the project that kernels reach."""
    known, left = set(), [ENTRY]
    while left:
        place = ROOT.joinpath(*left.pop().split("."))
        for path in (place.with_suffix(".py"), place / "__init__.py"):
            if not path.is_file() or path in known:
                continue
            known.add(path)
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.Import):
                    left += [alias.name for alias in node.names]
                elif isinstance(node, ast.ImportFrom):
                    assert node.level == 0, f"{path}: relative imports are not found by the digest"
                    left += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
            left = [name for name in left if name.split(".")[0] in PACKAGES]
    assert source_files(ENTRY) == sorted(known)
    assert ROOT / "floatframe" / "model" / "joints" / "rows" / "kinds.py" in known
    assert ROOT / "floatframe" / "model" / "functions" / "expressions.py" in known


KERNEL = """
import importlib.util, sys
from numba import njit
from pathlib import Path
spec = importlib.util.spec_from_file_location("sources", sys.argv[1])
sources = importlib.util.module_from_spec(spec)
spec.loader.exec_module(sources)
from floatframe.codes import ADD, SUBTRACT

def make(digest):
    def run(code, x, y):
        if digest == 0:
            return 0.0
        if code == ADD:
            return x + y
        return x - y
    return njit(run, cache=True)

run = make(sources.digests("floatframe.kernel", root=Path(__file__).parents[1])[0])
print(run(ADD, 1.5, 1.0), sum(run.stats.cache_hits.values()))
"""


def test_codes_that_change_elsewhere_reach_a_cached_function(tmp_path):
    """Without the digest of what is imported the second run would take 1.5 - 1.0 from the cache."""
    folder = tmp_path / "floatframe"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    (folder / "kernel.py").write_text(KERNEL)
    (folder / "codes.py").write_text("ADD, SUBTRACT = 1, 2\n")
    sources = ROOT / "fe_models" / "foundation" / "kernels" / "sources.py"

    def run() -> str:
        command = [sys.executable, "-m", "floatframe.kernel", str(sources)]
        environment = {**os.environ, "PYTHONPATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
        return done.stdout

    assert run() == "2.5 0\n"
    (folder / "codes.py").write_text('"""Codes."""\n\nADD, SUBTRACT = 1, 2  # of operations\n')
    assert run() == "2.5 1\n"  # warm: words compile nothing
    (folder / "codes.py").write_text("SUBTRACT, ADD = 1, 2\n")
    assert run() == "2.5 0\n"


MOTION = """
import numpy as np
import floatframe as ff
guide = ff.PrismaticJoint("guide", ff.GROUND, ff.Marker("block"), axis=(1, 0, 0))
push = ff.UserForce("push", {"x": ff.joints.JointCoordinate("guide", "distance")}, {"x": "1.5 + exp(0 * t)"})
system = ff.System([ff.RigidBody("block", 1.0, np.eye(3))], [guide], [push])
print(f"{ff.integrate(system, ff.integrators.trapezoidal(), 2**0.5, 0.1).body('block').r[-1, 0]:.9g}")
"""


@pytest.mark.long
def test_a_warm_cache_does_not_outlive_the_codes_of_expressions(tmp_path):
    """x = F t²/2 = 2.5 with F = 1.5 + 1 at t² = 2; kernels with codes of yesterday find 1.5 - 1."""
    copy_of_sources(tmp_path)

    def run() -> str:
        environment = {**os.environ, "PYTHONPATH": str(tmp_path), "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
        command = [sys.executable, "-c", MOTION]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
        return done.stdout

    assert run() == "2.5\n"
    codes = tmp_path / "floatframe" / "model" / "functions" / "expressions.py"
    text = codes.read_text()
    assert "ADD, SUBTRACT, MULTIPLY" in text
    codes.write_text(text.replace("ADD, SUBTRACT, MULTIPLY", "SUBTRACT, ADD, MULTIPLY", 1))
    assert run() == "2.5\n"
