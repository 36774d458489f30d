"""Code that comes with a package runs where it fits, and nowhere else; otherwise the function is compiled."""

import os
import platform
import shutil
import subprocess
import sys
from math import sin
from pathlib import Path

import pytest

from tests.root import ROOT

pytestmark = pytest.mark.skipif(platform.machine() != "x86_64", reason="families of other processors are not shipped")

KERNEL = """
import math
from fe_models.foundation.kernels.jit import jit
from floatframe.codes import FACTOR

@jit
def scaled(x):
    return FACTOR * x + math.sin(x)
"""

#: prints the value, whether it was compiled, and what came with the package
RUN = """
import sys
import numba
from pathlib import Path
from numba.core.event import install_recorder
numba.__version__ = sys.argv[2] or numba.__version__
from fe_models.foundation.kernels import jit
jit.write_into = Path(sys.argv[1]) if sys.argv[1] else None
from floatframe.kernel import scaled
with install_recorder("numba:compile") as recorder:
    value = scaled(2.0)
print(value, len(recorder.buffer) > 0, *jit.came_with_package)
"""
SHIPPED = "fe_models/compiled"
COMPILED, FROM_PACKAGE = ("True",), ("False", "floatframe.kernel.scaled")
VALUE = 3.0 * 2.0 + sin(2.0)


def call(folder: Path, into: str = "", version: str = "", **settings: str) -> tuple[float, tuple[str, ...]]:
    """Return the value of the function in a package, and where its code came from; a process of its own."""
    environment = {**os.environ, "PYTHONPATH": str(folder), "NUMBA_CACHE_DIR": str(folder / "cache")}
    environment |= {"PYTHONDONTWRITEBYTECODE": "1", **settings}
    command = [sys.executable, "-c", RUN, into, version]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    value, *words = done.stdout.split()
    return float(value), tuple(words)


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Return a folder with a package of one kernel and its code for the family of all processors with AVX2."""
    folder = tmp_path_factory.mktemp("built")
    kernels = folder / "fe_models" / "foundation" / "kernels"
    shutil.copytree(ROOT / "fe_models" / "foundation" / "kernels", kernels, ignore=shutil.ignore_patterns("__pyc*"))
    (folder / "floatframe").mkdir()
    for package in ("floatframe", "fe_models", "fe_models/foundation"):
        (folder / package / "__init__.py").touch()  # otherwise installed packages are found before these
    (folder / "floatframe" / "kernel.py").write_text(KERNEL)
    (folder / "floatframe" / "codes.py").write_text("FACTOR = 3.0\n")
    family = {"NUMBA_CPU_NAME": "x86-64-v3", "NUMBA_CPU_FEATURES": "", "NUMBA_DISABLE_INTEL_SVML": "1"}
    assert call(folder, str(folder / SHIPPED), **family)[1] == COMPILED
    assert len(list((folder / SHIPPED / "x86-64-v3").iterdir())) == 1
    shutil.rmtree(folder / "cache")
    return folder


@pytest.fixture
def installed(built, tmp_path):
    """Return another folder with the package, as if it was installed on another machine."""
    folder = tmp_path / "another place"
    shutil.copytree(built, folder, ignore=shutil.ignore_patterns("__pyc*"))
    return folder


def test_code_that_came_with_the_package_needs_no_compilation(installed):
    for _ in range(2):
        value, source = call(installed)
        assert source == FROM_PACKAGE
        assert value == pytest.approx(VALUE, rel=1e-15)


@pytest.mark.parametrize(("name", "old", "new", "value"), [
    ("codes", "3.0", "4.0", VALUE + 2.0), ("kernel", "FACTOR * x +", "FACTOR * x -", 6.0 - sin(2.0)),
])  # fmt: skip
def test_an_edited_source_is_compiled(installed, name, old, new, value):
    """Of the function itself, or of a module that it imports."""
    path = installed / "floatframe" / f"{name}.py"
    text = path.read_text()
    path.write_text(text.replace(old, new))
    assert call(installed) == (pytest.approx(value, rel=1e-15), COMPILED)
    assert call(installed) == (pytest.approx(value, rel=1e-15), ("False",))  # from the cache of this machine
    path.write_text(text)
    assert call(installed) == (pytest.approx(VALUE, rel=1e-15), FROM_PACKAGE)


@pytest.mark.parametrize("place", [0, 40, 0.5, -1])
def test_a_damaged_file_is_not_used(installed, place):
    (path,) = (installed / SHIPPED / "x86-64-v3").iterdir()
    content = bytearray(path.read_bytes())
    content[int(place * len(content)) if isinstance(place, float) else place] ^= 1
    path.write_bytes(content)
    assert call(installed) == (pytest.approx(VALUE, rel=1e-15), COMPILED)


def test_a_file_without_its_end_is_not_used(installed):
    (path,) = (installed / SHIPPED / "x86-64-v3").iterdir()
    path.write_bytes(path.read_bytes()[:20])
    assert call(installed)[1] == COMPILED


def test_a_processor_without_the_instructions_compiles(installed):
    old = {"NUMBA_CPU_NAME": "x86-64-v2", "NUMBA_CPU_FEATURES": "+sse4.2,+popcnt"}
    assert call(installed, **old) == (pytest.approx(VALUE, rel=1e-15), COMPILED)


def test_code_of_a_family_whose_instructions_are_missing_is_left_alone(installed):
    """A file for processors with AVX-512 is not even read by one that has only AVX2."""
    (path,) = (installed / SHIPPED / "x86-64-v3").iterdir()
    (installed / SHIPPED / "x86-64-v4").mkdir()
    path.rename(installed / SHIPPED / "x86-64-v4" / path.name)
    haswell = "+avx,+avx2,+bmi,+bmi2,+cx16,+f16c,+fma,+lzcnt,+movbe,+popcnt,+sahf,+sse4.2,+xsave"
    assert call(installed, NUMBA_CPU_NAME="haswell", NUMBA_CPU_FEATURES=haswell)[1] == COMPILED


def test_another_version_of_numba_compiles(installed):
    assert call(installed, version="0.68.999")[1] == COMPILED


def test_another_level_of_optimisation_compiles(installed):
    assert call(installed, NUMBA_OPT="0")[1] == COMPILED


def test_without_a_folder_for_the_cache_the_code_still_comes_from_the_package(installed):
    (installed / "floatframe" / "__pycache__").write_text("no folder")
    nowhere = {"NUMBA_CACHE_DIR": "/dev/null/cache", "XDG_CACHE_HOME": "/dev/null"}
    assert call(installed, **nowhere)[1] == FROM_PACKAGE
    shutil.rmtree(installed / SHIPPED)
    assert call(installed, **nowhere) == (pytest.approx(VALUE, rel=1e-15), COMPILED)
