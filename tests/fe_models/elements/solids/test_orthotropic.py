"""Orthotropic solids: against scikit-fem with a tensor made otherwise, turned meshes, and stress by compliance."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse.linalg as spl
import skfem
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from skfem.helpers import ddot, sym_grad

from fe_models import Material, solid_body, unit_system
from fe_models.body import AnisotropicMaterial, OrthotropicMaterial
from fe_models.body.rigid_motion import MassLoads
from fe_models.errors import MaterialError
from fe_models.meshes import as_mesh
from fe_models.meshes.boundary import boundary_nodes
from fe_models.meshes.mesh import SOLID_TYPES
from tests.bodies import STEEL, box_mesh, distorted

SI = unit_system("m-kg-s")
TURN = Rotation.from_rotvec([0.4, -0.9, 0.3]).as_matrix()
WOOD = OrthotropicMaterial(
    "spruce", young=(11e9, 0.9e9, 0.5e9), shear=(0.7e9, 0.6e9, 0.04e9), poisson=(0.4, 0.45, 0.5), rho=450.0
)
OBLIQUE = replace(WOOD, axes=tuple(tuple(row) for row in TURN.T))


def body_of(mesh, material, **more):
    return solid_body(mesh, material, name="block", units=SI, **more)


def tensor(material):
    """C_ijkl in mesh axes, (3, 3, 3, 3): the inverse of the compliance, index by index, then turned."""
    (E1, E2, E3), (G12, G13, G23), (n12, n13, n23) = material.young, material.shear, material.poisson
    S = [[1 / E1, -n12 / E1, -n13 / E1], [-n12 / E1, 1 / E2, -n23 / E2], [-n13 / E1, -n23 / E2, 1 / E3]]
    normal = np.linalg.inv(S)
    C = np.zeros((3, 3, 3, 3))
    for i in range(3):
        for j in range(3):
            C[i, i, j, j] = normal[i, j]
    for (i, j), G in (((0, 1), G12), ((0, 2), G13), ((1, 2), G23)):
        C[i, j, i, j] = C[i, j, j, i] = C[j, i, i, j] = C[j, i, j, i] = G
    R = np.array(material.axes).T
    return np.einsum("ia,jb,kc,ld,abcd->ijkl", R, R, R, R, C)


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_an_orthotropic_material_of_equal_moduli_is_the_isotropic_one(kind):
    mesh = distorted(box_mesh(2, 1, 1, 1.0, 0.7, 0.6, kind), 0.1)
    G = STEEL.E / (2 * (1 + STEEL.nu))
    same = OrthotropicMaterial("same", 3 * (STEEL.E,), 3 * (G,), 3 * (STEEL.nu,), STEEL.rho, axes=OBLIQUE.axes)
    ours, general = body_of(mesh, STEEL), body_of(mesh, same)
    assert_allclose(general.K.toarray(), ours.K.toarray(), rtol=0, atol=1e-11 * np.abs(ours.K.data).max())
    assert_allclose(general.M.toarray(), ours.M.toarray(), rtol=0, atol=0)


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_stiffness_turns_with_mesh_and_axes_together(kind):
    mesh = distorted(box_mesh(2, 1, 1, 1.0, 0.7, 0.6, kind), 0.1)
    K = body_of(mesh, WOOD).K.toarray()
    turned = body_of(replace(mesh, nodes=mesh.nodes @ TURN.T), OBLIQUE).K.toarray()
    R = np.kron(np.eye(len(mesh.nodes)), TURN)
    assert_allclose(turned, R @ K @ R.T, rtol=0, atol=1e-10 * np.abs(K).max())


@pytest.mark.parametrize(
    ("mesh_type", "element"),
    [(skfem.MeshTet1, skfem.ElementTetP1), (skfem.MeshTet1, skfem.ElementTetP2), (skfem.MeshHex1, skfem.ElementHex1)],
)
def test_forms_of_scikit_fem_give_the_same_stiffness(mesh_type, element):
    mesh = mesh_type.init_tensor(np.array([0, 0.7, 1.5]), np.array([0, 0.3]), np.array([0, 0.2]))
    basis = skfem.Basis(mesh, skfem.ElementVector(element()), intorder=4)
    C = tensor(OBLIQUE)

    @skfem.BilinearForm
    def elasticity(u, v, w):
        return ddot(np.einsum("ijkl,kl...->ij...", C, sym_grad(u)), sym_grad(v))

    K = elasticity.assemble(basis).toarray()
    ours = body_of(basis, OBLIQUE)
    from fe_models.meshes.objects.skfem_basis import nodes_of_basis

    dofs = nodes_of_basis(basis).dofs
    rows = 3 * dofs[:, 0] + dofs[:, 1]
    assert_allclose(K, ours.K.toarray()[np.ix_(rows, rows)], rtol=0, atol=1e-11 * np.abs(K).max())
    assert as_mesh(basis).n_cells == mesh.t.shape[1]


@pytest.mark.parametrize("incompatible", [False, True])
@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_constant_stress_along_a_material_axis_is_in_equilibrium_and_shown(kind, incompatible):
    """Patch test: sigma = s a₁a₁ᵀ strains by s/E_1 along a_1, -nu_12 s/E_1 and -nu_13 s/E_1 across."""
    mesh = distorted(box_mesh(2, 2, 2, 1.0, 0.7, 0.6, kind), 0.1)
    body = body_of(mesh, OBLIQUE, incompatible_modes=incompatible)
    a, s = np.array(OBLIQUE.axes), 1e6
    nu = np.array([-1.0, WOOD.poisson[0], WOOD.poisson[1]])
    strain = sum(-nu[k] * s / WOOD.young[0] * np.outer(a[k], a[k]) for k in range(3))
    u = (mesh.nodes @ strain.T).reshape(-1, 1)
    stress = body.element_model.nodal_stress(u)[:, :, 0]
    expected = s * np.outer(a[0], a[0])[[0, 1, 2, 1, 0, 0], [0, 1, 2, 2, 2, 1]]
    assert_allclose(stress, np.tile(expected, (len(mesh.nodes), 1)), rtol=0, atol=1e-9 * s)
    forces = (body.K @ u).reshape(-1, 3)
    inner = np.setdiff1d(np.arange(len(mesh.nodes)), boundary_nodes(mesh))
    assert inner.size
    assert_allclose(forces[inner], 0, rtol=0, atol=1e-10 * np.abs(forces).max())


@pytest.mark.parametrize("incompatible", [False, True])
@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_geometric_stiffness_turns_the_internal_forces(kind, incompatible):
    body = body_of(box_mesh(2, 1, 1, 1.0, 0.7, 0.6, kind), OBLIQUE, incompatible_modes=incompatible)
    rng = np.random.default_rng(1)
    u, theta = rng.standard_normal((body.n_dof, 2)), rng.standard_normal(3)
    turned = np.cross(theta, body.nodes).ravel()
    columns = np.column_stack([turned, np.eye(body.n_dof)[:, :9]])
    K = body.element_model.geometric_stiffness(u, MassLoads.none(2), columns)
    f = body.K @ u
    assert_allclose(body.element_model.internal_forces(u), f, rtol=0, atol=1e-11 * np.abs(f).max())
    expected = np.cross(theta, f.reshape(-1, 3, 2), axisb=1, axisc=1).reshape(body.n_dof, 2)
    assert_allclose(K[:, 1:, 0].T, expected[:9], rtol=0, atol=1e-11 * np.abs(expected).max())


def anisotropic(C, **more):
    return AnisotropicMaterial("a", tuple(tuple(row) for row in np.asarray(C).tolist()), 450.0, **more)


def test_an_anisotropic_material_of_an_orthotropic_tensor_is_the_orthotropic_one():
    """Rows xx yy zz yz xz xy of its own axes are 11 22 33 23 13 12."""
    mesh = distorted(box_mesh(2, 1, 1, 1.0, 0.7, 0.6, "hexahedron20"), 0.1)
    same = anisotropic(WOOD.stiffness, axes=OBLIQUE.axes)
    ours, general = body_of(mesh, OBLIQUE), body_of(mesh, same)
    assert_allclose(general.K.toarray(), ours.K.toarray(), rtol=0, atol=1e-11 * np.abs(ours.K.data).max())
    assert_allclose(same.E, max(WOOD.young), rtol=1e-12)
    turned = anisotropic(OBLIQUE.stiffness)  # the couplings of shear and stretch written out
    assert np.abs(OBLIQUE.stiffness[:3, 3:]).max() > 1e8
    K = body_of(mesh, turned).K.toarray()
    assert_allclose(K, ours.K.toarray(), rtol=0, atol=1e-11 * np.abs(ours.K.data).max())
    assert "anisotropic, stress by strain" in body_of(mesh, turned).provenance["material a"]


def test_anisotropic_materials_that_are_none_are_refused():
    C = WOOD.stiffness
    with pytest.raises(MaterialError, match="expected six rows of six finite numbers"):
        anisotropic(C[:5])
    lopsided = C.copy()
    lopsided[0, 4] = 1e8
    with pytest.raises(MaterialError, match=r"symmetric matrix, got 1e\+08 in row 1, column 5 and 0 across"):
        anisotropic(lopsided)
    soft = C.copy()
    soft[0, 3] = soft[3, 0] = 2e10
    with pytest.raises(MaterialError, match="some strains would have no energy"):
        anisotropic(soft)
    with pytest.raises(MaterialError, match="axes: expected three rows, orthonormal"):
        anisotropic(C, axes=((1, 0, 0), (0, 1, 0), (0, 0, -1)))


def test_isotropic_and_orthotropic_cells_stand_side_by_side():
    mesh = box_mesh(2, 1, 1, 1.0, 0.7, 0.6, "tetra10")
    both = body_of(mesh, {"left half": STEEL, "right half": OBLIQUE})
    left = body_of(mesh, {"left half": STEEL, "right half": replace(STEEL, E=1e-3)})
    right = body_of(mesh, {"left half": replace(STEEL, E=1e-3), "right half": OBLIQUE})
    K = left.K.toarray() + right.K.toarray()
    assert_allclose(both.K.toarray(), K, rtol=0, atol=1e-9 * np.abs(K).max())
    assert "orthotropic, E = [11000000000.0" in both.provenance["material spruce"]


WRONG = [
    ({"young": (1e9, -1e9, 1e9)}, "young: expected moduli above zero, got 1e"),
    ({"young": (1e9, 1e9)}, "young: expected three finite numbers"),
    ({"shear": (np.nan, 1e9, 1e9)}, "shear: expected three finite numbers"),
    ({"poisson": (0.4, 0.45, 1.5)}, "some strains would have negative energy"),
    ({"axes": ((1, 0, 0), (0, 1, 0), (0, 0, -1))}, "axes: expected three rows, orthonormal and right-handed"),
    ({"rho": -1.0}, "rho: expected a density of zero or more"),
]


@pytest.mark.parametrize(("wrong", "words"), WRONG)
def test_impossible_materials_are_refused(wrong, words):
    with pytest.raises(MaterialError, match=words):
        replace(WOOD, **wrong)


def test_poisson_ratios_above_one_half_are_possible_where_the_energy_is_positive():
    assert np.linalg.eigvalsh(replace(WOOD, poisson=(0.4, 0.45, 0.9)).stiffness).min() > 0


def test_stiffness_of_a_material_is_that_of_its_tensor():
    C = tensor(OBLIQUE)
    pairs = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
    voigt = np.array([[C[*p, *q] for q in pairs] for p in pairs])
    assert_allclose(OBLIQUE.stiffness, voigt, rtol=0, atol=1e-12 * np.abs(voigt).max())
    isotropic = Material("any", E=2.0, nu=0.3, rho=1.0)
    assert_allclose(np.linalg.inv(isotropic.stiffness)[0, :4], [0.5, -0.15, -0.15, 0], rtol=0, atol=1e-15)


def cross_ply(n_x=6, n_y=12, thickness=0.01):
    """A square plate of side 1 with three layers of equal thickness, 0, 90, 0 degrees, one brick each."""
    mesh = box_mesh(n_x, n_y, 3, 1.0, 1.0, thickness, "hexahedron20")
    middle = np.abs(mesh.nodes[mesh.cells["hexahedron20"]].mean(axis=1)[:, 2] - thickness / 2) < thickness / 6
    layers = {"outer": {"hexahedron20": np.flatnonzero(~middle)}, "middle": {"hexahedron20": np.flatnonzero(middle)}}
    return replace(mesh, cell_sets=layers)


def test_a_plate_of_three_layers_has_the_frequencies_of_laminate_theory():
    """Simply supported cross-ply: omega² rho h = D_11 a⁴ + 2 (D_12 + 2 D_66) a² b² + D_22 b⁴, a = m pi, b = n pi.

    D_ij = Σ Q_ij (z_k³ - z_(k-1)³)/3 of classical laminate theory; shear lowers the solid's frequencies by some
    (pi h)² E_1 / G_13 / 12, which is 0.1 % for h = 0.01, and twelve bricks along the waves raise them a little.
    """
    h, rho = 0.01, 1500.0
    E_1, E_2, G, nu = 140e9, 10e9, 5e9, 0.3
    ply = OrthotropicMaterial("0", (E_1, E_2, E_2), (G, G, 3.5e9), (nu, nu, 0.4), rho)
    across = replace(ply, name="90", axes=((0, 1, 0), (-1, 0, 0), (0, 0, 1)))
    mesh = cross_ply(thickness=h)
    body = body_of(mesh, {"outer": ply, "middle": across})
    Q = np.array([[E_1, nu * E_2], [nu * E_2, E_2]]) / (1 - nu**2 * E_2 / E_1)
    inner = (1 / 3) ** 3  # share of the middle third in ∫z² dz
    D = h**3 / 12 * ((1 - inner) * Q + inner * Q[::-1, ::-1])
    D_66 = G * h**3 / 12
    m = np.pi * np.array([[i, j] for i in (1, 2, 3) for j in (1, 2, 3, 4)])
    squares = D[0, 0] * m[:, 0] ** 4 + 2 * (D[0, 1] + 2 * D_66) * (m[:, 0] * m[:, 1]) ** 2 + D[1, 1] * m[:, 1] ** 4
    x, y, _ = mesh.nodes.T
    on_x, on_y = (x < 1e-9) | (x > 1 - 1e-9), (y < 1e-9) | (y > 1 - 1e-9)
    held = np.stack([on_y, on_x, on_x | on_y], axis=1).ravel()  # along the edge and across the plate
    free = np.flatnonzero(~held)
    K, M = body.K[free][:, free], body.M[free][:, free]
    start = np.random.default_rng(0).standard_normal(len(free))
    found = np.sort(spl.eigsh(K, 2, M, sigma=0, v0=start, return_eigenvectors=False))
    assert_allclose(np.sqrt(found), np.sort(np.sqrt(squares / (rho * h)))[:2], rtol=0.01, atol=0)
