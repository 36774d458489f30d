"""The whole line for shells: mesh, reduction, modal file, motion."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import fe_models as fm
import floatframe as ff

STEEL = fm.Material("steel", E=2e11, nu=0.3, rho=8000.0)
L, B, T = 1.0, 0.2, 0.004


@pytest.fixture(scope="module")
def reduced(tmp_path_factory):
    mesh = fm.shells.flat_plate(L, B, 20, 4)
    root = fm.shells.shell_interface(mesh, "root", fm.selections.NodeSet("u0"), reference=(0.0, B / 2, 0.0))
    flap = fm.shell_body(
        mesh, fm.shells.ShellProperty(T, STEEL), name="flap", units=cms.unit_system("m-kg-s"), interfaces=[root]
    )
    body = cms.couple(flap)
    made = cms.reduce(body, cms.craig_bampton(body, n_modes=4), frame=cms.NodalFrame("root"))
    path = tmp_path_factory.mktemp("shell") / "flap.h5"
    cms.write(made, path)
    return cms.read(path)


def test_the_file_of_a_shell_has_its_mass_and_inertia(reduced):
    m = STEEL.rho * L * B * T
    assert_allclose(reduced.moments.m, m, rtol=1e-12)
    assert reduced.moments.is_exact
    expected = np.diag([m * (B**2 + T**2) / 12, m * (L**2 / 3 + T**2 / 12), m * (L**2 / 3 + B**2 / 12)])
    assert_allclose(reduced.moments.J0, expected, rtol=0, atol=1e-12 * m)


def test_a_flap_clamped_to_the_ground_shakes_in_its_first_mode_and_shows_the_stress_of_its_root(reduced):
    """From rest under suddenly applied gravity: the tip swings about its static sag with the first frequency."""
    flap = ff.FlexibleBody("flap", reduced)
    clamp = ff.FixedJoint("clamp", ff.GROUND, ff.Marker("flap", "root"))
    system = ff.System([flap], [clamp], [ff.Gravity((0, 0, -9.81))], units=reduced.units)
    f_1 = 1.875104**2 / (2 * np.pi) * np.sqrt(STEEL.E * T**2 / 12 / STEEL.rho) / L**2  # a narrow strip
    motion = ff.integrate(system, ff.GeneralizedAlpha(rho_inf=1.0), t_end=1.0 / f_1, h=2e-4)
    q = motion.body("flap").q
    tip = int(np.argmin(np.linalg.norm(reduced.nodes - [L, 0.0, T / 2], axis=1)))
    w = q @ reduced.Phi[tip, 2]
    sag = STEEL.rho * T * 9.81 * L**4 / (8 * STEEL.E * T**3 / 12)  # per width, as a beam
    assert_allclose(w.min(), -2 * sag, rtol=0.1)  # the plate is stiffer than the strip, higher modes ripple
    half = motion.t[int(np.argmin(w))]
    assert_allclose(half, 0.5 / f_1, rtol=0.05)
    at_root = int(np.argmin(np.linalg.norm(reduced.nodes - [0.05, 0.0, T / 2], axis=1)))
    stress = reduced.stress[at_root, 0] @ q[int(np.argmin(w))]
    x = reduced.nodes[at_root, 0]
    static = 6 / T**2 * STEEL.rho * T * 9.81 * (L - x) ** 2 / 2
    assert_allclose(stress, 2 * static, rtol=0.15)
