from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

from cms.assessment.compare.subsets import SUBSETS
from cms.errors import ModeSetError
from cms.modes.families.families import Families
from cms.modes.families.receptance import boundary_scale, largest_error, receptance_of_modes
from cms.modes.mode_sets.krylov import krylov
from cms.reduction.reduction import reduce
from fe_models.body.couplings.couplings import couple
from fe_models.body.fe_body import Interface
from fe_models.body.load_cases import LoadCase
from fe_models.elements.solids.body import solid_body
from fe_models.foundation.units import unit_system
from tests.bodies import STEEL, bar, box_mesh, chain

ROUNDOFF = 1e-12


@pytest.fixture(scope="module")
def body():
    return couple(bar(nx=5, kind="hexahedron"))


@pytest.fixture(scope="module")
def finer():
    return couple(bar(nx=16, kind="hexahedron"))


def boundary_loads(body):
    F = np.zeros((body.n_dof, len(body.b)))
    F[body.b, np.arange(len(body.b))] = boundary_scale(body)
    return F


def elastic_part(K, M, F, Psi_R):
    """K, M, F without rigid-body motion: the dense spectral road, all elastic modes."""
    omega2, Phi = la.eigh(K, M)
    n_r = Psi_R.shape[1]
    return omega2[n_r:], Phi[:, n_r:].T @ F


def moments(omega2, b, sigma, n):
    """m_k = Fᵀ [(K - sigma M)⁻¹ M]^k (K - sigma M)⁻¹ F = Σ b bᵀ / (omega² - sigma)^(k + 1)."""
    return [b.T @ (b / (omega2[:, None] - sigma) ** (k + 1)) for k in range(n)]


def relative(moment, reference):
    """Every load and response in the size of its own direct moment."""
    size = np.sqrt(np.abs(np.diag(reference)))
    return moment / np.outer(size, size)


def reduced_moments(body, modes, sigma, n):
    """Moments of the projected pencil, its elastic part by its own dense eigenvectors."""
    with Families(body) as families:
        n_r = families.Psi_R.shape[1]
        V = modes.columns[:, n_r:]
        F = boundary_loads(body)
    K, M = V.T @ (body.K @ V), V.T @ (body.M @ V)
    omega2, Y = la.eigh(K, M)
    return moments(omega2, Y.T @ (V.T @ F), sigma, n)


@pytest.mark.parametrize("n_blocks", [1, 2, 3])
@pytest.mark.parametrize("shift", [0.0, 700.0])
def test_twice_as_many_moments_as_blocks_agree_with_the_full_body(body, shift, n_blocks):
    modes = krylov(body, n_blocks=n_blocks, shifts=[shift])
    sigma = (2 * np.pi * shift) ** 2
    Psi_R = modes.columns[:, :6]
    omega2, b = elastic_part(body.K.toarray(), body.M.toarray(), boundary_loads(body), Psi_R)
    full = moments(omega2, b, sigma, 2 * n_blocks + 1)
    reduced = reduced_moments(body, modes, sigma, 2 * n_blocks + 1)
    for k, (exact, found) in enumerate(zip(full[:-1], reduced[:-1], strict=True)):
        # rounding of the nearest omega² - sigma comes in once for every power
        assert_allclose(relative(found, exact), relative(exact, exact), rtol=0, atol=1e-8 * 4**k)
    if n_blocks == 1:  # and no more than those; later moments are those of the lowest mode, which is exact soon
        assert np.abs(relative(full[-1] - reduced[-1], full[-1])).max() > 1e-6
    assert modes.options["moments matched"] == f"{2 * n_blocks} at {shift:g} Hz"


def test_moments_of_all_shifts_agree(body):
    shifts = [0.0, 300.0, 900.0]
    modes = krylov(body, n_blocks=1, shifts=shifts)
    omega2, b = elastic_part(body.K.toarray(), body.M.toarray(), boundary_loads(body), modes.columns[:, :6])
    for shift in shifts:
        sigma = (2 * np.pi * shift) ** 2
        for exact, found in zip(moments(omega2, b, sigma, 2), reduced_moments(body, modes, sigma, 2), strict=True):
            assert_allclose(relative(found, exact), relative(exact, exact), rtol=0, atol=1e-6)


def test_a_chain_is_exact_once_its_few_elastic_modes_are_spanned():
    """Six masses have five elastic modes; two end loads span two directions per block."""
    body = couple(chain(6))
    modes = krylov(body, n_blocks=9)
    assert modes.columns.shape[1] == 6  # 1 rigid-body mode and 5 directions, the rest deflated
    exact = np.sqrt(la.eigh(body.K.toarray(), body.M.toarray(), eigvals_only=True)[1:])
    found = np.sqrt(la.eigh(modes.columns.T @ body.K @ modes.columns, modes.columns.T @ body.M @ modes.columns)[0][1:])
    assert_allclose(found, exact, rtol=1e-9)


def test_one_block_at_zero_is_the_static_set(body):
    with Families(body) as families:
        static = np.hstack([families.Psi_R, families.Psi_U])
        modes = krylov(families, n_modes=0)
    angles = la.subspace_angles(static / np.linalg.norm(static, axis=0), modes.columns)
    assert angles.max() < 1e-6
    assert modes.columns.shape[1] == 6 + 12


def test_static_answers_to_interface_and_inertia_loads_are_exact(body):
    with Families(body) as families:
        V = krylov(families, n_modes=5).columns
        for U in (families.Psi_A, families.Psi_H):
            U, W = U / np.linalg.norm(U, axis=0), V / np.linalg.norm(V, axis=0)
            rest = U - W @ np.linalg.lstsq(W, U, rcond=1e-13)[0]
            assert_allclose(rest, 0, rtol=0, atol=max(1e-9, 1e3 * np.finfo(float).eps * np.linalg.cond(W)))


@pytest.mark.parametrize("n_modes", [0, 3, 17])
def test_the_set_of_fewer_modes_is_the_beginning_of_that_of_more(body, n_modes):
    more, fewer = krylov(body, n_modes=20), krylov(body, n_modes=n_modes)
    C, labels = SUBSETS["krylov"](more, more.columns[body.b], n_modes)
    assert labels == fewer.labels
    assert_allclose(more.columns @ C, fewer.columns, rtol=0, atol=1e-9 * np.abs(fewer.columns).max())


def test_n_modes_counts_columns_beyond_the_static_ones(body):
    few, more = krylov(body, n_modes=3), krylov(body, n_modes=14)
    assert few.columns.shape[1] == 18 + 3
    assert more.columns.shape[1] == 18 + 14
    assert_allclose(more.columns[:, :21], few.columns, rtol=0, atol=1e-9 * np.abs(few.columns).max())


def test_columns_stay_orthonormal_until_the_whole_space_is_spanned(body):
    modes = krylov(body, n_blocks=12)
    V = modes.columns[:, 6:]
    W = V.T @ (body.K @ V) + modes.data["omega2"] * (V.T @ (body.M @ V))
    assert_allclose(W, np.eye(body.n_dof - 6), rtol=0, atol=1e2 * ROUNDOFF)


def test_load_cases_are_among_the_loads(body):
    f = np.random.default_rng(3).normal(size=body.n_dof)
    spin = LoadCase("spin", "centrifugal", f[::-1])  # never: its response is static
    loaded = replace(body, load_cases=(LoadCase("push", "force", f), spin))
    with Families(loaded) as families:
        response = families.flexibility(f[:, None])
        for wanted in (True, False):
            V = krylov(families, n_modes=0, load_cases=wanted).columns
            assert V.shape[1] == 18 + wanted
            rest = response - V @ np.linalg.lstsq(V, response, rcond=None)[0]
            is_in = np.linalg.norm(rest) < 1e-8 * np.linalg.norm(response)
            assert is_in == wanted


def test_the_error_over_a_band_stops_the_blocks(finer):
    body = finer
    omega2, Phi = la.eigh(body.K.toarray(), body.M.toarray())
    band = (0.0, float(np.sqrt(omega2[14]) / (2 * np.pi)))
    at = np.linspace(*band, 60)
    reference = receptance_of_modes(body, Phi[:, 6:], omega2[6:], loss=0.02).at(at)
    sizes = []
    for tolerance in (1e-1, 1e-6):
        modes = krylov(body, tolerance=tolerance, band=band)
        V = modes.columns[:, 6:]
        reduced_omega2, Y = la.eigh(V.T @ (body.K @ V), V.T @ (body.M @ V))
        error = largest_error(receptance_of_modes(body, V @ Y, reduced_omega2, loss=0.02).at(at), reference)
        assert error < tolerance
        assert float(modes.options["estimated transfer-function error"]) < tolerance
        sizes.append(modes.columns.shape[1])
    assert sizes[0] < sizes[1] < body.n_dof / 2


@pytest.mark.parametrize("tolerance", [0.3, 0.1])
def test_a_tolerance_without_a_band_leaves_out_what_the_span_has_but_for_so_much(body, tolerance):
    """Another step of the recurrence from anywhere in the span leaves it by no more than about the tolerance."""
    modes = krylov(body, tolerance=tolerance)
    V, omega2 = modes.columns[:, 6:], modes.data["omega2"]
    W = body.K + float(omega2[0]) * body.M
    with Families(body) as families:
        X = families.flexibility(body.M @ V)
    size = np.sqrt(np.einsum("nk,nk->k", X, W @ X))
    rest = X - V @ (V.T @ (W @ X))
    assert (np.sqrt(np.einsum("nk,nk->k", rest, W @ rest)) < 3 * tolerance * size.max()).all()
    assert 12 < V.shape[1] < body.n_dof - 6


def test_the_set_says_whether_its_tolerance_was_met(body, monkeypatch):
    asked = {"tolerance": 1e-3, "band": (0.0, 3000.0)}
    assert krylov(body, **asked).options["tolerance"] == "0.001, met"
    monkeypatch.setattr(import_module("cms.modes.mode_sets.krylov"), "MOST_BLOCKS", 1)
    assert krylov(body, **asked).options["tolerance"] == "0.001, not met with 1 blocks at every shift"


def test_frequencies_near_a_shift_come_out_best(body):
    full = np.sqrt(la.eigh(body.K.toarray(), body.M.toarray(), eigvals_only=True)[6:]) / (2 * np.pi)
    target = 8
    far, near = (
        reduce(body, krylov(body, n_blocks=1, shifts=[0.0, shift])).free_frequencies
        for shift in (full[0] * 0.9, full[target] * 1.02)
    )
    errors = [abs(found - full[target]).min() / full[target] for found in (far, near)]
    assert errors[1] < 1e-4
    assert errors[1] < 0.1 * errors[0]


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({}, "expected one of n_modes, n_blocks and tolerance"),
        ({"n_modes": 3, "n_blocks": 2}, "n_modes = 3, n_blocks = 2"),
        ({"n_modes": -1}, "expected 0 or more"),
        ({"n_blocks": 0}, "expected 1 or more"),
        ({"tolerance": 2.0}, "between 0 and 1"),
        ({"n_blocks": 1, "shifts": []}, "one or more frequencies"),
        ({"n_blocks": 1, "shifts": [-3.0]}, "one or more frequencies"),
        ({"tolerance": 1e-3, "band": (5.0, 1.0)}, "0 <= from < to"),
        ({"n_blocks": 2, "band": (0.0, 1.0)}, "needs a tolerance"),
    ],
)
def test_bad_options_are_refused(body, options, text):
    with pytest.raises(ModeSetError, match=text):
        krylov(body, **options)


def test_a_shift_at_a_natural_frequency_is_refused():
    body = couple(chain(6))
    resonance = np.sqrt(1000.0 / 2.0) * 2 * np.sin(np.pi / 12) / (2 * np.pi)
    with pytest.raises(ModeSetError, match="natural frequency of the free body; move the shift"):
        krylov(body, n_blocks=1, shifts=[resonance])


def test_labels_say_hertz_whatever_the_unit_of_time(body):
    """A shift is given per unit of time of the body; 0.8 per millisecond are 800 Hz."""
    modes = krylov(replace(body, units=unit_system("mm-kg-ms")), n_blocks=1, shifts=(0.8,))
    assert modes.options["shifts"] == "800 Hz"
    assert modes.labels[-1].startswith("krylov 800 Hz block 1")


@pytest.mark.parametrize("kinds", [("rigid", "distributing"), ("distributing", "distributing")])
def test_no_more_motions_are_found_than_the_body_has(kinds):
    """Multipliers of a distributing interface are no motions: what is left of one is rounding beside them."""
    mesh = box_mesh(2, 2, 1, 1.0, 0.4, 0.3)
    block = solid_body(mesh, STEEL, name="block", units=unit_system("m-kg-s"))
    sides = [mesh.node_sets[side] for side in ("left", "right")]
    ends = [Interface(n, k, s, mesh.nodes[s].mean(0)) for n, k, s in zip("ab", kinds, sides, strict=True)]
    body = couple(block.with_interfaces(*ends))
    moving = body.n_dof - 12 * kinds.count("distributing") - 6
    for shifts in ((0.0,), (0.0, 800.0)):
        reduced = reduce(body, krylov(body, n_blocks=8, shifts=shifts), geometric=False, stress=False)
        assert np.diag(reduced.M).all()
        assert moving - 2 <= reduced.n_q <= moving
