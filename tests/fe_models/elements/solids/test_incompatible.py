"""Bricks of eight nodes with incompatible modes: patch test, bending, mass, stress, geometric stiffness, buckling."""

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.testing import assert_allclose, assert_array_equal

from fe_models.body.material import Material
from fe_models.body.rigid_motion import MassLoads
from fe_models.elements.solids.body import solid_body
from fe_models.errors import MeshError
from fe_models.foundation.units import unit_system
from fe_models.meshes.mesh import Mesh
from tests.bodies import ALUMINIUM, STEEL, box_mesh, distorted

ROUNDOFF = 1e-12
SI = unit_system("m-kg-s")
HALVES = {"left half": STEEL, "right half": ALUMINIUM}


def solid(mesh, materials=STEEL, incompatible_modes=True):
    return solid_body(mesh, materials, name="block", units=SI, incompatible_modes=incompatible_modes)


def rigid_motions(nodes):
    translations = np.tile(np.eye(3), (len(nodes), 1))
    return np.hstack([translations, np.stack([np.cross(axis, nodes).ravel() for axis in np.eye(3)], axis=1)])


def test_a_distorted_cell_has_six_rigid_motions_and_no_others_without_energy():
    body = solid(distorted(box_mesh(1, 1, 1), 0.4))
    K = body.K.toarray()
    lam = np.linalg.eigvalsh(K)
    assert lam[6] > 1e-3 * lam[-1]
    assert_allclose(K @ rigid_motions(body.nodes), 0, rtol=0, atol=100 * ROUNDOFF * np.abs(K).max())


def test_constant_stress_is_in_equilibrium_and_shown_on_a_distorted_mesh():
    body = solid(distorted(box_mesh(3, 3, 3), 0.3))
    inner = ~np.isclose(box_mesh(3, 3, 3).nodes % 1.0, 0).any(axis=1)
    gradient = np.random.default_rng(0).normal(size=(3, 3))
    u = (body.nodes @ gradient.T).ravel()
    forces = (body.K @ u).reshape(-1, 3)
    assert_allclose(forces[inner], 0, rtol=0, atol=ROUNDOFF * np.abs(body.K.data).max() * np.abs(u).max())
    strain = (gradient + gradient.T) / 2
    stress = STEEL.lam * np.trace(strain) * np.eye(3) + 2 * STEEL.mu * strain
    shown = body.element_model.nodal_stress(np.stack([u, -2 * u], axis=1))
    expected = np.tile(stress[[0, 1, 2, 1, 0, 0], [0, 1, 2, 2, 2, 1]], (len(body.nodes), 1))
    assert_allclose(shown[:, :, 0], expected, rtol=0, atol=1e-10 * np.abs(stress).max())
    assert_allclose(shown[:, :, 1], -2 * shown[:, :, 0], rtol=1e-10)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.4999])
def test_one_row_of_bricks_bends_as_a_beam_exactly(nu):
    """Pure bending, u = kappa (-x y, (x² + nu (y² - z²))/2, nu y z): EI kappa² L of energy, -E kappa y of stress."""
    L, b, h, kappa = 1.0, 0.2, 0.1, 1e-3
    material = Material("m", 2e11, nu, 7850.0)
    mesh = box_mesh(4, 1, 1, L, h, b)
    x, y, z = (mesh.nodes - [0, h / 2, b / 2]).T
    u = (kappa * np.stack([-x * y, (x**2 + nu * (y**2 - z**2)) / 2, nu * y * z], axis=1)).ravel()
    body = solid(mesh, material)
    energy = material.E * b * h**3 / 12 * kappa**2 * L
    assert_allclose(u @ (body.K @ u), energy, rtol=1e-9)
    expected = np.zeros((len(x), 6))
    expected[:, 0] = -material.E * kappa * y
    assert_allclose(
        body.element_model.nodal_stress(u[:, None])[:, :, 0], expected, rtol=0, atol=1e-7 * np.abs(expected).max()
    )
    plain = solid(mesh, material, incompatible_modes=False)
    assert u @ (plain.K @ u) > energy * (1 + material.mu / material.E * (L / 4 / h) ** 2)  # the shear it cannot avoid


def test_a_cantilever_of_one_row_has_the_frequency_of_a_beam():
    """Euler-Bernoulli, 20:1; trilinear bricks of the same mesh are more than half too high."""
    L, h, n = 1.0, 0.05, 10
    mesh = box_mesh(n, 1, 1, L, h, h)
    omega = 1.8751041**2 * np.sqrt(STEEL.E * h**2 / 12 / STEEL.rho) / L**2
    found = []
    for incompatible in (True, False):
        body = solid(mesh, incompatible_modes=incompatible)
        free = np.flatnonzero(np.repeat(body.nodes[:, 0] > 0, 3))
        K, M = (A[free][:, free] for A in (body.K.tocsr(), body.M.tocsr()))
        omega2 = spla.eigsh(K.tocsc(), 1, M.tocsc(), sigma=0, v0=np.ones(len(free)), return_eigenvectors=False)
        found.append(np.sqrt(omega2[0]) / omega)
    assert_allclose(found[0], 1.0, rtol=0.01)
    assert found[1] > 1.5


def test_mass_and_its_moments_are_those_of_the_trilinear_field():
    mesh = distorted(box_mesh(2, 2, 1), 0.2)
    body, plain = solid(mesh, HALVES), solid(mesh, HALVES, incompatible_modes=False)
    u = np.random.default_rng(0).normal(size=(body.n_dof, 3))
    assert_array_equal(body.M.toarray(), plain.M.toarray())
    assert_array_equal(body.element_model.mass_gram(u), plain.element_model.mass_gram(u))


@pytest.mark.parametrize("amount", [0.0, 0.3])
def test_a_rotation_turns_the_nodal_forces_whatever_the_shape(amount):
    """K_geo of a rigid rotation is theta × f, as close as the points that give both allow: to rounding."""
    body = solid(distorted(box_mesh(2, 2, 1), amount), HALVES)
    rng = np.random.default_rng(1)
    u, theta = rng.normal(size=(body.n_dof, 2)), rng.normal(size=3)
    turned = np.cross(theta, body.nodes).reshape(-1, 1)
    model = body.element_model
    K = model.geometric_stiffness(u, MassLoads.none(2), np.hstack([turned, np.eye(body.n_dof)]))
    f = model.internal_forces(u)
    assert_allclose(f, body.K @ u, rtol=0, atol=ROUNDOFF * np.abs(f).max())
    expected = np.cross(theta, f.reshape(-1, 3, 2), axisb=1, axisc=1).reshape(body.n_dof, 2)
    assert_allclose(K[:, 1:, 0].T, expected, rtol=0, atol=1e-11 * np.abs(K).max())
    some = np.array([0, 7])
    part = model.internal_forces(u, nodes=some).reshape(-1, 3, 2)
    assert_allclose(part[some], f.reshape(-1, 3, 2)[some], rtol=0, atol=ROUNDOFF * np.abs(f).max())
    assert not np.delete(part, some, axis=0).any()


def test_a_column_of_one_row_buckles_under_the_load_of_euler():
    L, h, n = 1.0, 0.05, 12
    material = Material("m", 2e11, 0.0, 7850.0)
    body = solid(box_mesh(n, 1, 1, L, h, h), material)
    x = body.nodes[:, 0]
    u = np.stack([-x / (material.E * h * h), 0 * x, 0 * x], axis=1).reshape(-1, 1)  # unit force
    free = np.flatnonzero(np.repeat(x > 0, 3))
    K_geo = body.element_model.geometric_stiffness(u, MassLoads.none(1), np.eye(body.n_dof)[:, free])[0]
    K = sp.csc_array(body.K.tocsr()[free][:, free])
    mu = spla.eigsh(K_geo, 1, K, which="SA", v0=np.ones(len(free)), return_eigenvectors=False)
    assert_allclose(-1 / mu[0], np.pi**2 * material.E * h**4 / 12 / (4 * L**2), rtol=0.005)


def test_cells_of_other_kinds_stay_as_they_are_and_the_body_says_which_bricks_it_has():
    wedges = distorted(box_mesh(2, 1, 1, kind="wedge"), 0.1)
    assert_array_equal(solid(wedges).K.toarray(), solid(wedges, incompatible_modes=False).K.toarray())
    assert "cells hexahedron with" not in solid(wedges).provenance
    assert solid(box_mesh(1, 1, 1)).provenance["cells hexahedron with"] == "incompatible modes"


def test_many_cells_are_those_of_chunks(monkeypatch):
    from fe_models.elements.solids import incompatible

    mesh = distorted(box_mesh(3, 3, 2), 0.2)
    u = np.random.default_rng(0).normal(size=(3 * len(mesh.nodes), 2))

    def results():
        body = solid(mesh, HALVES)
        model = body.element_model
        K_geo = model.geometric_stiffness(u, MassLoads.none(2), u)
        return [body.K.toarray(), model.nodal_stress(u), model.internal_forces(u), K_geo]

    at_once = results()
    monkeypatch.setattr(incompatible, "CELLS_AT_ONCE", 5)
    for whole, parts in zip(at_once, results(), strict=True):
        assert_allclose(parts, whole, rtol=0, atol=ROUNDOFF * np.abs(whole).max())


def test_inverted_bricks_are_named():
    nodes = np.array(box_mesh(2, 1, 1).nodes)
    cells = box_mesh(2, 1, 1).cells["hexahedron"]
    with pytest.raises(MeshError, match="1 of 2 hexahedron cells are inverted"):
        solid(Mesh(nodes, {"hexahedron": np.array([cells[0], cells[1][[4, 5, 6, 7, 0, 1, 2, 3]]])}))
