"""The H2-optimal set beside Lyapunov equations of the whole body, and beside other sets of as many columns."""

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from numpy.testing import assert_allclose

from cms.errors import ModeSetError
from cms.modes.families.families import Families
from cms.modes.mode_sets import balanced_truncation, h2_optimal, krylov, normal_modes, rubin
from cms.modes.mode_sets.h2_optimal import H2Problem, best_directions, pole_residues
from fe_models.body.couplings.couplings import couple
from tests.bodies import bar, chain
from tests.campaign.random_bodies import random_body

MODULE = import_module("cms.modes.mode_sets.h2_optimal")
RATIO = 0.01  #: default damping ratio of the set
SEEDS = (0, 4, 5, 9, 11)  #: random bodies without multipliers, of 30 to 126 dofs


def system(n=8, n_u=2, seed=0, ratio=0.05, coupled=0.0):
    """Modes with random frequencies and loads, damped by a ratio and by a random matrix."""
    rng = np.random.default_rng(seed)
    omega2 = np.sort(rng.uniform(1.0, 30.0, n))
    C = rng.normal(size=(n, n)) * coupled
    return omega2, np.diag(2 * ratio * np.sqrt(omega2)) + C @ C.T, rng.normal(size=(n, n_u))


def first_order(K, D, B):
    """Matrices of the states (Lᵀ q, q_dot) with M = 1 and K = L Lᵀ."""
    L, zero = la.cholesky(K, lower=True), np.zeros(K.shape)
    A = np.block([[zero, L.T], [-L, -D]])
    return A, np.vstack([np.zeros_like(B), B]), np.hstack([la.solve_triangular(L, B, lower=True).T, np.zeros_like(B.T)])


def squared_h2_norm(A, b, c):
    P = la.solve_continuous_lyapunov(A, -b @ b.T)
    return np.trace(c @ P @ c.T)


def lyapunov_error(omega2, D, B, V):
    """|H - H_V|² / |H|² by the Gramian of the two systems in parallel, outputs subtracted."""
    Q = la.orth(V)
    A, b, c = first_order(np.diag(omega2), D, B)
    A_V, b_V, c_V = first_order(Q.T @ (omega2[:, None] * Q), Q.T @ D @ Q, Q.T @ B)
    both = la.block_diag(A, A_V), np.vstack([b, b_V]), np.hstack([c, -c_V])
    return squared_h2_norm(*both) / squared_h2_norm(A, b, c)


@pytest.mark.parametrize("parts", [system(), system(coupled=0.2), system(ratio=1.5)], ids=["modal", "full", "strong"])
def test_poles_and_residues_give_the_transfer_function(parts):
    omega2, D, B = parts
    found = pole_residues(*parts)
    rng = np.random.default_rng(1)
    for s in rng.uniform(0.1, 5, 3) + 1j * rng.normal(size=3) * 5:
        H = (found.r.T / (s - found.p)) @ found.r
        exact = B.T @ la.solve(s * s * np.eye(len(omega2)) + s * D + np.diag(omega2), B)
        assert_allclose(H, exact, rtol=0, atol=1e-11 * np.abs(exact).max())


def test_divided_differences_are_those_of_the_values_and_the_derivative_on_the_diagonal():
    omega2, D, B = system(coupled=0.2)
    whole = pole_residues(omega2, D, B)
    s, b = np.array([0.4 + 2j, 1.1 - 3j]), np.random.default_rng(2).normal(size=(2, 2)) + 0j
    _, differences = whole.at(s, b)

    def H(x):
        return B.T @ la.solve(x * x * np.eye(len(omega2)) + x * D + np.diag(omega2), B)

    assert_allclose(differences[0, 1], b[0] @ (H(s[0]) - H(s[1])) @ b[1] / (s[0] - s[1]), rtol=1e-11)
    h = 1e-5
    assert_allclose(differences[0, 0], b[0] @ (H(s[0] + h) - H(s[0] - h)) @ b[0] / (2 * h), rtol=1e-7)


@pytest.mark.parametrize("coupled", [0.0, 0.2])
@pytest.mark.parametrize("n_columns", [1, 3, 5])
def test_the_error_is_that_of_the_lyapunov_equation(coupled, n_columns):
    parts = system(coupled=coupled)
    V = np.random.default_rng(3).normal(size=(8, n_columns))
    assert_allclose(H2Problem(*parts).error(V), lyapunov_error(*parts, V), rtol=1e-9)


@pytest.mark.parametrize("coupled", [0.0, 0.2])
def test_the_gradient_is_that_of_the_lyapunov_error(coupled):
    parts = system(coupled=coupled)
    rng = np.random.default_rng(4)
    V = rng.normal(size=(8, 3))
    _, G = H2Problem(*parts).error_and_gradient(V)
    h = 1e-5
    for _ in range(4):
        dV = rng.normal(size=V.shape)
        slope = (lyapunov_error(*parts, V + h * dV) - lyapunov_error(*parts, V - h * dV)) / (2 * h)
        assert_allclose(np.sum(G * dV), slope, rtol=0, atol=1e-6 * la.norm(G) * la.norm(dV))
    assert_allclose(V.T @ G, 0, rtol=0, atol=1e-11 * la.norm(V) * la.norm(G))  # the error depends on the span alone


@pytest.mark.parametrize("best", ["lowest", "highest"])
def test_the_start_with_the_least_error_is_taken_and_improved(best):
    problem = H2Problem(*system())
    columns = {"lowest": np.eye(8), "highest": np.eye(8)[:, ::-1]}
    if best == "highest":
        problem = H2Problem(problem.omega2, problem.D, problem.B * np.linspace(0, 5, 8)[:, None] ** 2)
    errors = {name: problem.error(V[:, :3]) for name, V in columns.items()}
    assert min(errors, key=errors.get) == best
    found = best_directions(problem, np.zeros((8, 0)), columns, 3, 5)
    assert found.start == best
    assert found.error**2 < errors[best]


def whole_body(body, n_rigid, ratio=RATIO):
    """Elastic part of the whole body by LAPACK, with every load in the size of its static response."""
    omega2, Phi = la.eigh(body.K.toarray(), body.M.toarray())
    omega2, Phi = omega2[n_rigid:], Phi[:, n_rigid:]
    at_b = Phi[body.b]
    B = (at_b / np.sqrt(np.einsum("bk,bk->b", at_b, at_b / omega2))[:, None]).T
    D = np.diag(2 * ratio * np.sqrt(omega2))
    return (omega2, D if body.D is None else D + Phi.T @ body.D @ Phi, B), Phi


def true_error(body, columns, parts, Phi, n_rigid):
    V = Phi.T @ (body.M @ columns[:, n_rigid:])
    return np.sqrt(lyapunov_error(*parts, V / la.norm(V, axis=0)))


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("n_modes", [5, 9])
def test_no_other_set_of_as_many_columns_has_a_smaller_error(seed, n_modes):
    """Random bodies in general position, judged by the Lyapunov equation of the whole body."""
    body = couple(random_body(seed).body)
    with Families(body) as families:
        n_rigid = families.Psi_R.shape[1]
        parts, Phi = whole_body(body, n_rigid)
        own = h2_optimal(families, n_modes=n_modes, static=False, n_rich=body.n_dof)
        found = true_error(body, own.columns, parts, Phi, n_rigid)
        assert_allclose(float(own.data["h2 error"][0]), found, rtol=1e-3)
        others = (
            normal_modes(families, n_modes=n_modes),
            balanced_truncation(families, n_modes=n_modes, n_rich=body.n_dof),
            krylov(families, n_modes=n_modes),
        )
        for modes in others:
            columns = modes.columns[:, : n_rigid + n_modes]
            assert found < true_error(body, columns, parts, Phi, n_rigid) * (1 + 1e-6), modes.name


@pytest.mark.parametrize("seed", SEEDS[1:4])
def test_no_statically_complete_set_of_as_many_columns_has_a_smaller_error(seed):
    body = couple(random_body(seed).body)
    with Families(body) as families:
        n_rigid = families.Psi_R.shape[1]
        parts, Phi = whole_body(body, n_rigid)
        own = h2_optimal(families, n_modes=6, n_rich=body.n_dof)
        found = true_error(body, own.columns, parts, Phi, n_rigid)
        for modes in (rubin(families, n_modes=6), krylov(families, n_modes=6)):
            assert found < true_error(body, modes.columns, parts, Phi, n_rigid)


@pytest.mark.parametrize("static", [False, True])
def test_no_small_change_of_the_directions_lowers_the_error(static, monkeypatch):
    """First-order optimality: central differences of the Lyapunov error along random changes are zero."""
    monkeypatch.setattr(MODULE, "STATIONARY", 1e-10)
    body = couple(bar(nx=3, kind="hexahedron"))
    with Families(body) as families:
        parts, Phi = whole_body(body, 6, ratio=0.05)
        modes = h2_optimal(
            families, n_modes=4, static=static, n_rich=body.n_dof, damping_ratio=0.05, max_iterations=2000
        )
    V = Phi.T @ (body.M @ modes.columns[:, 6:])
    rng, h, slopes = np.random.default_rng(7), 1e-4, []
    scale = 1 / np.sqrt(parts[0])[:, None]  # changes of equal strain energy
    for at in (V, np.hstack([V[:, :-4], scale * rng.normal(size=(len(V), 4))])):
        at = at / la.norm(at / scale, axis=0)
        changes = [np.hstack([0 * at[:, :-4], scale * rng.normal(size=(len(V), 4))]) for _ in range(6)]
        slopes.append([
            (lyapunov_error(*parts, at + h * dV) - lyapunov_error(*parts, at - h * dV)) / (2 * h) for dV in changes
        ])  # fmt: skip
    assert np.abs(slopes[0]).max() < 1e-4 * np.abs(slopes[1]).max()


def test_the_error_is_that_of_its_rich_basis_to_a_few_percent():
    """By default 60 of 102 elastic modes and residual attachment modes represent the whole body."""
    body = couple(bar(nx=8, kind="hexahedron"))
    parts, Phi = whole_body(body, 6)
    modes = h2_optimal(body, n_modes=10, static=False)
    assert modes.options["rich basis"] != f"{body.n_dof - 6} elastic columns"
    assert_allclose(float(modes.data["h2 error"][0]), true_error(body, modes.columns, parts, Phi, 6), rtol=0.05)


@pytest.fixture(scope="module")
def body():
    return couple(bar(nx=6, kind="hexahedron"))


def test_static_responses_are_kept_unless_they_are_left_out(body):
    with Families(body) as families:
        static = np.hstack([families.Psi_R, families.Psi_U])
        complete, lacking = (h2_optimal(families, n_modes=5, static=static) for static in (True, False))
    assert complete.columns.shape[1] == 6 + 12 + 5
    assert lacking.columns.shape[1] == 6 + 5
    assert_allclose(complete.columns[:, :18], static, rtol=0, atol=0)
    assert complete.labels[-1] == lacking.labels[-1] == "h2-optimal 5"


def test_more_directions_have_a_smaller_error_and_all_of_them_none(body):
    errors = [float(h2_optimal(body, n_modes=n, static=False).data["h2 error"][0]) for n in (0, 3, 6, 12)]
    assert errors[0] == 1
    assert (np.diff(errors) < 0).all()
    of_chain = h2_optimal(couple(chain(6)), n_modes=5, static=False, n_rich=5)
    assert float(of_chain.data["h2 error"][0]) < 1e-6


def test_a_tolerance_takes_the_fewest_directions_that_meet_it(body):
    modes = h2_optimal(body, tolerance=0.2, static=False)
    n = int(modes.options["n_modes"])
    assert float(modes.data["h2 error"][0]) <= 0.2
    assert n > 1
    fewer = h2_optimal(body, n_modes=n - 1, static=False, n_rich=60)
    assert float(fewer.data["h2 error"][0]) > 0.2


def test_chosen_inputs_need_fewer_directions(body):
    few = h2_optimal(body, n_modes=5, static=False, inputs=["left uz"])
    assert few.options["inputs"] == "left uz"
    all_ = h2_optimal(body, n_modes=5, static=False)
    assert float(few.data["h2 error"][0]) < 0.5 * float(all_.data["h2 error"][0])


def test_damping_of_the_body_counts():
    free = couple(chain(8))
    damped = replace(free, D=sp.csc_array(free.K * 1e-3))
    modes = h2_optimal(damped, n_modes=2, static=False, damping_ratio=0.0, n_rich=7)
    parts, Phi = whole_body(damped, 1, ratio=0.0)
    assert_allclose(float(modes.data["h2 error"][0]), true_error(damped, modes.columns, parts, Phi, 1), rtol=1e-6)
    with pytest.raises(ModeSetError, match="give damping_ratio above 0"):
        h2_optimal(free, n_modes=2, damping_ratio=0.0)


@pytest.mark.parametrize("most", [2, 10])
def test_an_iteration_that_ends_early_says_so(body, caplog, most):
    few = h2_optimal(body, n_modes=8, max_iterations=most)
    assert few.options["iterations"] == f"{most}, not stationary"
    assert f"not stationary after {most} iterations: the last {most} lowered it by" in caplog.text
    assert "give more max_iterations" in caplog.text
    caplog.clear()
    assert h2_optimal(body, n_modes=8).options["iterations"].endswith(", stationary")
    assert not caplog.text


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({}, "either n_modes or tolerance"),
        ({"n_modes": -1}, "n_modes = -1; expected 0 or more"),
        ({"n_modes": 10_000}, "choose fewer, or a larger n_rich"),
        ({"n_modes": 4}, "3 directions beside the static responses"),
        ({"tolerance": 1.5}, "between 0 and 1"),
        ({"n_modes": 2, "damping_ratio": 1.0}, "critical damping; give another damping_ratio"),
        ({"n_modes": 2, "max_iterations": 0}, "max_iterations = 0; expected 1 or more"),
        ({"n_modes": 2, "inputs": ["middle"]}, "h2_optimal: inputs: 'middle' is no interface"),
    ],
)
def test_bad_options_are_refused(options, text):
    with pytest.raises(ModeSetError, match=text):
        h2_optimal(couple(chain(6)), **options)
