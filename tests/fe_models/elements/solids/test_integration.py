"""Reduced integration and lumped mass, against sums over Gauss points written out here."""

import itertools

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fe_models.elements.solids.body import solid_body
from fe_models.foundation.errors import BodyError
from fe_models.foundation.units import unit_system
from fe_models.meshes.cell_shapes import shape_values
from tests.bodies import STEEL, box_mesh, distorted

THIRDS = (np.array([[1 / 6, 1 / 6], [2 / 3, 1 / 6], [1 / 6, 2 / 3]]), np.full(3, 1 / 6))
GAUSS_2 = (np.array([0.5 - 0.5 / np.sqrt(3), 0.5 + 0.5 / np.sqrt(3)]), np.array([0.5, 0.5]))

GAUSS_3 = (np.array([0.5 - np.sqrt(0.15), 0.5, 0.5 + np.sqrt(0.15)]), np.array([5, 8, 5]) / 18)


def points_of(kind):
    """Points and weights of the reduced rule: 2 x 2 x 2, one point x 2, three x 3, or the four of a tetrahedron."""
    x, w = GAUSS_2
    if kind.startswith("hex"):
        return np.array(list(itertools.product(x, x, x))), np.full(8, 1 / 8)
    if kind.startswith("wedge"):
        triangle, area = THIRDS if kind == "wedge15" else (np.array([[1 / 3, 1 / 3]]), np.array([0.5]))
        x, w = GAUSS_3 if kind == "wedge15" else GAUSS_2
        return np.array([[*p, z] for p in triangle for z in x]), np.array([a * b for a in area for b in w])
    a, b = (5 - np.sqrt(5)) / 20, (5 + 3 * np.sqrt(5)) / 20
    return np.full((4, 3), a) + (b - a) * np.vstack([np.zeros(3), np.eye(3)]), np.full(4, 1 / 24)


def matrices_by_points(mesh, kind):
    """K and the scalar mass as sums over the points of `points_of`."""
    points, weights = points_of(kind)
    N, dN = shape_values(kind, points)
    n = len(mesh.nodes)
    K, M = np.zeros((3 * n, 3 * n)), np.zeros((n, n))
    C = STEEL.lam * np.einsum("ij,kl->ijkl", np.eye(3), np.eye(3))
    C += STEEL.mu * (np.einsum("ik,jl->ijkl", np.eye(3), np.eye(3)) + np.einsum("il,jk->ijkl", np.eye(3), np.eye(3)))
    for cell in mesh.cells[kind]:
        dofs = (3 * cell[:, None] + np.arange(3)).ravel()
        for values, slopes, weight in zip(N, dN, weights, strict=True):
            J = mesh.nodes[cell].T @ slopes
            gradient = slopes @ np.linalg.inv(J)
            measure = weight * np.linalg.det(J)
            block = np.einsum("aj,ijkl,bl->aibk", gradient, C, gradient).reshape(len(dofs), -1)
            K[np.ix_(dofs, dofs)] += measure * block
            M[np.ix_(cell, cell)] += STEEL.rho * measure * np.outer(values, values)
    return K, M


@pytest.mark.parametrize("kind", ["hexahedron20", "wedge", "wedge15", "tetra10"])
def test_reduced_stiffness_and_mass_are_sums_over_few_points(kind):
    mesh = distorted(box_mesh(2, 1, 1, kind=kind), 0.1)
    body = solid_body(mesh, STEEL, name="b", units=unit_system("m-kg-s"), integration="reduced", mass="reduced")
    K, M = matrices_by_points(mesh, kind)
    assert_allclose(body.K.toarray(), K, rtol=0, atol=1e-11 * np.abs(K).max())
    assert_allclose(body.M.toarray(), np.kron(M, np.eye(3)), rtol=0, atol=1e-11 * np.abs(M).max())
    u = np.random.default_rng(1).normal(size=(body.n_dof, 2))
    forces = body.element_model.internal_forces(u)
    assert_allclose(forces, body.K @ u, rtol=0, atol=1e-11 * np.abs(body.K @ u).max())
    assert body.provenance["integration of the stiffness"] == "reduced"


@pytest.mark.parametrize("kind", ["tetra", "hexahedron20", "wedge15"])
def test_lumped_mass_is_diagonal_positive_and_has_the_mass_of_the_body(kind):
    mesh = box_mesh(2, 1, 1, kind=kind)
    body = solid_body(mesh, STEEL, name="b", units=unit_system("m-kg-s"), mass="lumped")
    M = body.M.toarray()
    assert_allclose(M, np.diag(M.diagonal()), rtol=0, atol=0)
    assert M.diagonal().min() > 0
    assert_allclose(M.diagonal()[::3].sum(), STEEL.rho, rtol=1e-12)


def test_unknown_rules_are_refused():
    mesh = box_mesh(1, 1, 1)
    with pytest.raises(BodyError, match="integration: unknown 'redused'; did you mean 'reduced'"):
        solid_body(mesh, STEEL, name="b", units=unit_system("m-kg-s"), integration="redused")
    with pytest.raises(BodyError, match="mass: unknown 'lump'"):
        solid_body(mesh, STEEL, name="b", units=unit_system("m-kg-s"), mass="lump")
