"""The solver petsc on one, two and four ranks; `benchmarks/install_petsc.sh` sets it up (docs/cluster_mpi.md)."""

import json
import os
import shutil
import subprocess
import sys
from importlib.util import find_spec

import pytest

import cms
from tests.bodies import box_mesh
from tests.decks import JOB, write_deck

pytestmark = [
    pytest.mark.external,
    pytest.mark.skipif(
        find_spec("petsc4py") is None or find_spec("mpi4py") is None or shutil.which("mpirun") is None,
        reason="needs PETSc, SLEPc and MPI: sh benchmarks/install_petsc.sh .venv/bin/python",
    ),
]
MPIRUN = ["mpirun", "--allow-run-as-root", "--oversubscribe", "--bind-to", "none"]
ENVIRONMENT = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
REDUCE = [sys.executable, "-m", "cms.cli", "reduce"]
CLOSE = 1e-8
#: mode sets that take other columns than those of the factor: functions, a file, a tree of substructures
OTHERWISE = ("assumed-modes", "user-basis", "multilevel")
#: those that take K and M apart, for which rank 0 collects them
COLLECTED = ("multilevel",)


def on_ranks(n, *command):
    return subprocess.run([*MPIRUN, "-n", str(n), *map(str, command)], capture_output=True, text=True, env=ENVIRONMENT)


@pytest.mark.parametrize("n", [1, 2, 4])
def test_every_mode_set_is_that_of_one_process(n):
    done = on_ranks(n, sys.executable, "-m", "tests.external.rank_program")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.partition("RESULT ")[2])
    assert set(found) == set(cms.MODE_SETS)
    for name, row in found.items():
        assert max(row[key] for key in ("frequencies", "angle", "invariants", "response")) < CLOSE, (name, row)
        assert row["kept"] == 0, name  # on any rank, of what the set needed
        assert (row["collected"] > 0) == (n > 1 and name in COLLECTED), name
        if name in OTHERWISE:
            continue
        assert "MUMPS" in row["solver"], name
        assert ("ranks" in row["solver"]) == (n > 1), name


@pytest.fixture
def folder(tmp_path):
    write_deck(tmp_path / "bar.inp", box_mesh(24, 4, 4, 100.0, 10.0, 8.0))
    (tmp_path / "bar.toml").write_text(JOB)
    return tmp_path


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def errors_in(done):
    return [line for line in done.stderr.splitlines() if line.startswith("error: ")]


def test_the_command_is_the_same_and_rank_0_writes(folder):
    done = on_ranks(2, *REDUCE, folder / "bar.toml", "--solver", "petsc")
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("wrote ") == 1
    two, one = cms.read(folder / "bar.h5"), cms.reduce_job(folder / "bar.toml")
    assert "2 ranks" in two.provenance["mode set solver"]
    assert abs(two.free_frequencies / one.free_frequencies - 1).max() < CLOSE


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), "2 ranks, but the default solver works in one process; take --solver petsc"),
        (("--solver", "superlu"), "2 ranks, but solver superlu works in one process"),
        (("--solver", "petsc", "--workers", "2"), "2 ranks work on one job together"),
    ],
)
def test_what_ranks_cannot_do_is_told_once(folder, options, words):
    before = contents(folder)
    done = on_ranks(2, *REDUCE, folder / "bar.toml", *options)
    assert done.returncode == 2
    assert [words in line for line in errors_in(done)] == [True]
    assert contents(folder) == before


def test_ranks_with_other_jobs_are_refused_in_one_message(folder):
    (folder / "other.toml").write_text(JOB + "# another\n")
    before = contents(folder)
    other = [*REDUCE, folder / "other.toml", "--solver", "petsc"]
    done = on_ranks(1, *REDUCE, folder / "bar.toml", "--solver", "petsc", ":", "-n", "1", *other)
    assert done.returncode == 2
    assert len(errors_in(done)) == 1
    assert "rank 1 of 2 differs from rank 0: input 1: expected" in errors_in(done)[0]
    assert contents(folder) == before


def test_a_body_that_cannot_be_reduced_ends_all_ranks_with_one_message(folder):
    job = folder / "bar.toml"
    job.write_text(JOB.replace("n_modes", "n_modes = 100000 #", 1))
    before = contents(folder)
    done = on_ranks(2, *REDUCE, job, "--solver", "petsc")
    assert done.returncode == 2
    assert len(errors_in(done)) == 1
    assert contents(folder) == before


FAILING = """
import sys
import cms.linear_algebra.solvers.petsc.factor as factor
from cms.cli import main
from fe_models.foundation.ranks.mpi import all_ranks
kept = factor.solved_rows
def failing(ranks, *arguments):
    if ranks.rank == 1:
        {fault}
    return kept(ranks, *arguments)
factor.solved_rows = failing
sys.argv = ["cms", "reduce", sys.argv[1], "--solver", "petsc"]
main()
"""


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (
            "raise OSError(28, 'No space left on device')",
            "error: rank 1 of 2: OSError: [Errno 28] No space left",
        ),
        ("import os, signal; os.kill(os.getpid(), signal.SIGKILL)", "killed"),
    ],
)
def test_a_rank_that_fails_in_the_middle_ends_all_and_no_file_is_written(folder, fault, words):
    before = contents(folder)
    (script := folder.parent / "failing.py").write_text(FAILING.format(fault=fault))
    done = on_ranks(2, sys.executable, script, folder / "bar.toml")
    assert done.returncode != 0
    assert words in done.stderr.lower() or words in done.stderr
    assert len(errors_in(done)) <= 1
    assert contents(folder) == before
