import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

from cms.modes.families.families import Families
from cms.modes.mode_sets import craig_bampton, rubin
from cms.modes.mode_sets.reduced_pencil import (
    dual_craig_bampton_pencil,
    fixed_frequencies,
    free_frequencies,
    macneal_pencil,
    pencil_of_modes,
    receptance,
)
from fe_models.body.couplings.couplings import couple
from tests.bodies import bar


@pytest.fixture(scope="module")
def families():
    with Families(couple(bar(nx=6, kind="hexahedron"))) as families:
        yield families


@pytest.fixture(scope="module")
def spectrum(families):
    body = families.body
    return la.eigh(body.K.toarray(), body.M.toarray())


def full_receptance(body, spectrum, omega):
    omega2, Phi = spectrum
    return (Phi[body.b] / (np.r_[np.zeros(6), omega2[6:]] - omega**2)) @ Phi[body.b].T


def pencils(families, n_modes):
    body = families.body
    return {
        "macneal": macneal_pencil(families, n_modes=n_modes),
        "dual": dual_craig_bampton_pencil(families, n_modes=n_modes),
        "rubin": pencil_of_modes(body, rubin(families, n_modes=n_modes)),
        "craig-bampton": pencil_of_modes(body, craig_bampton(families, n_modes=n_modes)),
    }


@pytest.mark.parametrize(("name", "order"), [("macneal", 2), ("dual", 4), ("rubin", 4)])
def test_receptance_error_falls_with_the_order_of_the_residual(families, spectrum, name, order):
    """Left-out modes sum to Σ b bᵀ / (w_k² - w²) = G + w² N + w⁴ …: MacNeal keeps G, the others w² N too."""
    body = families.body
    pencil = pencils(families, 4)[name]
    first = np.sqrt(spectrum[0][10])
    omegas = first * np.array([0.05, 0.1, 0.2, 0.3])
    errors = []
    for omega in omegas:
        full = full_receptance(body, spectrum, omega)
        errors.append(np.abs(receptance(pencil, omega) - full).max())
    slopes = np.diff(np.log(errors)) / np.diff(np.log(omegas))
    assert_allclose(slopes[1:], order, rtol=0, atol=0.15)


def test_pencils_of_a_full_basis_have_the_full_receptance(families, spectrum):
    """Craig-Bampton at a frequency among its modes, against the sum over all modes."""
    body = families.body
    pencil = pencil_of_modes(body, craig_bampton(families, n_modes=55))
    omega = np.sqrt(spectrum[0][8] * 0.7)
    full = full_receptance(body, spectrum, omega)
    assert_allclose(receptance(pencil, omega), full, rtol=0, atol=1e-4 * np.abs(full).max())


def test_free_frequencies_of_macneal_and_dual_are_the_kept_ones(families, spectrum):
    kept = np.sqrt(spectrum[0][6:11]) / (2 * np.pi)
    made = pencils(families, 5)
    for name in ("macneal", "dual"):
        frequencies = free_frequencies(made[name])
        assert_allclose(frequencies[:6], 0, rtol=0, atol=1e-4 * kept[0])
        assert_allclose(frequencies[6:], kept, rtol=1e-8)
    assert len(free_frequencies(made["rubin"])) > 11


def test_fixed_frequencies_approach_the_full_ones_and_primal_ones_from_above(families):
    body = families.body
    full = families.fixed_modes(n_modes=3).frequencies
    made = pencils(families, 12)
    for name in ("rubin", "dual"):
        assert_allclose(fixed_frequencies(made[name])[:3], full, rtol=2e-3)
    assert_allclose(fixed_frequencies(made["macneal"])[:3], full, rtol=0.05)
    assert (fixed_frequencies(made["rubin"])[:3] > full * (1 - 1e-9)).all()
    assert_allclose(fixed_frequencies(made["craig-bampton"]), families.fixed_modes(n_modes=12).frequencies, rtol=1e-7)
    assert len(body.b) == 12


def test_the_reduced_mass_of_macneal_is_singular_by_the_number_of_boundary_dofs(families):
    pencil = macneal_pencil(families, n_modes=3)
    assert np.linalg.matrix_rank(pencil.M) == len(pencil.M) - 12
    assert_allclose(pencil.K[:, :6], 0, rtol=0, atol=0)


def test_the_dual_pencil_is_symmetric_and_indefinite(families):
    pencil = dual_craig_bampton_pencil(families, n_modes=3)
    assert_allclose(pencil.K, pencil.K.T, rtol=0, atol=0)
    size = np.sqrt(np.abs(np.diag(pencil.K)))
    size[:6] = np.linalg.norm(pencil.K[6:, :6] / size[6:, None], axis=0)  # nothing of rigid motions on the diagonal
    values = la.eigvalsh(pencil.K / np.outer(size, size))  # scales keep the signs (Sylvester), and them from rounding
    assert np.abs(values).min() > 1e-3
    assert (values < 0).sum() == len(families.body.b) == 12
    assert pencil.labels[-1] == "force right rz"
