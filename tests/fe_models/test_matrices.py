"""Bodies from foreign matrices: the same body comes back, exact moments only where they are exact, bad input named."""

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose, assert_array_equal

from cms.errors import BodyError, UnitsError
from fe_models.errors import MeshError
from fe_models.files.matrices.given import body_from_matrices, body_from_npz, scalar_mass_of
from fe_models.foundation.units import unit_system
from tests.bodies import bar, beam

SI = unit_system("m-kg-s")


def shuffled(body, seed=0):
    """The matrices of a body with its dofs in random order, and that order."""
    order = np.random.default_rng(seed).permutation(body.n_dof)
    return body.M[order][:, order], body.K[order][:, order], body.dofs[order], order


def test_gram_from_shuffled_solid_matrices_is_that_of_the_elements():
    body = bar(3, kind="tetra10")
    M, K, dofs, order = shuffled(body)
    foreign = body_from_matrices(M, K, body.nodes, dofs, name="foreign", units=SI)
    u = np.random.default_rng(1).normal(size=(body.n_dof, 3))
    expected = body.element_model.mass_gram(u)
    gram = foreign.element_model.mass_gram(u[order])
    assert_allclose(gram, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    assert foreign.provenance["mass moments"] == "exact: M = M_s ⊗ 1"


def test_lumped_mass_gives_the_moments_of_its_points():
    rng = np.random.default_rng(2)
    nodes, mass, u = rng.normal(size=(5, 3)), rng.uniform(1, 2, 5), rng.normal(size=(15, 2))
    dofs = np.stack([np.repeat(np.arange(5), 3), np.tile(np.arange(3), 5)], axis=1)
    M = sp.diags_array(np.repeat(mass, 3))
    body = body_from_matrices(M, np.zeros((15, 15)), nodes, dofs, name="points", units=SI)
    rows = [np.r_[1.0, nodes[i], u[3 * i], u[3 * i + 1], u[3 * i + 2]] for i in range(5)]
    expected = sum(m * np.outer(a, a) for m, a in zip(mass, rows, strict=True))
    assert_allclose(body.element_model.mass_gram(u), expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_mass_of_rotations_leaves_the_moments_to_the_approximate_way():
    body = beam(3)
    foreign = body_from_matrices(body.M, body.K, body.nodes, body.dofs, name="beam", units=SI)
    assert foreign.element_model is None
    assert foreign.provenance["mass moments"].startswith("approximate")


@pytest.mark.parametrize("spoil", ["direction", "coupling", "missing"])
def test_mass_that_differs_between_directions_is_not_scalar(spoil):
    body = bar(1, kind="hexahedron")
    M, keep = body.M.toarray(), np.arange(body.n_dof)
    if spoil == "direction":
        M[4, 4] *= 1 + 1e-6
    elif spoil == "coupling":
        M[3:6, 3:6] += 1e-6 * M.max() * (1 - np.eye(3))  # the same in all directions: only the pattern tells
    else:
        keep = keep[1:]
    K = 0 * body.K[keep][:, keep]  # any stiffness: with a row missing that of the body would hold it
    foreign = body_from_matrices(M[np.ix_(keep, keep)], K, body.nodes, body.dofs[keep], name="spoilt", units=SI)
    assert scalar_mass_of(foreign) is None
    assert foreign.element_model is None


def test_stress_of_bare_matrices_is_refused():
    body = bar(1, kind="hexahedron")
    foreign = body_from_matrices(body.M, body.K, body.nodes, body.dofs, name="bare", units=SI)
    with pytest.raises(BodyError, match="bare matrices, which know no stress"):
        foreign.element_model.nodal_stress(np.zeros((body.n_dof, 1)))


def test_one_triangle_is_refused_with_the_cure():
    body = bar(1, kind="hexahedron")
    with pytest.raises(BodyError, match=r"K: expected both triangles, got the lower one only; pass A \+ A\.T"):
        body_from_matrices(body.M, sp.tril(body.K), body.nodes, body.dofs, name="half", units=SI)


def test_a_dof_listed_twice_is_refused():
    body = bar(1, kind="hexahedron")
    dofs = body.dofs.copy()
    dofs[1] = dofs[0]
    with pytest.raises(BodyError, match="component 0 of node 0 is listed 2 times"):
        body_from_matrices(body.M, body.K, body.nodes, dofs, name="twice", units=SI)


def test_fractional_dofs_are_refused():
    body = bar(1, kind="hexahedron")
    with pytest.raises(BodyError, match="expected whole numbers"):
        body_from_matrices(body.M, body.K, body.nodes, body.dofs + 0.5, name="half", units=SI)


def parts(body, form):
    arrays = {"nodes": body.nodes, "dofs": body.dofs, "units": "m-kg-s"}
    for key in ("M", "K"):
        matrix = getattr(body, key)
        if form == "dense":
            arrays[key] = matrix.toarray()
        elif form == "triplets":
            coo = sp.coo_array(matrix)
            arrays |= {f"{key}_row": coo.row, f"{key}_col": coo.col, f"{key}_data": coo.data}
        else:
            arrays |= {f"{key}_{part}": getattr(matrix, part) for part in ("indptr", "indices", "data")}
    for interface in body.interfaces:
        for part in ("kind", "nodes", "reference", "triad", "weights"):
            arrays[f"interface/{interface.name}/{part}"] = getattr(interface, part)
    return arrays


@pytest.mark.parametrize("form", ["dense", "triplets", "compressed"])
def test_npz_gives_back_every_array(form, tmp_path):
    body = bar(2, kind="hexahedron")
    np.savez(tmp_path / "bar.npz", **parts(body, form))
    read = body_from_npz(tmp_path / "bar.npz")
    assert read.name == "bar"
    assert read.units == SI
    assert_array_equal(read.K.toarray(), body.K.toarray())
    assert_array_equal(read.M.toarray(), body.M.toarray())
    assert_array_equal(read.nodes, body.nodes)
    assert_array_equal(read.dofs, body.dofs)
    for one, other in zip(read.interfaces, body.interfaces, strict=True):
        assert (one.name, one.kind) == (other.name, other.kind)
        assert_array_equal(one.nodes, other.nodes)
        assert_array_equal(one.reference, other.reference)
        assert_allclose(one.weights, other.weights, rtol=1e-15)
    assert len(read.provenance["mesh sha256"]) == 64


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"nodes": None}, "the array 'nodes' is missing; got"),
        ({"K": None}, "K: expected K alone, or K_row, K_col, K_data.*got none of these"),
        ({"K": None, "K_data": np.ones(3), "K_row": np.arange(3)}, "K: expected K alone.*got K_data, K_row"),
        ({"stiffness": np.ones(3)}, "unknown array 'stiffness'"),
        ({"units": None}, "names no units"),
        ({"interface/left/node": np.arange(2)}, r"expected interface/<name>/<part>; did you mean 'nodes'\?"),
        ({"interface/left/nodes": np.array([0, 99])}, r"interface/left/nodes: expected 0\.\.11, got 0\.\.99"),
        ({"interface/left/nodes": np.array([0.5])}, "expected node numbers"),
        ({"interface/up/kind": np.array("rigid")}, "the array 'interface/up/nodes' is missing"),
        ({"nodes": np.zeros((4, 2))}, r"nodes: expected numbers \(n_nodes, 3\)"),
        ({"K": None, "K_data": np.ones(1), "K_row": np.array([99]), "K_col": np.array([0])}, "the triplets parts do"),
        ({"K": None, "K_data": np.ones(1), "K_indptr": np.zeros(3), "K_indices": [0]}, "the compressed parts do"),
        ({"dofs": np.array([["a", "b"]])}, "dofs: expected whole numbers"),
        ({"M": np.array([{}])}, "not a readable"),
    ],
)
def test_npz_with_a_fault_is_refused_by_key(change, message, tmp_path):
    arrays = parts(bar(2, kind="hexahedron"), "dense") | change
    np.savez(tmp_path / "bad.npz", **{key: array for key, array in arrays.items() if array is not None})
    with pytest.raises((MeshError, BodyError), match=message):
        body_from_npz(tmp_path / "bad.npz")


def test_npz_units_that_disagree_are_refused(tmp_path):
    arrays = parts(bar(1, kind="hexahedron"), "dense")
    np.savez(tmp_path / "b.npz", **arrays)
    with pytest.raises(MeshError, match="the file is in m-kg-s, but mm-t-s was asked for"):
        body_from_npz(tmp_path / "b.npz", units=unit_system("mm-t-s"))
    np.savez(tmp_path / "c.npz", **(arrays | {"units": "mm-t"}))
    with pytest.raises(UnitsError, match="did you mean"):
        body_from_npz(tmp_path / "c.npz")


@pytest.mark.parametrize("content", [b"", b"garbage, no archive", b"PK\x03\x04 but no more", b"\x93NUMPY\x01\x00"])
def test_garbage_is_refused(content, tmp_path):
    (tmp_path / "bad.npz").write_bytes(content)
    with pytest.raises(MeshError, match="not a readable"):
        body_from_npz(tmp_path / "bad.npz")


def test_truncated_and_altered_archives_are_refused(tmp_path):
    np.savez_compressed(tmp_path / "whole.npz", **parts(bar(2, kind="hexahedron"), "dense"))
    whole = (tmp_path / "whole.npz").read_bytes()
    (tmp_path / "cut.npz").write_bytes(whole[: len(whole) // 2])
    altered = bytearray(whole)
    altered[len(whole) // 2] ^= 0xFF
    (tmp_path / "altered.npz").write_bytes(altered)
    for name in ("cut.npz", "altered.npz"):
        with pytest.raises(MeshError, match="not a readable"):
            body_from_npz(tmp_path / name)


def test_missing_file_and_single_array_are_refused(tmp_path):
    with pytest.raises(MeshError, match="no such file"):
        body_from_npz(tmp_path / "nothing.npz")
    np.save(tmp_path / "single.npy", np.eye(3))
    with pytest.raises(MeshError, match="got a single array"):
        body_from_npz(tmp_path / "single.npy")
