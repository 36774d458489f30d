import numpy as np
import pytest
import scipy.sparse as sp
import skfem
from numpy.testing import assert_allclose, assert_array_equal
from skfem.helpers import ddot, dot, eye, sym_grad, trace

from fe_models import Material, rigid_interface, solid_body
from fe_models.errors import BodyError, MeshError
from fe_models.files import body_from_skfem
from fe_models.foundation.units import unit_system
from fe_models.meshes import NodeCloud, as_mesh
from fe_models.selections import FaceGroup, Plane

SI = unit_system("m-kg-s")
STEEL = Material("steel", E=2.1e11, nu=0.3, rho=7850.0)
ELEMENTS = {
    "tetra": (skfem.MeshTet1, skfem.ElementTetP1),
    "tetra10": (skfem.MeshTet1, skfem.ElementTetP2),
    "hexahedron": (skfem.MeshHex1, skfem.ElementHex1),
    "hexahedron20": (skfem.MeshHex1, skfem.ElementHexS2),
    "hexahedron27": (skfem.MeshHex1, skfem.ElementHex2),
}


@skfem.BilinearForm
def elasticity(u, v, w):
    strain = sym_grad(u)
    stress = STEEL.lam * eye(trace(strain), 3) + 2 * STEEL.mu * strain
    return ddot(stress, sym_grad(v))


@skfem.BilinearForm
def inertia(u, v, w):
    return STEEL.rho * dot(u, v)


def bar(mesh_type):
    mesh = mesh_type.init_tensor(np.array([0, 0.7, 1.5]), np.array([0, 0.3]), np.array([0, 0.2]))
    return mesh.with_boundaries({"end": lambda x: x[0] == 0})


def assembled(mesh, element, intorder=6):
    basis = skfem.Basis(mesh, skfem.ElementVector(element), intorder=intorder)
    return basis, elasticity.assemble(basis), inertia.assemble(basis)


@pytest.mark.parametrize("kind", ELEMENTS)
def test_forms_of_scikit_fem_give_our_matrices(kind):
    """Same mesh, same elements, two assemblies: K and M agree to rounding once the dofs are in one order."""
    mesh_type, element = ELEMENTS[kind]
    basis, K, M = assembled(bar(mesh_type), element())
    theirs = body_from_skfem(basis, K, M, name="bar", units=SI)
    ours = solid_body(basis, STEEL, name="bar", units=SI)
    assert list(as_mesh(basis).cells) == [kind]
    assert_array_equal(theirs.nodes, ours.nodes)
    rows = 3 * theirs.dofs[:, 0] + theirs.dofs[:, 1]
    for A, B in ((theirs.K, ours.K), (theirs.M, ours.M)):
        B = B.toarray()[np.ix_(rows, rows)]
        assert_allclose(A.toarray(), B, rtol=0, atol=1e-11 * np.abs(B).max())


def test_a_curved_mesh_with_elements_as_curved_is_a_free_body():
    mesh = skfem.MeshTet2.init_ball(1)
    basis, K, M = assembled(mesh, skfem.ElementTetP2())
    body = body_from_skfem(basis, K, M, name="ball", units=SI)
    gram = body.element_model.mass_gram(np.zeros((body.n_dof, 0)))
    volume = gram[0, 0] / STEEL.rho
    assert 0.9 * 4 / 3 * np.pi < volume < 4 / 3 * np.pi
    assert_allclose(gram[1, 1] + gram[2, 2] + gram[3, 3], 0.6 * gram[0, 0], rtol=0.05, atol=0)
    curved = skfem.Basis(mesh, skfem.ElementTetP2(), intorder=6)
    square = skfem.Functional(lambda w: STEEL.rho * (w.x**2).sum(axis=0)).assemble(curved)
    assert_allclose(gram[1, 1] + gram[2, 2] + gram[3, 3], square, rtol=1e-10, atol=0)
    assert_allclose(body.M.sum(), 3 * gram[0, 0], rtol=1e-12, atol=0)


def test_interfaces_on_the_basis_select_all_nodes_of_its_element():
    basis, K, M = assembled(bar(skfem.MeshTet1), skfem.ElementTetP2())
    end = rigid_interface(basis, "end", FaceGroup("end"))
    body = body_from_skfem(basis, K, M, name="bar", units="m-kg-s", interfaces=[end])
    assert len(end.nodes) == 9
    assert_array_equal(np.flatnonzero(body.nodes[:, 0] == 0), end.nodes)
    assert body.provenance["mass moments"].startswith("exact")


def test_elements_of_other_kinds_are_told_by_their_shape_functions():
    mesh = bar(skfem.MeshTet1)
    basis, K, M = assembled(mesh, skfem.ElementTetCR())
    body = body_from_skfem(basis, K, M, name="bar", units=SI)
    assert len(body.nodes) == mesh.facets.shape[1]
    assert_allclose(body.M.sum(), 3 * 7850 * 1.5 * 0.3 * 0.2, rtol=1e-12, atol=0)
    with pytest.raises(MeshError, match=r"no cell type here has its nodes.*NodeCloud"):
        as_mesh(basis)
    side = rigid_interface(NodeCloud(body.nodes), "side", Plane((0, 0, 0), (0, 1, 0)))
    assert len(side.nodes) == np.count_nonzero(mesh.p[1][mesh.facets].max(axis=0) == 0) == 4


def refused(mesh, element, words):
    basis = skfem.Basis(mesh, element, intorder=4)
    with pytest.raises(MeshError, match=words):
        body_from_skfem(basis, sp.eye(basis.N), sp.eye(basis.N), name="bar", units=SI)


def test_bases_whose_dofs_are_no_values_at_points_are_refused():
    tets = bar(skfem.MeshTet1)
    refused(tets, skfem.ElementVector(skfem.ElementTetMini()), "sum of its shape functions is off one")
    refused(tets, skfem.ElementTetN0(), "shape functions with several components")
    refused(tets, skfem.ElementTetP1(), "expected ElementVector")
    refused(skfem.MeshTri(), skfem.ElementVector(skfem.ElementTriP1()), "expected a mesh in space, got 2 dimensions")
    refused(skfem.MeshTet2.init_ball(1), skfem.ElementVector(skfem.ElementTetP1()), "as curved as the mesh")


def test_condensed_or_held_matrices_are_refused():
    basis, K, M = assembled(bar(skfem.MeshTet1), skfem.ElementTetP1())
    with pytest.raises(BodyError, match=r"K: expected a matrix over the 36 dofs of the basis, got \(24, 24\)"):
        body_from_skfem(basis, K[12:, 12:], M, name="bar", units=SI)
    springs = sp.diags(np.where(np.arange(36) < 3, 1e9, 0.0))
    with pytest.raises(BodyError, match="not the matrices of a free body"):
        body_from_skfem(basis, K + springs, M, name="bar", units=SI)


def test_matrices_in_another_order_than_the_basis_are_refused():
    basis, K, M = assembled(bar(skfem.MeshTet1), skfem.ElementTetP1())
    turned = np.random.default_rng(2).permutation(basis.N)
    with pytest.raises(BodyError, match="not the matrices of a free body"):
        body_from_skfem(basis, K[turned][:, turned], M[turned][:, turned], name="bar", units=SI)
