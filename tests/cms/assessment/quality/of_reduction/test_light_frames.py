"""Frames of light beams with point masses: their stiffest modes are up to 1e6 times as fast as the first."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import cms
import fe_models as fm
from cms.assessment.quality.reduction_check import check_reduction
from fe_models.foundation.units import unit_system

UNITS = unit_system("mm-t-s")
SETS = {"craig-bampton": cms.craig_bampton, "rubin": cms.rubin, "herting": cms.herting, "craig-chang": cms.craig_chang}


def light_frame(seed: int, density: float):
    """A chain of beams in space, turned and far from the origin [mm, t, s], with 1 to 20 kg at most of its nodes."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(5, 8))
    nodes = Rotation.random(random_state=seed).apply(1e3 * rng.normal(size=(n, 3))) + 3e4 * rng.normal(size=3)
    heavy = rng.choice(n, int(rng.integers(4, n + 1)), replace=False)
    masses = [fm.PointMass(int(node), mass=1e-3 * float(rng.uniform(1, 20))) for node in heavy]
    section = fm.BeamProperty(fm.Rectangle(50.0, 75.0), fm.Material("light", E=2e5, nu=0.3, rho=1e-12 * density))
    ports = [
        fm.Interface("a", "nodes", np.array([0]), nodes[0]), fm.Interface("b", "rigid", np.array([n - 1]), nodes[-1]),
    ]  # fmt: skip
    mesh = fm.LineMesh(nodes, np.array([(k, k + 1) for k in range(n - 1)]))
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
