"""Assembly: equal to scikit-fem's own and to a textbook sum, whatever the element; repeatable; bad meshes are named."""

from dataclasses import dataclass, replace
from math import factorial

import numpy as np
import pytest
import scipy.sparse as sp
import skfem
from numpy.testing import assert_allclose, assert_array_equal
from skfem.helpers import ddot, dot, eye, sym_grad, trace

import fe_models.elements.solids.assembly as assembly
import fe_models.foundation.threads as threads
from fe_models.elements.solids.assembly import assemble, expand_scalar_mass
from fe_models.elements.solids.elements import quadrature, reference_element
from fe_models.errors import MeshError
from fe_models.meshes.cell_shapes import shape_values, skfem_node_order
from fe_models.meshes.mesh import SOLID_TYPES, Mesh
from tests.bodies import ALUMINIUM, STEEL, box_mesh, distorted

ROUNDOFF = 1e-12


@dataclass(repr=False)
class MeshHexS2(skfem.MeshHex1):  # scikit-fem has the element, but no mesh class with its geometry
    elem: type = skfem.ElementHexS2
    affine: bool = False


MESHES = {
    "tetra": (skfem.MeshTet1, "tetra"),
    "tetra10": (skfem.MeshTet2, "tetra"),
    "hexahedron": (skfem.MeshHex1, "hexahedron"),
    "hexahedron20": (MeshHexS2, "hexahedron"),
    "hexahedron27": (skfem.MeshHex2, "hexahedron"),
    "wedge": (skfem.MeshWedge1, "wedge"),
}


def assembled(mesh, number=0):
    return assemble(mesh, (STEEL, ALUMINIUM), {kind: np.full(len(c), number) for kind, c in mesh.cells.items()})


def skfem_and_own_mesh(kind, amount):
    """The same curved mesh for scikit-fem and for this package."""
    mesh_class, corner_kind = MESHES[kind]
    corners = box_mesh(2, 2, 1, 1.0, 0.9, 0.6, corner_kind)
    t = corners.cells[corner_kind][:, skfem_node_order(corner_kind).argsort()]
    linear = MESHES[corner_kind][0](corners.nodes.T.copy(), t.T.astype(np.int32).copy())
    theirs = linear if mesh_class is type(linear) else mesh_class.from_mesh(linear)
    shift = np.random.default_rng(3).uniform(-amount, amount, theirs.doflocs.shape)
    theirs = replace(theirs, doflocs=theirs.doflocs + shift)
    cells = theirs.dofs.element_dofs[skfem_node_order(kind)].T
    return theirs, Mesh(theirs.doflocs.T, {kind: cells})


def skfem_matrix(theirs, form, table, element):
    return skfem.BilinearForm(form).assemble(
        skfem.CellBasis(theirs, element, quadrature=(table.points.T, table.weights))
    )


@pytest.mark.parametrize("amount", [0.0, 0.03])
@pytest.mark.parametrize("kind", MESHES)
def test_stiffness_and_mass_equal_those_of_scikit_fem(kind, amount):
    theirs, own = skfem_and_own_mesh(kind, amount)
    K, M_s = assembled(own)
    element, reference = theirs.elem(), reference_element(kind)

    def stiffness(u, v, w):
        strain = sym_grad(u)
        return ddot(STEEL.lam * eye(trace(strain), 3) + 2 * STEEL.mu * strain, sym_grad(v))

    their_K = skfem_matrix(theirs, stiffness, reference.stiffness, skfem.ElementVector(element))
    their_M = skfem_matrix(theirs, lambda u, v, w: STEEL.rho * u * v, reference.mass, element)
    assert_allclose((K - their_K).data, 0, rtol=0, atol=ROUNDOFF * np.abs(K.data).max())
    assert_allclose((M_s - their_M).data, 0, rtol=0, atol=ROUNDOFF * np.abs(M_s.data).max())
    vectors = skfem.ElementVector(element)
    their_M = skfem_matrix(theirs, lambda u, v, w: STEEL.rho * dot(u, v), reference.mass, vectors)
    difference = expand_scalar_mass(M_s) - their_M
    assert_allclose(difference.data, 0, rtol=0, atol=ROUNDOFF * np.abs(M_s.data).max())


def gauss_points(kind):
    """Many Gauss points, collapsed onto simplices: a rule with no table in common with the assembly."""
    x, w = np.polynomial.legendre.leggauss(8)
    x, w = (x + 1) / 2, w / 2
    r, s, t = (a.ravel() for a in np.meshgrid(x, x, x, indexing="ij"))
    weight = np.einsum("i,j,k->ijk", w, w, w).ravel()
    if kind.startswith("hex"):
        return np.stack([r, s, t], 1), weight
    if kind.startswith("wedge"):
        return np.stack([r, s * (1 - r), t], 1), weight * (1 - r)
    if kind.startswith("pyramid"):
        return np.stack([r * (1 - t), s * (1 - t), t], 1), weight * (1 - t) ** 2
    return np.stack([r, s * (1 - r), t * (1 - r) * (1 - s)], 1), weight * (1 - r) ** 2 * (1 - s)


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_mass_of_curved_elements_is_exact(kind):
    mesh = distorted(box_mesh(2, 1, 1, kind=kind), 0.2)
    points, weights = gauss_points(kind)
    N, dN = shape_values(kind, points)
    J = np.einsum("eai,qaj->eqij", mesh.nodes[mesh.cells[kind]], dN)
    blocks = np.einsum("eq,q,qa,qb->eab", np.linalg.det(J), STEEL.rho * weights, N, N)
    expected = np.zeros(2 * (len(mesh.nodes),))
    for cell, block in zip(mesh.cells[kind], blocks, strict=True):
        expected[np.ix_(cell, cell)] += block
    _, M_s = assembled(mesh)
    assert_allclose(M_s.toarray(), expected, rtol=0, atol=ROUNDOFF * expected.max())


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_shape_functions_equal_those_from_monomials(kind):
    table = reference_element(kind).mass
    N, dN = shape_values(kind, table.points)
    assert_allclose(table.values, N, rtol=0, atol=ROUNDOFF)
    assert_allclose(table.gradients, dN, rtol=0, atol=10 * ROUNDOFF)


def monomial_integral(cell, p):
    if cell == "hex":
        return 1 / np.prod(np.array(p) + 1.0)
    if cell == "wedge":
        return factorial(p[0]) * factorial(p[1]) / factorial(p[0] + p[1] + 2) / (p[2] + 1)
    return np.prod([factorial(i) for i in p]) / factorial(sum(p) + 3)


@pytest.mark.parametrize(
    ("cell", "label", "limits"),
    [
        ("tet", 1, 1),
        ("tet", 2, 2),
        ("tet", 5, 4),
        ("tet", 8, 7),
        ("hex", 3, (3, 3, 3)),
        ("hex", 5, (5, 5, 5)),
        ("hex", 9, (9, 9, 9)),
        ("wedge", (2, 3), (2, 3)),
        ("wedge", (3, 5), (3, 5)),
    ],
)
def test_quadrature_is_exact_to_the_degree_that_the_elements_need(cell, label, limits):
    points, weights = quadrature(cell, label)
    for p in np.ndindex(10, 10, 10):
        if cell == "tet":
            is_needed = sum(p) <= limits
        elif cell == "hex":
            is_needed = (np.array(p) <= limits).all()
        else:
            is_needed = p[0] + p[1] <= limits[0] and p[2] <= limits[1]
        if is_needed:
            value = weights @ np.prod(points**p, axis=1)
            assert_allclose(value, monomial_integral(cell, p), rtol=ROUNDOFF, atol=1e-14)


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_rigid_motion_carries_no_force(kind):
    mesh = distorted(box_mesh(2, 2, 2, 1.0, 0.8, 0.7, kind), 0.15)
    K, _ = assembled(mesh)
    translations = np.tile(np.eye(3), (len(mesh.nodes), 1))
    rotations = np.stack([np.cross(axis, mesh.nodes).ravel() for axis in np.eye(3)], axis=1)
    forces = K @ np.hstack([translations, rotations])
    assert_allclose(forces, 0, rtol=0, atol=ROUNDOFF * np.abs(K.data).max())


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_constant_stress_is_in_equilibrium_on_a_distorted_mesh(kind):
    mesh = distorted(box_mesh(3, 3, 3, kind=kind), 0.15)
    K, _ = assembled(mesh)
    on_boundary = np.isclose(box_mesh(3, 3, 3, kind=kind).nodes % 1.0, 0).any(axis=1)
    gradient = np.random.default_rng(0).normal(size=(3, 3))
    u = mesh.nodes @ gradient.T
    forces = (K @ u.ravel()).reshape(-1, 3)
    assert (~on_boundary).sum() >= 8
    assert_allclose(forces[~on_boundary], 0, rtol=0, atol=ROUNDOFF * np.abs(K.data).max())
    strain = (gradient + gradient.T) / 2
    stress = STEEL.lam * np.trace(strain) * np.eye(3) + 2 * STEEL.mu * strain
    volume = assembled(mesh)[1].sum() / STEEL.rho
    assert_allclose(u.ravel() @ K @ u.ravel(), np.sum(stress * strain) * volume, rtol=ROUNDOFF)


def test_elements_of_different_kinds_share_their_nodes():
    hexahedra = box_mesh(1, 2, 2, 0.5, kind="hexahedron")
    wedges = box_mesh(1, 2, 2, 0.5, kind="wedge")
    nodes = np.vstack([hexahedra.nodes, wedges.nodes + np.array([0.5, 0, 0])])
    unique, number = np.unique(nodes.round(12), axis=0, return_inverse=True)
    mesh = Mesh(
        unique,
        {
            "hexahedron": number[hexahedra.cells["hexahedron"]],
            "wedge": number[wedges.cells["wedge"] + len(hexahedra.nodes)],
        },
    )
    assert len(unique) == len(hexahedra.nodes) + len(wedges.nodes) - 9
    K, M_s = assembled(distorted(mesh, 0.1))
    parts = [assembled_part(distorted(mesh, 0.1), kind) for kind in mesh.cells]
    assert_allclose((K - parts[0][0] - parts[1][0]).data, 0, rtol=0, atol=ROUNDOFF * np.abs(K.data).max())
    assert_allclose((M_s - parts[0][1] - parts[1][1]).data, 0, rtol=0, atol=ROUNDOFF * M_s.data.max())


def assembled_part(mesh, kind):
    """The cells of one kind alone, spread back over all nodes."""
    used, cells = np.unique(mesh.cells[kind], return_inverse=True)
    K, M_s = assembled(Mesh(mesh.nodes[used], {kind: cells.reshape(mesh.cells[kind].shape)}))
    spread = sp.csr_array((np.ones(len(used)), (used, np.arange(len(used)))), shape=(len(mesh.nodes), len(used)))
    spread_3 = sp.kron(spread, sp.eye_array(3))
    return spread_3 @ K @ spread_3.T, spread @ M_s @ spread.T


def test_matrices_are_symmetric_and_repeat_bit_for_bit_whatever_the_threads_and_batches(monkeypatch):
    mesh = distorted(box_mesh(4, 4, 4, kind="tetra10"), 0.1)
    shuffle = np.random.default_rng(0).permutation(len(mesh.cells["tetra10"]))
    mesh = Mesh(mesh.nodes, {"tetra10": mesh.cells["tetra10"][shuffle]})
    K, M_s = assembled(mesh)
    assert_array_equal((K - K.T).data, 0)
    assert_array_equal((M_s - M_s.T).data, 0)
    for module in (assembly, threads):
        monkeypatch.setattr(module, "n_threads", lambda: 5)
    monkeypatch.setattr(assembly, "BATCH_BYTES", 1e5)
    K_5, M_5 = assembled(mesh)
    for one, other in ((K, K_5), (M_s, M_5)):
        assert_array_equal(one.indptr, other.indptr)
        assert_array_equal(one.indices, other.indices)
        assert_array_equal(one.data, other.data)


def test_compressed_form_is_sorted_unique_and_holds_32_bit_indices():
    K, M_s = assembled(box_mesh(3, 2, 2, kind="hexahedron20"))
    for matrix in (K, M_s, expand_scalar_mass(M_s)):
        assert matrix.indices.dtype == matrix.indptr.dtype == np.int32
        matrix.check_format(full_check=True)
        steps = np.diff(matrix.indices)
        steps[matrix.indptr[1:-1] - 1] = 1
        assert (steps > 0).all()


def test_wide_indices_give_the_same_matrices(monkeypatch):
    mesh = box_mesh(2, 2, 2, kind="tetra10")
    K, M_s = assembled(mesh)
    M = expand_scalar_mass(M_s)
    monkeypatch.setattr(assembly, "LARGEST_INT32", 2000)
    K_64, _ = assembled(mesh)
    M_64 = expand_scalar_mass(M_s)
    assert K_64.indices.dtype == np.int64
    assert_array_equal((K - K_64).data, 0)
    assert_array_equal((M - M_64).data, 0)


def test_inverted_elements_are_named():
    mesh = box_mesh(3, 1, 1, kind="tetra10")
    cells = mesh.cells["tetra10"].copy()
    cells[[4, 7]] = cells[[4, 7]][:, [0, 2, 1, 3, 6, 5, 4, 7, 9, 8]]
    with pytest.raises(MeshError, match=r"2 of 18 tetra10 cells are inverted or collapsed .*: cells 4, 7;"):
        assembled(Mesh(mesh.nodes, {"tetra10": cells}))


def test_folded_curved_element_is_named():
    mesh = box_mesh(1, 1, 1, kind="hexahedron20")
    nodes = mesh.nodes.copy()
    nodes[mesh.cells["hexahedron20"][0, 8]] = [0.5, 1.5, 0.0]
    with pytest.raises(MeshError, match="1 of 1 hexahedron20 cells are inverted"):
        assembled(Mesh(nodes, mesh.cells))


def test_collapsed_element_is_named():
    mesh = box_mesh(1, 1, 1, kind="hexahedron")
    with pytest.raises(MeshError, match="1 of 1 hexahedron cells are inverted or collapsed"):
        assembled(Mesh(mesh.nodes * [1, 1, 0], mesh.cells))


def test_nodes_without_cell_are_counted_and_the_cure_is_named():
    mesh = box_mesh(2, 1, 1)
    with pytest.raises(MeshError, match=r"2 of 14 nodes belong to no solid cell \(first: 12\); drop them first"):
        assembled(Mesh(np.vstack([mesh.nodes, [[5, 5, 5], [6, 6, 6]]]), mesh.cells))


def test_mesh_without_solid_cells_is_refused():
    with pytest.raises(MeshError, match="no solid cells"):
        assembled(Mesh(np.eye(3), {}))


@pytest.mark.parametrize(
    ("nodes", "cells", "message"),
    [
        (np.eye(4, 3), {"tetra": [[0, 1, 2, 4]]}, r"tetra: expected nodes 0\.\.3, got 0\.\.4"),
        (np.eye(4, 3), {"tetra": [[0, 1, 2]]}, r"tetra: expected \(n_cells, 4\) nodes, got \(1, 3\)"),
        (np.eye(4, 3) * np.nan, {"tetra": [[0, 1, 2, 3]]}, "4 nodes have coordinates that are not finite"),
        (np.eye(4, 3), {"pyramid14": [[0, 1, 2, 3, 3]]}, "unknown cell type 'pyramid14'"),
    ],
)
def test_garbage_is_refused(nodes, cells, message):
    with pytest.raises(MeshError, match=message):
        assembled(Mesh(nodes, cells))


def test_progress_rises_to_one():
    seen = []
    mesh = box_mesh(4, 4, 4, kind="hexahedron27")
    assemble(mesh, (STEEL, ALUMINIUM), {"hexahedron27": np.zeros(64, int)}, progress=seen.append)
    assert seen == sorted(seen)
    assert_allclose(seen[-1], 1.0, rtol=1e-15)
