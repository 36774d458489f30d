"""From matrices that were read to a body: nodes, the order of rows, supports, local axes; on a block of Abaqus."""

import gzip
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from numpy.testing import assert_allclose, assert_array_equal

import fe_models
import fe_models.files.matrices.body
from fe_models.errors import BodyError, MatrixError
from fe_models.files.read_matrices import in_basic_axes
from fe_models.meshes.cell_shapes import shape_values

DATA = Path(__file__).parent / "data" / "abaqus"
SI = fe_models.unit_system("m-kg-s")


@pytest.fixture(scope="module")
def read(tmp_path_factory):
    """The matrices of the block of C3D10 (E 2e11, nu 0.3, rho 2900), 4 x 1 x 1 m."""
    folder = tmp_path_factory.mktemp("block")
    paths = []
    for name in ("blockC3D10_STIF1.mtx", "blockC3D10_MASS1.mtx"):
        paths.append(folder / name)
        paths[-1].write_bytes(gzip.decompress((DATA / f"{name}.gz").read_bytes()))
    return fe_models.files.read_matrices(paths)


@pytest.fixture(scope="module")
def geometry():
    return fe_models.files.read_geometry(DATA / "blockC3D10.inp")


@pytest.fixture(scope="module")
def block(read, geometry):
    return fe_models.files.body_from_foreign(read, geometry, name="block", units=SI)


@pytest.fixture(scope="module")
def ours(geometry):
    """The same mesh with our own elements."""
    steel = fe_models.Material("steel", E=2e11, nu=0.3, rho=2900.0)
    return fe_models.solid_body(geometry, steel, name="ours", units=SI)


def four_point_stiffness(mesh, E, nu):
    """Assemble quadratic tetrahedra with four points, in plain loops."""
    lam, mu = E * nu / (1 + nu) / (1 - 2 * nu), E / 2 / (1 + nu)
    C = np.diag([2 * mu] * 3 + [mu] * 3)
    C[:3, :3] += lam
    a, b = (5 + 3 * np.sqrt(5)) / 20, (5 - np.sqrt(5)) / 20
    points = np.array([[b, b, b], [a, b, b], [b, a, b], [b, b, a]])
    _, dN = shape_values("tetra10", points)
    K = np.zeros((3 * len(mesh.nodes), 3 * len(mesh.nodes)))
    for nodes in mesh.cells["tetra10"]:
        rows = (3 * nodes[:, None] + np.arange(3)).ravel()
        for gradient in dN:
            J = mesh.nodes[nodes].T @ gradient
            B = np.zeros((6, 30))
            for k, (x, y, z) in enumerate(gradient @ np.linalg.inv(J)):
                B[:, 3 * k : 3 * k + 3] = [[x, 0, 0], [0, y, 0], [0, 0, z], [0, z, y], [z, 0, x], [y, x, 0]]
            K[np.ix_(rows, rows)] += B.T @ C @ B * np.linalg.det(J) / 24
    return K


def frequencies(body):
    """The first ten elastic frequencies, (10,) [Hz]."""
    values = la.eigh(body.K.toarray(), body.M.toarray(), eigvals_only=True, subset_by_index=(0, 15))
    assert np.abs(values[:6]).max() < 1e-9 * values[6]
    return np.sqrt(values[6:]) / (2 * np.pi)


def test_matrices_of_abaqus_are_those_of_a_quadratic_tetrahedron_with_four_points(block, ours, geometry):
    K = four_point_stiffness(geometry, 2e11, 0.3)
    assert_allclose(block.K.toarray(), K, rtol=0, atol=1e-14 * np.abs(K).max())
    assert_allclose(block.M.toarray(), ours.M.toarray(), rtol=0, atol=1e-14 * np.abs(ours.M).max())
    # our stiffness takes more points; the middle nodes of the deck are rounded and so off the middle by 1e-8
    assert_allclose(block.K.toarray(), ours.K.toarray(), rtol=0, atol=3e-8 * np.abs(K).max())
    assert_allclose(frequencies(block), frequencies(ours), rtol=1e-9, atol=0)


def test_the_record_of_the_body_names_files_triangles_and_what_was_assumed(block):
    record = block.provenance
    assert "blockC3D10_STIF1.mtx" in record["mesh"]
    assert "blockC3D10.inp" in record["mesh"]
    assert len([value for key, value in record.items() if key.startswith("file ") and len(value) == 64]) == 3
    assert record["triangles"] == "K both, M both"
    assert "rows taken as 3 to a node" in record["notes"]
    assert record["mass moments"].startswith("exact")


def penalised(read, rows):
    """The stiffness with 1e36 on some of its diagonal, as Abaqus writes supports."""
    K = read.K.tolil()
    for row in rows:
        K[row, row] = 1e36
    return replace(read, K=sp.csc_array(K))


def test_supports_are_refused_by_default_and_removed_on_request(read, geometry, block):
    held = penalised(read, [0, 1, 2, 4, 30])
    with pytest.raises(BodyError, match="support by penalty"):
        fe_models.files.body_from_foreign(held, geometry, name="block", units=SI)
    body = fe_models.files.body_from_foreign(held, geometry, name="block", units=SI, remove_supports=True)
    assert_allclose(body.K.toarray(), block.K.toarray(), rtol=0, atol=1e-14 * np.abs(block.K).max())
    assert "supports of 3 nodes were removed" in body.provenance["notes"]


def test_springs_to_the_ground_are_labelled_or_removed(read, geometry, block):
    K = read.K.tolil()
    for row in (0, 1, 2, 60, 61, 62, 302):
        K[row, row] += 1e7
    sprung = replace(read, K=sp.csc_array(K))
    with pytest.raises(BodyError, match="if it is meant to be held"):
        fe_models.files.body_from_foreign(sprung, geometry, name="block", units=SI)
    assert fe_models.files.body_from_foreign(sprung, geometry, name="block", units=SI, held=True).is_held
    free = fe_models.files.body_from_foreign(sprung, geometry, name="block", units=SI, remove_supports=True)
    assert not free.is_held
    assert_allclose(free.K.toarray(), block.K.toarray(), rtol=0, atol=1e-14 * np.abs(block.K).max())
    with pytest.raises(MatrixError, match="there are no supports to remove"):
        fe_models.files.body_from_foreign(read, geometry, name="block", units=SI, remove_supports=True)


def test_rows_that_the_other_program_took_out_hold_the_body(read, geometry):
    n_nodes = len(geometry.nodes)
    dofs = np.stack([np.repeat(np.arange(1, n_nodes + 1), 3), np.tile(np.arange(3), n_nodes)], axis=1)
    kept = np.setdiff1d(np.arange(3 * n_nodes), np.flatnonzero(np.isin(dofs[:, 0], [1, 2, 3, 4])))
    cut = replace(read, K=read.K[kept][:, kept], M=read.M[kept][:, kept], dofs=dofs[kept])
    with pytest.raises(BodyError, match="rows that other nodes have are missing"):
        fe_models.files.body_from_foreign(cut, geometry, name="block", units=SI)
    assert fe_models.files.body_from_foreign(cut, geometry, name="block", units=SI, held=True).is_held
    with pytest.raises(MatrixError, match="still not free"):
        fe_models.files.body_from_foreign(cut, geometry, name="block", units=SI, remove_supports=True)
    rows = np.setdiff1d(np.arange(3 * n_nodes), kept)
    said = fe_models.files.body_from_foreign(
        replace(read, dofs=dofs, constrained=rows), geometry, name="block", units=SI, held=True
    )
    assert_array_equal(said.K.toarray(), read.K.toarray()[np.ix_(kept, kept)])
    zeroed = np.ones(3 * n_nodes)
    zeroed[np.isin(dofs[:, 0], [1, 2, 3, 4])] = 0.0
    Z = sp.diags_array(zeroed)
    same = replace(read, K=Z @ read.K @ Z, M=Z @ read.M @ Z)
    body = fe_models.files.body_from_foreign(same, geometry, name="block", units=SI, held=True)
    assert body.n_dof == len(kept)
    assert "12 rows without stiffness and mass" in body.provenance["notes"]


def test_rows_in_another_order_are_found_by_the_gate(read, geometry):
    order = np.arange(read.n_dof).reshape(-1, 3).T.ravel()
    swapped = replace(read, K=read.K[order][:, order], M=read.M[order][:, order])
    with pytest.raises(BodyError, match="rows are in component-major order"):
        fe_models.files.body_from_foreign(swapped, geometry, name="block", units=SI)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"M": None}, "the mass M is missing"),
        ({"K": None}, "the stiffness K is missing"),
        ({"K": sp.eye_array(770), "M": sp.eye_array(770)}, "770 rows and no list of their dofs"),
        ({"dofs": np.stack([np.arange(771), np.zeros(771, int)], axis=1)}, "514 nodes of the rows are not in the"),
        ({"dofs": np.stack([np.arange(771) + 1, np.full(771, -1)], axis=1)}, "771 rows have no place"),
    ],
)
def test_what_does_not_fit_is_refused(read, geometry, change, words):
    with pytest.raises(MatrixError, match=words):
        fe_models.files.body_from_foreign(replace(read, **change), geometry, name="block", units=SI)


def test_without_geometry_the_nodes_are_asked_for(read):
    with pytest.raises(MatrixError, match=r'geometry = "model\.inp"'):
        fe_models.files.body_from_foreign(read, name="block", units=SI)


def test_gaps_in_the_numbers_leave_the_rows_without_names(read, geometry):
    numbers = geometry.node_numbers.copy()
    numbers[-1] += 1
    with pytest.raises(MatrixError, match="numbered 1 to 258 with gaps"):
        fe_models.files.body_from_foreign(read, replace(geometry, node_numbers=numbers), name="block", units=SI)


def test_dofs_in_local_axes_are_turned_back(read, geometry, block):
    rng = np.random.default_rng(3)
    named = fe_models.files.matrices.body.with_geometry(read, geometry)
    systems = {int(n): np.linalg.qr(rng.standard_normal((3, 3)))[0] for n in (1, 5, 100)}
    systems = {n: R * np.sign(np.linalg.det(R)) for n, R in systems.items()}
    D = np.eye(read.n_dof)
    for n, R in systems.items():
        D[3 * n - 3 : 3 * n, 3 * n - 3 : 3 * n] = R
    local = replace(
        named, K=D.T @ read.K @ D, M=D.T @ read.M @ D, systems=systems, loads={"tip": D.T @ np.arange(771.0)}
    )
    basic = in_basic_axes(local)
    assert_allclose(basic.K.toarray(), block.K.toarray(), rtol=0, atol=1e-14 * np.abs(block.K).max())
    assert_allclose(basic.loads["tip"], np.arange(771.0), rtol=0, atol=1e-12 * 771)
    assert basic.notes[-1] == "dofs of 3 nodes turned from local to basic axes"
    kept = np.arange(1, 771)
    with pytest.raises(MatrixError, match="1 of its components have no row"):
        in_basic_axes(replace(local, K=local.K[kept][:, kept], M=None, dofs=named.dofs[kept], loads={}))


def test_a_part_without_named_rows_keeps_its_order_beside_one_that_names_them(read, geometry):
    from fe_models.files.matrices.foreign_matrices import joined

    dofs = fe_models.files.matrices.body.with_geometry(read, geometry).dofs
    order = np.random.default_rng(0).permutation(771)
    K = replace(read, M=None, dofs=dofs)
    M = replace(read, K=None, M=read.M[order][:, order], dofs=dofs[order])
    whole = joined([K, M], "two files")
    assert_array_equal(whole.M.toarray(), read.M.toarray())
    with pytest.raises(MatrixError, match="expected matrices with the same rows"):
        joined([replace(read, M=None), replace(read, K=None, M=sp.eye_array(3))], "two files")
    with pytest.raises(MatrixError, match="K is in two of the files"):
        joined([K, K], "two files")
