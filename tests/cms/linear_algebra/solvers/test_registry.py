import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

import cms
from cms.errors import FactorizationError
from cms.linear_algebra.solvers import registry
from cms.linear_algebra.solvers.eigen import eigenmodes
from cms.linear_algebra.solvers.factorization import factorize
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.linear_algebra.solvers.pardiso import mkl_runtime
from cms.linear_algebra.solvers.registry import DEFAULTS, SOLVERS, solver_of
from fe_models.foundation.solver import Solver
from tests.bodies import bar
from tests.cms.command import run_cms
from tests.cms.linear_algebra.solvers.examples import clamped_bar


class DenseFactor:
    """A factor by LAPACK, that counts what it is asked for: the protocol and nothing more."""

    def __init__(self, lower, *, definite):
        A = (lower + lower.T).toarray()
        A[np.diag_indices_from(A)] /= 2
        values = la.eigvalsh(A)
        if definite and values[0] <= 0:
            raise FactorizationError("dense: not positive definite")
        self.is_open, self.n, self.n_perturbed = True, len(A), 0
        self.n_negative, self.n_positive = int((values < 0).sum()), int((values > 0).sum())
        self.n_factor_entries, self.description = A.size, "dense LAPACK"
        self._lu = la.lu_factor(A)

    def solve(self, b):
        return np.asfortranarray(la.lu_solve(self._lu, b))

    def close(self):
        self.is_open = False


DENSE = Solver("dense", DenseFactor)


@pytest.fixture
def registered(monkeypatch):
    """One more solver, and one that is not installed."""
    monkeypatch.setitem(SOLVERS, "dense", DENSE)
    monkeypatch.setitem(SOLVERS, "absent", Solver("absent", DenseFactor, lambda: "needs libabsent; pip install absent"))


def test_the_fastest_that_is_installed_is_the_default(monkeypatch):
    assert solver_of().name == ("pardiso" if mkl_runtime() is not None else "cholesky")
    monkeypatch.setitem(SOLVERS, "pardiso", Solver("pardiso", DenseFactor, lambda: "needs MKL"))
    assert solver_of().name == "cholesky"


def test_large_definite_matrices_go_to_our_cholesky_factorisation(monkeypatch):
    if mkl_runtime() is None:
        pytest.skip("no MKL here: all go there")
    A = clamped_bar()
    with factorize(A) as small:
        assert small.description.startswith("PARDISO")
    monkeypatch.setattr(registry, "LARGE", A.shape[0])
    with factorize(A) as large, factorize(A, definite=False) as indefinite, factorize(A, solver="pardiso") as asked:
        assert large.description.startswith("Cholesky by")
        assert indefinite.description.startswith("PARDISO")
        assert asked.description.startswith("PARDISO")


def test_defaults_are_registered_under_their_names():
    assert {solver.name for solver in DEFAULTS} <= set(SOLVERS)
    assert all(solver.name == name for name, solver in SOLVERS.items())


@pytest.mark.parametrize("call", [lambda name: solver_of(name), lambda name: factorize(clamped_bar(), solver=name)])
def test_a_solver_that_is_not_there_is_refused_in_one_message(registered, call):
    with pytest.raises(FactorizationError, match=r"unknown solver 'pardisso'; did you mean 'pardiso'\? choices: "):
        call("pardisso")
    with pytest.raises(
        FactorizationError, match=r"^solver absent: needs libabsent; pip install absent; installed here: "
    ):
        call("absent")


def test_a_solver_of_ones_own_serves_factorisation_modes_and_proof():
    K = clamped_bar()
    b = np.random.default_rng(3).standard_normal((K.shape[0], 3))
    with factorize(K, solver=DENSE) as ours, factorize(K, solver="superlu") as other:
        assert (ours.solver, ours.description, ours.inertia) == (DENSE, "dense LAPACK", other.inertia)
        assert_allclose(ours.solve(b), other.solve(b), rtol=0, atol=1e-9 * np.abs(other.solve(b)).max())


def test_the_proof_of_modes_takes_the_solver_of_the_factorisation():
    made = []
    counting = Solver(
        "dense", lambda lower, *, definite: made.append(definite) or DenseFactor(lower, definite=definite)
    )
    body = bar(nx=6, ny=1, nz=1)
    modes = eigenmodes(body.K, body.M, ModeCount(8, verify=True), solver=counting)
    assert made == [True, False]
    assert modes.is_proven
    assert "dense LAPACK" in modes.method


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("solver")
    write_matrices(path)
    return path


def write_matrices(folder):
    """Matrices of a bar with two rigid interfaces, and a job file of them with a line for the solver."""
    body = bar(nx=4, ny=1, nz=1)
    ends = {f"interface/{end.name}/nodes": end.nodes for end in body.interfaces}
    np.savez(folder / "bar.npz", M=body.M.toarray(), K=body.K.toarray(), nodes=body.nodes, dofs=body.dofs, **ends)
    for name, line in (("plain", ""), ("superlu", 'solver = "superlu"'), ("wrong", 'solver = "superlux"')):
        job = f'[body]\nmatrices = "bar.npz"\nunits = "m-kg-s"\n[reduction]\nn_modes = 2\n{line}\n'
        (folder / f"{name}.toml").write_text(job)


def solver_in(path):
    return cms.read(path).provenance["mode set solver"].split(" ")[0]


def test_the_command_goes_before_the_job_and_the_file_says_who_factorised(folder, registered):
    def reduced_by(*arguments):
        run_cms("reduce", *arguments, "-o", folder / "out.h5", code=0)
        return solver_in(folder / "out.h5")

    superlu = str(folder / "superlu.toml")
    assert reduced_by(superlu) == "SuperLU"
    assert reduced_by(superlu, "--solver", "dense") == "dense"
    assert reduced_by(str(folder / "plain.toml")) == ("PARDISO" if mkl_runtime() is not None else "SuperLU")
    assert cms.reduce_job(superlu, solver=DENSE).provenance["mode set solver"] == "dense LAPACK"


def test_jobs_of_a_fleet_take_the_solver_too(folder, registered):
    rows = cms.reduction.reduce_fleet([folder / "plain.toml"], [folder / "fleet.h5"], workers=1, solver="dense")
    assert [row.error for row in rows] == [""]
    assert solver_in(folder / "fleet.h5") == "dense"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["plain.toml", "--solver", "absent"], "solver absent: needs libabsent; pip install absent"),
        (["plain.toml", "--solver", "dens"], "unknown solver 'dens'; did you mean 'dense'?"),
        (["plain.toml", "--solver", "absent", "--workers", "2"], "solver absent: needs libabsent"),
        (["wrong.toml"], "unknown solver; did you mean 'superlu'?"),
    ],
)
def test_the_command_refuses_solvers_that_are_not_there_and_writes_nothing(tmp_path, registered, arguments, words):
    write_matrices(tmp_path)
    before = sorted(tmp_path.iterdir())
    result = run_cms("reduce", tmp_path / arguments[0], *arguments[1:], code=2)
    assert words in " ".join(result.output.split())
    assert sorted(tmp_path.iterdir()) == before
