"""Frames of light or massless beams between heavy points, small bodies and all interior modes, beside dense pencils."""

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

import cms
import fe_models as fm
from cms.errors import EigenError

SETS = (
    cms.craig_bampton,
    cms.modes.craig_bampton_ir,
    cms.rubin,
    cms.modes.herting,
    cms.modes.craig_chang,
    cms.modes.attachment,
)


def frame(seed, rho):
    """Return a random frame with a point mass on most of its nodes, and how many lie inside."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(5, 9))
    points = rng.normal(size=(n, 3))
    mesh = fm.beams.LineMesh(points, np.array([[k, k + 1] for k in range(n - 1)]))
    at = rng.choice(n, int(rng.integers(4, n + 1)), replace=False)
    masses = [fm.beams.PointMass(int(k), mass=float(rng.uniform(1, 20))) for k in at]
    section = fm.beams.BeamProperty(fm.beams.Rectangle(0.05, 0.075), fm.Material("light", E=2e11, nu=0.3, rho=rho))
    body = fm.beam_body(mesh, section, name="frame", units=cms.unit_system("m-kg-s"), point_masses=masses)
    ends = (
        fm.Interface("a", "nodes", np.array([0]), points[0]),
        fm.Interface("b", "rigid", np.array([n - 1]), points[-1]),
    )
    return cms.couple(body.with_interfaces(*ends)), int(((at > 0) & (at < n - 1)).sum())


def exact_frequencies(body):
    """Return the elastic frequencies of a body whose light dofs are massless: these are condensed, (K, M) dense."""
    K, M = body.K.toarray(), body.M.toarray()
    has_mass = M.diagonal() > 1e-6 * M.diagonal().max()
    m, s = np.flatnonzero(has_mass), np.flatnonzero(~has_mass)
    K_m = K[np.ix_(m, m)] - K[np.ix_(m, s)] @ np.linalg.solve(K[np.ix_(s, s)], K[np.ix_(s, m)])
    return np.sqrt(la.eigh(K_m, M[np.ix_(m, m)], eigvals_only=True)[6:]) / 2 / np.pi


@pytest.mark.parametrize("rho", [1e3, 1e-3, 1e-6, 1e-9, 1e-20, 0.0])
def test_every_set_reduces_frames_of_light_beams(rho):
    for seed in range(3):
        body, _ = frame(seed, rho)
        for make in SETS:
            reduced = cms.reduce(body, make(body, 2), stress=False, geometric=False)
            is_massive = np.diag(reduced.M) > 0
            assert_allclose(reduced.M, np.diag(is_massive.astype(float)), atol=1e-9)
            if rho < 1e-8:  # reduced frequencies lie above the exact ones
                exact = exact_frequencies(body)[:2]
                assert (reduced.free_frequencies[:2] > exact * (1 - 1e-6)).all(), make.__name__


@pytest.mark.parametrize("rho", [1e-9, 0.0])
def test_all_modes_with_mass_give_the_exact_frequencies(rho):
    """Three modes for each point mass inside: nothing that moves is left out."""
    for seed in range(4):
        body, n_inside = frame(seed, rho)
        reduced = cms.reduce(body, cms.craig_bampton(body, 3 * n_inside), stress=False, geometric=False)
        exact = exact_frequencies(body)
        assert_allclose(reduced.free_frequencies[: len(exact)], exact, rtol=1e-6)


def test_more_modes_than_have_mass_are_refused_by_their_number():
    body, n_inside = frame(0, 0.0)
    with pytest.raises(EigenError, match=f"only {3 * n_inside} modes have mass"):
        cms.craig_bampton(body, 3 * n_inside + 1)


@pytest.mark.parametrize("size", [1.0, 1e-3, 3e-5])
def test_frequencies_of_a_small_beam_go_with_its_size(size):
    """A beam of silicon in m-kg-s, from a metre to micrometres: frequency times length stays."""
    mesh = fm.beams.straight_line((0, 0, 0), (size, 0, 0), 8)
    section = fm.beams.Rectangle(0.03 * size, 0.02 * size)
    silicon = fm.Material("silicon", E=1.6e11, nu=0.25, rho=2330.0)
    body = fm.beam_body(mesh, fm.beams.BeamProperty(section, silicon), name="b", units=cms.unit_system("m-kg-s"))
    ends = (fm.Interface(name, "rigid", np.array([k]), body.nodes[k]) for name, k in (("a", 0), ("z", 8)))
    body = cms.couple(body.with_interfaces(*ends))
    for make in (cms.craig_bampton, cms.rubin):
        found = cms.reduce(body, make(body, 4), stress=False, geometric=False).free_frequencies[:1] * size
        # Euler-Bernoulli: (4.73004)²/(2 pi) sqrt(E I/(rho A L⁴)), shear lowers it by less than a percent
        exact = 4.73004**2 / (2 * np.pi) * np.sqrt(1.6e11 / 2330.0 * 0.02**2 / 12)
        assert_allclose(found, exact, rtol=1e-2)


def test_all_interior_modes_of_a_plate_are_found():
    """Drilling modes of shells are a million times above the first: fixed-interface modes beside dense ones."""
    mesh = fm.shells.flat_plate(1.3, 0.4, 3, 2)
    x = mesh.nodes[:, 0]
    ends = [np.flatnonzero(x < 1e-9), np.flatnonzero(x > x.max() - 1e-9)]
    for thickness in (0.06, 0.006):
        steel = fm.shells.ShellProperty(thickness, fm.Material("m", E=2e11, nu=0.3, rho=7800.0))
        body = fm.shell_body(mesh, steel, name="b", units=cms.unit_system("m-kg-s"))
        both = [fm.Interface(n, "rigid", e, body.nodes[e].mean(0)) for n, e in zip("ab", ends, strict=True)]
        body = cms.couple(body.with_interfaces(*both))
        i = body.i
        exact = np.sqrt(la.eigh(body.K[i][:, i].toarray(), body.M[i][:, i].toarray(), eigvals_only=True)) / 2 / np.pi
        modes = cms.craig_bampton(body, len(i))
        found = modes.frequencies[~np.isnan(modes.frequencies)]
        assert_allclose(np.sort(found)[-len(i) :], exact, rtol=1e-5)
