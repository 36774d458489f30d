"""Matrices of no free body are noticed: what is meant to be held says so, what is a mistake is named."""

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from numpy.testing import assert_allclose

from fe_models.body.freedom import rigid_forces
from fe_models.body.positive_mass import negative_mass, positive_mass
from fe_models.errors import BodyError, MeshError
from fe_models.files.matrices.given import body_from_matrices, body_from_npz
from fe_models.foundation.units import unit_system
from tests.bodies import bar, beam, chain

SI = unit_system("m-kg-s")
BODIES = {"solid": bar(4, 2, 2, kind="hexahedron"), "beam": beam(10)}


@pytest.fixture(params=list(BODIES))
def free(request):
    return BODIES[request.param]


def made(free, *, M=None, K=None, nodes=None, dofs=None, units=SI, **options):
    """The body again from its matrices, some of them changed."""
    return body_from_matrices(
        free.M if M is None else M, free.K if K is None else K, free.nodes if nodes is None else nodes,
        free.dofs if dofs is None else dofs, name="foreign", units=units, **options,
    )  # fmt: skip


def grounded(free, nodes, stiffness):
    K = free.K.tolil()
    for k in np.flatnonzero(np.isin(free.dofs[:, 0], nodes)):
        K[k, k] += stiffness
    return sp.csc_array(K)


# Forces of rigid motion ----------------------------------------------------------------------------------------------


def test_energy_and_frequency_of_a_rigid_body_on_springs():
    """On four springs in each direction: omega² = 4 k / m (to the rounding of K), whatever the body is."""
    free = BODIES["solid"]
    K = grounded(free, [0, 7, 20, 44], 5e3)
    forces = rigid_forces(K, free.M, free.nodes, free.dofs)
    mass = free.M.sum() / 3
    assert_allclose(np.diag(forces.energy)[:3], 2e4, rtol=1e-5)
    assert_allclose(forces.rigid_body_frequency[:3], np.sqrt(2e4 / mass) / (2 * np.pi), rtol=1e-5)
    assert not forces.is_free
    assert forces.n_free == 0
    assert set(free.dofs[forces.rows, 0]) == {0, 7, 20, 44}


def test_motions_that_the_dofs_cannot_make_are_not_asked_for():
    row = chain(5)
    assert rigid_forces(row.K, row.M, row.nodes, row.dofs).is_possible.tolist() == [True] + [False] * 5
    plane = beam(4)
    kept = np.flatnonzero(np.isin(plane.dofs[:, 1], [0, 1, 5]))
    forces = rigid_forces(plane.K[kept][:, kept], plane.M[kept][:, kept], plane.nodes, plane.dofs[kept])
    assert forces.is_possible.tolist() == [True, True, False, False, False, True]
    assert forces.is_free


def test_nodes_with_six_digits_are_those_of_a_free_body():
    free = BODIES["solid"]
    turn = la.expm(np.cross(np.eye(3), [0.3, -0.2, 0.5]))
    T = np.kron(np.eye(len(free.nodes)), turn)
    nodes = np.round(free.nodes @ turn.T, 7)
    assert made(free, M=sp.csc_array(T @ free.M @ T.T), K=sp.csc_array(T @ free.K @ T.T), nodes=nodes).n_dof


# Supports that are meant ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("stiffness", [1e2, 1e9])
def test_springs_to_the_ground_are_held_if_they_say_so_and_refused_if_not(free, stiffness):
    nodes = [0, 3, 5, 8]
    K = grounded(free, nodes, stiffness)
    with pytest.raises(BodyError, match=r"not the matrices of a free body: .* say so: held = true"):
        made(free, K=K)
    held = made(free, K=K, held=True)
    assert held.is_held
    assert held.provenance["held"] == "to the ground, as declared"


def test_rows_taken_out_are_named_and_a_support_where_it_is_said(free):
    keep = np.flatnonzero(free.dofs[:, 0] != 0)
    keep = np.flatnonzero(free.nodes[free.dofs[:, 0], 0] > 0) if len(free.nodes) > 20 else keep
    M, K = free.M[keep][:, keep], free.K[keep][:, keep]
    with pytest.raises(BodyError, match=r"rows that other nodes have are missing, such as component 0 of node 0"):
        made(free, M=M, K=K, dofs=free.dofs[keep])
    held = made(free, M=M, K=K, dofs=free.dofs[keep], held=True)
    first = np.sqrt(la.eigvalsh(held.K.toarray(), held.M.toarray())[0]) / (2 * np.pi)
    assert first > 1.0  # a cantilever


def test_a_free_body_is_not_held_and_a_half_held_one_is_neither(free):
    with pytest.raises(BodyError, match=r"K answers no rigid-body motion, so the body is free; remove held"):
        made(free, held=True)
    K = free.K.tolil()
    K[0, 0] += 1e6
    with pytest.raises(BodyError, match=r"5 of the rigid-body motions stay free while others are held"):
        made(free, K=sp.csc_array(K), held=True)


def test_a_file_says_that_its_body_is_held(tmp_path):
    free = BODIES["beam"]
    arrays = {"M": free.M.toarray(), "K": grounded(free, [0], 1e7).toarray(), "nodes": free.nodes, "dofs": free.dofs}
    np.savez(tmp_path / "held.npz", **arrays, units="m-kg-s", held=1)
    assert body_from_npz(tmp_path / "held.npz").is_held
    np.savez(tmp_path / "free.npz", **arrays, units="m-kg-s")
    with pytest.raises(BodyError, match=r"not the matrices of a free body"):
        body_from_npz(tmp_path / "free.npz")
    np.savez(tmp_path / "odd.npz", **arrays, units="m-kg-s", held="yes")
    with pytest.raises(MeshError, match=r"held: expected one number, 0 or 1"):
        body_from_npz(tmp_path / "odd.npz")


# Mistakes, which are refused whatever is said ------------------------------------------------------------------------


@pytest.mark.parametrize("held", [False, True])
def test_a_penalty_on_the_diagonal_is_named(free, held):
    K = free.K.tolil()
    K[5, 5] += 1e36
    with pytest.raises(BodyError, match=r"K has 1e\+36 on the diagonal of row 5 \(node .*: a support by penalty"):
        made(free, K=sp.csc_array(K), held=held)


@pytest.mark.parametrize("held", [False, True])
def test_exchanged_nodes_are_found(free, held):
    nodes = free.nodes.copy()
    nodes[[3, 7]] = nodes[[7, 3]]
    with pytest.raises(BodyError, match=r"nodes 3 and 7 are exchanged"):
        made(free, nodes=nodes, held=held)


def test_a_node_elsewhere_is_found_with_its_true_place(free):
    nodes = free.nodes.copy()
    nodes[4] += [0.01, 0.02, 0.0]
    with pytest.raises(BodyError, match=r"1 of them, node 4 at .* by K node 4 belongs to"):
        made(free, nodes=nodes)


@pytest.mark.parametrize("held", [False, True])
def test_the_order_of_rows_is_named(free, held):
    order = np.lexsort((free.dofs[:, 0], free.dofs[:, 1]))
    with pytest.raises(BodyError, match=r"the rows are in component-major order and dofs list another"):
        made(free, M=free.M[order][:, order], K=free.K[order][:, order], held=held)
    with pytest.raises(BodyError, match=r"the rows are in node-major order and dofs list another"):
        made(free, dofs=free.dofs[order], held=held)


def test_multipliers_are_no_part_of_a_foreign_body(free):
    dofs = free.dofs.copy()
    dofs[3, 1] = -1
    with pytest.raises(BodyError, match=r"expected components 0 to 5, got -1 in row 3"):
        made(free, dofs=dofs)


# Units ---------------------------------------------------------------------------------------------------------------


def test_nodes_in_another_length_than_the_matrices_are_named():
    with pytest.raises(BodyError, match=r"the nodes are in mm beside matrices in m: times 0.001 everything fits"):
        made(BODIES["beam"], nodes=1e3 * BODIES["beam"].nodes)
    with pytest.raises(BodyError, match=r"the nodes seem to be in mm, but the matrices in m-kg-s: multiplied by 0.001"):
        made(BODIES["solid"], nodes=1e3 * BODIES["solid"].nodes)
    small = bar(4, 2, 2, length=0.2, width=0.02, height=0.02, kind="hexahedron")
    with pytest.raises(BodyError, match=r"convex hull of .* kg/m³; expected 0.001 to 25000 kg/m³; the nodes seem"):
        made(small, nodes=1e3 * small.nodes)


def test_implausible_units_can_be_meant(caplog):
    solid = BODIES["solid"]
    with pytest.raises(BodyError, match=r"all numbers would fit m-kg-s"):
        made(solid, units=unit_system("mm-t-s"))
    assert made(solid, units=unit_system("mm-t-s"), accept=["units"]).n_dof == solid.n_dof
    assert "convex hull" in caplog.text
    with pytest.raises(BodyError, match=r"accept: unknown 'parts'"):
        made(solid, accept=["parts"])


# Mass ----------------------------------------------------------------------------------------------------------------


def indefinite(free, least):
    """The mass with its smallest eigenvalue replaced by a part of its largest."""
    values, V = la.eigh(free.M.toarray())
    return free.M.toarray() + (least * values[-1] - values[0]) * np.outer(V[:, 0], V[:, 0])


def test_a_slightly_indefinite_mass_is_refused_with_the_remedy_and_mended_by_it():
    free = BODIES["solid"]
    M = indefinite(free, -2e-6)
    with pytest.raises(BodyError, match=r"M is indefinite: 1 eigenvalues below zero, down to -2.*repair_mass = true"):
        made(free, M=M)
    mended = made(free, M=M, repair_mass=True)
    values = la.eigvalsh(mended.M.toarray())
    assert values[0] > -1e-12 * values[-1]
    assert_allclose(mended.M.toarray(), M, rtol=0, atol=3e-6 * values[-1])
    assert "1 negative eigenvalues" in mended.provenance["mass mended"]


def test_another_matrix_is_not_mended():
    free = BODIES["solid"]
    with pytest.raises(BodyError, match=r"expected at least -1e-03, which could be repaired"):
        made(free, M=indefinite(free, -0.1), repair_mass=True)
    with pytest.raises(BodyError, match=r"M: expected a positive mass"):
        made(free, M=-free.M)


def test_negative_eigenvalues_of_a_large_mass_are_found_by_lanczos(monkeypatch):
    free = BODIES["solid"]
    M = sp.csc_array(indefinite(free, -2e-5))
    dense, _ = negative_mass(M, free.dofs)
    monkeypatch.setattr("fe_models.body.positive_mass.DENSE", 10)
    sparse, vectors = negative_mass(M, free.dofs)
    assert len(sparse) == len(dense) == 1
    mended = M.toarray() + (vectors * np.abs(sparse)) @ vectors.T
    assert la.eigvalsh(mended)[0] > -1e-9 * np.abs(mended).max()


def test_a_sound_mass_stays_as_it_is(free):
    assert positive_mass(free) is free
