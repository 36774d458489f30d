"""Which compiler makes the kernels, what is said about it, and the oldest numba."""

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numba
import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.engine.kernels.compiler.choice import CHOICES, KNOWN_VERSIONS, VARIABLE
from tests.__main__ import GROUPS, KERNELS, PLAIN, PLAIN_MOTIONS, environment
from tests.root import ROOT

CODE = "from floatframe.engine.kernels.compiler.choice import is_lean, words; print(is_lean, words())"


def said(compiler: str, version: str = numba.__version__, code: str = CODE) -> subprocess.CompletedProcess[str]:
    """Return what a process says that is told to take a compiler, with a numba of that version."""
    code = f"import numba; numba.__version__ = {version!r}; {code}"
    environment = {**os.environ, "PYTHONPATH": str(ROOT), VARIABLE: compiler}
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=False)


def test_the_lean_compiler_serves_the_numba_it_knows():
    done = said("", f"{KNOWN_VERSIONS[0]}.7")
    assert done.stdout == f"True lean, with numba {KNOWN_VERSIONS[0]}.7\n", done.stderr


@pytest.mark.parametrize("version", ["0.60.0", "0.99.1", "1.0.0rc1"])
def test_any_other_numba_compiles_plainly_and_says_why(version):
    known = ", ".join(KNOWN_VERSIONS)
    words = f"False plain, with numba {version} (the faster lean compiler needs numba {known})\n"
    assert said("", version).stdout == words


def test_the_switch_takes_the_plain_compiler():
    words = f"False plain, with numba {KNOWN_VERSIONS[0]}.0 (requested by {VARIABLE})\n"
    assert said("plain", f"{KNOWN_VERSIONS[0]}.0").stdout == words


KEY = "from floatframe.engine.kernels.entry import absolute_kernels; print(absolute_kernels.compiled._cache.own.words)"


def test_the_key_of_stored_code_tells_the_compilers_apart():
    lean, plain = (said(compiler, code=KEY) for compiler in ("lean", "plain"))
    assert lean.returncode == plain.returncode == 0, lean.stderr + plain.stderr
    assert lean.stdout != plain.stdout


MOTION = """
import numpy as np
from floatframe import GeneralizedAlpha, Gravity, RigidBody, System, integrate
from floatframe.engine.kernels.compiler.choice import level, words
from floatframe.engine.kernels.entry import absolute_kernels
body = RigidBody("top", 2.0, np.diag([0.1, 0.2, 0.25]), (0.1, 0.2, 0.3), position=(1, 2, 3), omega_B=(3, -2, 5))
motion = integrate(System([body], forces=[Gravity((0.1, 0, -9.81))]), GeneralizedAlpha(), 0.1, 1e-2)
print(words(), level)
print(absolute_kernels.compiled._cache.own.words)
print(*motion.body("top").p[-1])
"""


def moved(level: str) -> list[str]:
    """Return the compiler, the key of its code and the last orientation of a top, at a level of optimisation."""
    known = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_OPT": level}
    command = [sys.executable, "-W", "error", "-c", MOTION]  # numba warns where code cannot be stored
    done = subprocess.run(command, capture_output=True, text=True, env=known, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_kernels_that_are_not_optimised_move_alike_and_are_stored_apart():
    """`NUMBA_OPT=0` shortens the wait after an edited kernel line."""
    (fast, key, expected), (slow, other, orientation) = moved("3"), moved("0")
    assert fast.startswith("lean")
    assert (fast[-2:], slow) == (" 3", f"{fast[:-1]}0")
    assert key != other
    assert_allclose(np.array(orientation.split(), float), np.array(expected.split(), float), rtol=1e-11)


@pytest.mark.parametrize(
    ("compiler", "version", "words"),
    [("lean", "0.60.0", "the lean compiler supports numba .* but 0.60.0 is installed"), ("fast", "0.68.0", "'fast'")],
)
def test_what_cannot_serve_is_refused(compiler, version, words):
    done = said(compiler, version)
    last = done.stderr.splitlines()[-1]
    assert done.returncode != 0
    assert VARIABLE in last
    assert re.search(words, last), last


def test_the_project_sets_no_upper_bound_of_numba():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert [line for line in project["dependencies"] if line.startswith("numba")] == ["numba>=0.60"]


OLDEST = "numba==0.60.*"
PACKAGES = ("numpy", "scipy", "h5py", "pydantic", "tomlkit", "threadpoolctl", "typer", "rich",
            "scikit-fem", "meshio", "matplotlib", "pytest", "hypothesis")  # fmt: skip
TESTS = ("tests/floatframe/integrators/test_pendulum.py", "tests/floatframe/engine/kernels/test_arrays.py")


@pytest.mark.long
def test_the_pendulum_moves_with_the_oldest_numba(tmp_path):
    """In an environment of its own, with the numpy that this numba wants; some minutes of compilation."""
    subprocess.run([sys.executable, "-m", "venv", str(tmp_path / "env")], check=True)
    python = tmp_path / "env" / "bin" / "python"
    subprocess.run([python, "-m", "pip", "install", "-q", OLDEST, *PACKAGES], check=True)
    version = subprocess.run([python, "-c", "import numba; print(numba.__version__)"], capture_output=True, text=True)
    assert version.stdout.startswith("0.60.")
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    environment.pop(VARIABLE, None)
    command = [python, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-m", "not long", *TESTS]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-3000:]
    assert "passed" in done.stdout
    assert "skipped" not in done.stdout


@pytest.mark.parametrize(
    ("group", "check", "path"),
    [
        ("ci", PLAIN, "tests/floatframe/engine/kernels/test_dense.py"),
        ("long", PLAIN_MOTIONS, "tests/floatframe/integrators/test_pendulum.py"),
        ("long", PLAIN_MOTIONS, "tests/floatframe/engine/kernels"),
    ],
)
def test_small_kernels_are_compiled_plainly_at_every_change_and_motions_in_the_long_group(group, check, path):
    """By a variable that these checks alone have, and with tests that exist."""
    assert any(check in stage for stage in GROUPS[group].stages)
    assert environment(check)[VARIABLE] == "plain"
    assert path in check
    assert all(Path(ROOT / word).exists() for word in check if word.startswith("tests/"))


def test_other_checks_compile_as_the_user_does():
    assert environment(KERNELS).get(VARIABLE) == os.environ.get(VARIABLE)
    assert set(CHOICES) == {"lean", "plain", "interpreted"}
