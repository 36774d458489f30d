"""Frames of light beams with point masses: their stiffest modes are up to 1e6 times as fast as the first."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import cms
import fe_models as fm
from cms.assessment.quality.of_reduction.contents import CONTENTS
from cms.assessment.quality.reduction_check import check_reduction
from cms.reduction.basis.free_basis import shape_rounding
from fe_models.foundation.units import unit_system

UNITS = unit_system("mm-t-s")
SETS = {
    "craig-bampton": cms.craig_bampton,
    "rubin": cms.rubin,
    "herting": cms.modes.herting,
    "craig-chang": cms.modes.craig_chang,
}


def light_frame(seed: int, density: float):
    """A chain of beams in space, turned and far from the origin [mm, t, s], with 1 to 20 kg at most of its nodes."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(5, 8))
    nodes = Rotation.random(random_state=seed).apply(1e3 * rng.normal(size=(n, 3))) + 3e4 * rng.normal(size=3)
    heavy = rng.choice(n, int(rng.integers(4, n + 1)), replace=False)
    masses = [fm.beams.PointMass(int(node), mass=1e-3 * float(rng.uniform(1, 20))) for node in heavy]
    section = fm.beams.BeamProperty(
        fm.beams.Rectangle(50.0, 75.0), fm.Material("light", E=2e5, nu=0.3, rho=1e-12 * density)
    )
    ports = [
        fm.Interface("a", "nodes", np.array([0]), nodes[0]), fm.Interface("b", "rigid", np.array([n - 1]), nodes[-1]),
    ]  # fmt: skip
    mesh = fm.beams.LineMesh(nodes, np.array([(k, k + 1) for k in range(n - 1)]))
    return cms.couple(fm.beam_body(mesh, section, name="light", units=UNITS, interfaces=ports, point_masses=masses))


def verdicts(body, modes, reduced):
    return {record.name: record.verdict for record in check_reduction(body, modes, reduced)}


@pytest.mark.parametrize(("seed", "density"), [(26, 1e-6), (22, 1e-6), (12, 0.0)])
@pytest.mark.parametrize("name", SETS)
def test_modes_of_almost_no_mass_raise_no_alarm(seed, density, name):
    body = light_frame(seed, density)
    modes = SETS[name](body, 2)
    found = verdicts(body, modes, cms.reduce(body, modes))
    assert {key: found[key] for key in ("same-body", "free-frequencies")} == {
        "same-body": "pass",
        "free-frequencies": "pass",
    }


@pytest.mark.parametrize(("seed", "density"), [(35, 1e-6), (54, 1e-6), (33, 1e-6), (26, 1e-3)])
@pytest.mark.parametrize("name", SETS)
def test_sets_with_nearly_dependent_columns_raise_no_alarm(seed, density, name):
    """Light nodes move in differences of columns; of seed 54 two columns are redundant, but not both."""
    body = light_frame(seed, density)
    modes = SETS[name](body, 2)
    found = verdicts(body, modes, cms.reduce(body, modes))
    judged = ("same-body", "free-frequencies", "modal-mass", *CONTENTS)
    assert [key for key in judged if found.get(key) in ("warn", "fail")] == []


@pytest.mark.parametrize(("seed", "density"), [(35, 1e-3), (30, 1e-6), (11, 1e-6)])
def test_a_file_of_a_set_with_other_rounding_raises_no_alarm(seed, density):
    """Columns of another machine differ in their last digit, which such a set amplifies."""
    body = light_frame(seed, density)
    modes = cms.modes.herting(body, 2)
    last_digit = 1 + np.finfo(float).eps * np.random.default_rng(seed).normal(size=modes.columns.shape)
    elsewhere = replace(modes, columns=np.asarray(modes.columns) * last_digit)
    assert verdicts(body, modes, cms.reduce(body, elsewhere))["same-body"] == "pass"


@pytest.mark.parametrize("name", SETS)
def test_wrong_mass_of_a_mode_of_such_a_set_is_found(name):
    body = light_frame(35, 1e-3)
    modes = SETS[name](body, 2)
    reduced = cms.reduce(body, modes)
    for k in range(5):  # rounding hides up to 3e-3 of the mass of stiffer ones
        heavier = np.diag(np.where(np.arange(reduced.n_q) == k, 1.0001, 1.0)) @ reduced.M
        assert verdicts(body, modes, replace(reduced, M=heavier))["same-body"] == "fail", k


def test_rounding_of_a_shape_is_that_of_its_columns():
    """Two almost equal columns and their difference over its size: eps of the columns over that size."""
    body = light_frame(22, 1e-6)
    v = np.random.default_rng(0).normal(size=(body.n_dof, 1))
    V = np.hstack([v, (1 + 1e-6) * v])
    found = shape_rounding(body, V, np.array([[1.0, -1e6], [0.0, 1e6]]))
    length = np.where(body.dofs[:, 1] < 3, 1.0, body.length)
    sizes = [np.linalg.norm(length * v[:, 0]), *(np.sqrt(A.diagonal() @ v[:, 0] ** 2) for A in (body.M, body.K))]
    eps = np.finfo(float).eps
    for got, size in zip((found.motion, found.mass, found.stiffness), sizes, strict=True):
        assert_allclose(got, eps * size * np.array([1.0, 2e6 + 1]), rtol=1e-12, atol=0)
    turned = found.of_combinations(np.array([[0.0], [-2.0]]))
    assert_allclose(turned.mass, 2 * found.mass[1:], rtol=1e-12, atol=0)


def test_a_wrong_stiffness_or_frequency_among_them_is_found():
    body = light_frame(22, 1e-6)
    modes = cms.rubin(body, 2)
    reduced = cms.reduce(body, modes)
    frequencies, K = reduced.free_frequencies, np.diag(reduced.K)
    assert frequencies[-1] > 3e5 * frequencies[0]  # far beyond the ratio at which rounding counts
    for k in (0, 5, len(K) - 1):
        stiffer = np.diag(np.where(np.arange(len(K)) == k, 1.001 * K, K))
        assert verdicts(body, modes, replace(reduced, K=stiffer))["same-body"] == "fail", k
    wrong = np.where(np.arange(len(frequencies)) == 3, 1.001 * frequencies, frequencies)
    found = verdicts(body, modes, replace(reduced, free_frequencies=wrong))
    assert found["same-body"] == found["free-frequencies"] == "fail"
    fewer = verdicts(body, modes, replace(reduced, free_frequencies=frequencies[:5]))
    assert fewer["same-body"] == fewer["free-frequencies"] == "fail"
