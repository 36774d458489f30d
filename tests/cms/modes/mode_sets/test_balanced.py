from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from numpy.testing import assert_allclose

import fe_models as fm
from cms.assessment.quality.reference.port_model import frf
from cms.errors import EigenError, ModeSetError
from cms.modes.families.families import Families
from cms.modes.families.receptance import largest_error, receptance_of_modes
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets.balanced import balance, balanced_truncation
from cms.reduction.reduction import reduce
from fe_models.body.couplings.couplings import couple
from fe_models.foundation.units import unit_system
from tests.bodies import bar, chain

ROUNDOFF = 1e-12


def system(n=6, n_u=2, seed=0, ratio=0.05):
    rng = np.random.default_rng(seed)
    omega2 = np.sort(rng.uniform(1.0, 30.0, n))
    C = rng.normal(size=(n, n)) * 0.02
    return omega2, np.diag(2 * ratio * np.sqrt(omega2)) + C @ C.T, rng.normal(size=(n, n_u))


def first_order(omega2, D, B):
    n = len(omega2)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(omega2), -D]])
    return A, np.concatenate([np.zeros_like(B), B]), np.concatenate([B, np.zeros_like(B)]).T


def square_root_balancing(A, B, C, r):
    """The textbook first-order algorithm: Gramians by the Kronecker product, Cholesky-like factors, their product."""
    n = len(A)
    eye = np.eye(n)

    def lyapunov(A, W):
        return np.linalg.solve(np.kron(A, eye) + np.kron(eye, A), -W.ravel()).reshape(n, n)

    def factor(P):
        values, vectors = np.linalg.eigh((P + P.T) / 2)
        return vectors * np.sqrt(np.maximum(values, 0))

    R, L = factor(lyapunov(A, B @ B.T)), factor(lyapunov(A.T, C.T @ C))
    U, sigma, Vh = np.linalg.svd(L.T @ R)
    S = np.diag(sigma[:r] ** -0.5)
    W, V = L @ U[:, :r] @ S, R @ Vh[:r].T @ S
    return sigma, (W.T @ A @ V, W.T @ B, C @ V)


def transfer(A, B, C, omega):
    return np.array([C @ np.linalg.solve(1j * w * np.eye(len(A)) - A, B) for w in omega])


def peak(H):
    return np.linalg.norm(H, ord=2, axis=(1, 2)).max()


OMEGA = np.linspace(0.0, 8.0, 4001)


def test_hankel_singular_values_are_those_of_first_order_balanced_truncation():
    parts = system()
    sigma, _ = square_root_balancing(*first_order(*parts), r=4)
    assert_allclose(balance(*parts).hankel, sigma, rtol=1e-6, atol=1e-9 * sigma[0])


@pytest.mark.parametrize("seed", range(4))
def test_signed_hankel_singular_values_sum_to_half_the_static_response(seed):
    """The trace of the Hankel operator: tr ∫ h(2 t) dt = tr H(0) / 2, H(0) = Bᵀ K⁻¹ B."""
    omega2, D, B = system(seed=seed)
    found = balance(omega2, D, B)
    static = np.trace(B.T @ (B / omega2[:, None]))
    assert_allclose((found.signs * found.hankel).sum(), static / 2, rtol=1e-9)


def test_hankel_singular_values_of_one_oscillator():
    """P E of 1 / (s² + 2 zeta omega s + omega²) is [[z, 1/2], [1/2, 0]] with P = diag(1/omega², 1) / (4 zeta omega)."""
    omega, zeta = 3.0, 0.1
    d = 2 * zeta * omega
    P, E = np.diag([1 / omega**2, 1.0]) / (2 * d), np.array([[d, 1.0], [1.0, 0.0]])
    exact = np.sort(np.abs(np.linalg.eigvals(P @ E)))[::-1]
    found = balance(np.array([omega**2]), np.array([[d]]), np.array([[1.0]]))
    assert_allclose(found.hankel, exact, rtol=1e-12)
    assert_allclose(found.position_velocity, P[0, 0], rtol=1e-12)


def test_position_gramian_is_the_integral_of_the_impulse_responses():
    omega2, D, B = system(n=3, ratio=0.2)
    C = np.random.default_rng(5).normal(size=(3, 3))
    D = D + C @ C.T  # modes coupled by damping: position and velocity Gramian differ
    A, b, _ = first_order(omega2, D, B)
    h, t_end = 0.01, 60.0
    step = la.expm(A * h)
    x, P = b.copy(), np.zeros((3, 3))
    for k in range(int(t_end / h) + 1):
        P += h * (0.5 if k == 0 else 1.0) * x[:3] @ x[:3].T
        x = step @ x
    found = balance(omega2, D, B)
    assert_allclose((found.T * found.position_velocity) @ found.T.T, P, rtol=0, atol=1e-3 * np.abs(P).max())


def test_first_order_error_stays_below_twice_the_reported_rest():
    parts = system()
    A, B, C = first_order(*parts)
    hankel, H = balance(*parts).hankel, transfer(A, B, C, OMEGA)
    for r in (2, 4, 6, 8):
        _, reduced = square_root_balancing(A, B, C, r)
        assert peak(H - transfer(*reduced, OMEGA)) <= 2 * hankel[r:].sum() * (1 + 1e-9)


def test_the_symmetric_projection_errs_in_the_size_of_the_rest():
    omega2, D, B = system(n=8)
    found = balance(omega2, D, B)
    H = transfer(*first_order(omega2, D, B), OMEGA)
    before = np.inf
    for k in (2, 4, 6, 7):
        T = found.T[:, :k]
        reduced = la.eigh(T.T @ (omega2[:, None] * T))
        Y = T @ reduced[1]
        error = peak(H - transfer(*first_order(reduced[0], Y.T @ D @ Y, Y.T @ B), OMEGA))
        assert error < before
        assert error <= 4 * 2 * found.hankel[2 * k :].sum()  # no theorem: the rest of first order, within a factor
        before = error


def test_undamped_modes_are_refused():
    omega2, D, B = system()
    with pytest.raises(ModeSetError, match="damping_ratio above 0"):
        balance(omega2, 0 * D, B)


@pytest.fixture(scope="module")
def body():
    return couple(bar(nx=10, kind="hexahedron"))


def test_frequency_response_errors_fall_with_the_number_of_directions(body):
    omega2, Phi = la.eigh(body.K.toarray(), body.M.toarray())
    at = np.linspace(0.0, np.sqrt(omega2[12]) / (2 * np.pi), 80)
    reference = receptance_of_modes(body, Phi[:, 6:], omega2[6:], loss=0.02).at(at)
    errors = []
    for n_modes in (6, 12, 20, 30, 40):
        V = balanced_truncation(body, n_modes=n_modes).columns[:, 6:]
        found, Y = la.eigh(V.T @ (body.K @ V), V.T @ (body.M @ V))
        errors.append(largest_error(receptance_of_modes(body, V @ Y, found, loss=0.02).at(at), reference))
    assert (np.diff(errors) < 0).all()
    assert errors[-1] < 3e-2
    assert errors[0] < 1.0


def test_directions_are_mass_orthonormal_and_elastic(body):
    modes = balanced_truncation(body, n_modes=15)
    G = modes.columns[:, 6:].T @ (body.M @ modes.columns)
    assert_allclose(G[:, 6:], np.eye(15), rtol=0, atol=1e3 * ROUNDOFF)
    assert_allclose(G[:, :6], 0, rtol=0, atol=1e3 * ROUNDOFF * np.abs(modes.columns[:, :6]).max())


def test_a_rich_basis_of_all_modes_gives_the_singular_values_of_the_full_body():
    body = couple(chain(8))
    omega2, Phi = la.eigh(body.K.toarray(), body.M.toarray())
    omega2, Phi = omega2[1:], Phi[:, 1:]
    B = Phi[body.b].T
    B = B / np.sqrt(np.einsum("kb,kb->b", B, B / omega2[:, None]))  # every static response is 1
    exact, _ = square_root_balancing(*first_order(omega2, np.diag(0.04 * np.sqrt(omega2)), B), r=2)
    modes = balanced_truncation(body, n_modes=3, damping_ratio=0.02, n_rich=7)
    assert_allclose(modes.data["hankel"], exact, rtol=1e-6, atol=1e-9 * exact[0])
    assert modes.options["Hankel singular values"].startswith(f"{exact[0]:.4g}, {exact[1]:.4g}")


def test_every_boundary_dof_counts_alike(body):
    """Unit static responses: the signed Hankel singular values sum to half their number, whatever their stiffness."""
    modes = balanced_truncation(body, n_modes=3)
    assert_allclose((modes.data["hankel"] * modes.data["hankel signs"]).sum(), len(body.b) / 2, rtol=1e-6)


def test_damping_of_the_body_counts():
    body = couple(chain(8))
    damped = replace(body, D=sp.csc_array(body.K * 1e-3))
    own = balanced_truncation(damped, n_modes=2, damping_ratio=0.0)
    ratio = balanced_truncation(body, n_modes=2)
    assert not np.allclose(own.data["hankel"], ratio.data["hankel"], rtol=0.1)
    with pytest.raises(ModeSetError, match="damping_ratio above 0"):
        balanced_truncation(body, n_modes=2, damping_ratio=0.0)


def test_a_tolerance_keeps_as_many_directions_as_it_takes(body):
    modes = balanced_truncation(body, tolerance=1e-3)
    sigma, n = modes.data["position-velocity"], modes.columns.shape[1] - 6
    assert sigma[n:].sum() <= 1e-3 * sigma.sum() < sigma[n - 1 :].sum()


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({}, "either n_modes or tolerance"),
        ({"n_modes": 2, "tolerance": 0.1}, "either n_modes or tolerance"),
        ({"n_modes": -1}, "expected 0 or more"),
        ({"n_modes": 10_000}, "choose fewer"),
        ({"tolerance": 1.5}, "between 0 and 1"),
        ({"n_modes": 2, "damping_ratio": -0.1}, "0.01 is 1 %"),
        ({"n_modes": 2, "n_rich": 0}, "expected 1 or more"),
    ],
)
def test_bad_options_are_refused(options, text):
    with pytest.raises(ModeSetError, match=text):
        balanced_truncation(couple(chain(6)), **options)


def test_a_small_body_is_balanced_without_asking_for_its_highest_modes():
    line = fm.beams.straight_line((0, 0, 0), (1, 0, 0), 21)
    ends = [fm.beams.line_interface(line, name, fm.selections.NodeSet(name)) for name in ("start", "end")]
    section = fm.beams.BeamProperty(fm.beams.Circle(0.01), fm.Material("steel", E=2.1e11, nu=0.3, rho=7850.0))
    body = couple(fm.beam_body(line, section, name="rod", units=unit_system("m-kg-s"), interfaces=ends))
    modes = balanced_truncation(fm.planar(body, normal=2), n_modes=4)
    sigma = modes.data["position-velocity"]
    assert modes.columns.shape[1] == 6 + 4
    assert sigma[4:].sum() < 0.02 * sigma.sum()


# Chosen inputs and outputs -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_hankel_values_between_loads_and_other_responses_are_those_of_the_first_order_system(seed):
    omega2, D, B = system(n_u=2, seed=seed)
    C = np.random.default_rng(seed + 50).normal(size=(6, 1))
    A, b, _ = first_order(omega2, D, B)
    c = np.concatenate([C, np.zeros_like(C)]).T
    expected, *_ = square_root_balancing(A, b, c, 4)
    assert_allclose(balance(omega2, D, B, C).hankel, expected, rtol=1e-7, atol=1e-9 * expected[0])


def test_loads_given_as_responses_too_have_the_directions_of_the_symmetric_case():
    omega2, D, B = system()
    one, two = balance(omega2, D, B), balance(omega2, D, B, B)
    assert_allclose(two.position_velocity, one.position_velocity, rtol=1e-8)
    assert_allclose(two.hankel, one.hankel, rtol=1e-7, atol=1e-9 * one.hankel[0])
    assert_allclose(np.abs(two.T.T @ one.T), np.eye(6), rtol=0, atol=1e-6)


def test_directions_of_loads_and_responses_are_orthonormal_and_meet_the_transfer_function():
    """Few directions for one transfer function leave less error than as many for all of them."""
    omega2, D, B = system(n=8, n_u=2, seed=4)
    C = np.random.default_rng(9).normal(size=(8, 1))
    chosen, all_ = balance(omega2, D, B[:, :1], C), balance(omega2, D, np.hstack([B, C]))
    assert_allclose(chosen.T.T @ chosen.T, np.eye(8), rtol=0, atol=1e3 * ROUNDOFF)

    def transfer(T, omega):
        K = T.T @ (np.diag(omega2) - omega**2 * np.eye(8) + 1j * omega * D) @ T
        return (C.T @ T @ np.linalg.solve(K, T.T @ B[:, :1]))[0, 0]

    grid = np.linspace(0.0, 8.0, 200)
    exact = np.array([transfer(np.eye(8), w) for w in grid])
    error = [np.abs([transfer(s.T[:, :6], w) for w in grid] - exact).max() for s in (chosen, all_)]
    assert error[0] < 0.5 * error[1]


def test_a_set_for_chosen_places_needs_fewer_columns(body):
    places = {"inputs": ["left uz"], "outputs": ["right uz"]}
    frequencies = np.linspace(50.0, 1500.0, 60)

    def error(n, **options):
        modes = balanced_truncation(body, n_modes=n, **options)
        found = frf(reduce(body, modes), frequencies, damping=0.01).between("left", "right").H[:, 2, 2]
        return np.abs(found - exact).max() / np.abs(exact).max()

    unit = ModeSet("unit", np.eye(body.n_dof), tuple(map(str, range(body.n_dof))), np.full(body.n_dof, np.nan))
    exact = frf(reduce(body, unit), frequencies, damping=0.01).between("left", "right").H[:, 2, 2]
    assert error(6, **places) < 1e-4
    assert error(6) > 1e-3
    told = balanced_truncation(body, n_modes=4, **places).options
    assert (told["inputs"], told["outputs"]) == ("left uz", "right uz")


@pytest.mark.parametrize(
    ("places", "text"),
    [
        ({"inputs": ["lift"]}, "inputs: 'lift' is no interface; did you mean 'left'"),
        ({"inputs": ["left"], "outputs": ["right ux", "left uq"]}, "outputs: 'left uq' is no interface"),
        ({"outputs": "left"}, "outputs: expected a list of interfaces"),
        ({"inputs": []}, "inputs: expected a list of interfaces"),
    ],
)
def test_places_that_are_none_are_refused(body, places, text):
    with pytest.raises(ModeSetError, match=text):
        balanced_truncation(body, n_modes=4, **places)


def test_fewer_free_modes_are_taken_where_the_eigensolver_finds_no_more(body, monkeypatch):
    asked = []
    find = Families.free_modes

    def at_most_20(self, wanted=None, **options):
        n = wanted.n if wanted is not None else options["n_modes"]
        asked.append(n)
        if n > 20:
            raise EigenError("eigenmodes: residuals are 3e-4, expected 1e-5")
        return find(self, wanted, **options) if wanted is not None else find(self, **options)

    monkeypatch.setattr(Families, "free_modes", at_most_20)
    modes = balanced_truncation(body, n_modes=4)
    assert asked[0] > 20 >= asked[-1]
    assert modes.columns.shape[1] == 10

    def none(self, wanted=None, **options):
        raise EigenError("eigenmodes: residuals are 3e-4, expected 1e-5")

    monkeypatch.setattr(Families, "free_modes", none)
    with pytest.raises(ModeSetError, match="the rich basis needs at least 4 free modes, which were not found"):
        balanced_truncation(body, n_modes=4)
