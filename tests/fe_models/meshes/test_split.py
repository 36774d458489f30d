from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fe_models.beams import LineMesh, straight_line
from fe_models.errors import MeshError
from fe_models.meshes import split_mesh
from fe_models.meshes.mesh import Mesh
from fe_models.shells import flat_plate
from tests.bodies import box_mesh


def volume(mesh: Mesh) -> float:
    """By the signed cones of the boundary, for cells with plane facets."""
    from fe_models.meshes.boundary import boundary_triangles

    X = mesh.nodes[boundary_triangles(mesh)]
    return float(np.einsum("ij,ij->", X[:, 0], np.cross(X[:, 1], X[:, 2])) / 6)


@pytest.mark.parametrize("kind", ["hexahedron", "hexahedron20", "tetra10", "wedge"])
def test_parts_are_the_whole_and_meet_in_their_cuts(kind):
    mesh = box_mesh(6, 2, 1, lx=3.0, kind=kind)
    split = split_mesh(mesh, 3)
    assert_array_equal(split.axis, [1, 0, 0])
    assert sum(part.n_cells for part in split.parts) == mesh.n_cells
    assert_allclose([volume(part) for part in split.parts], volume(mesh) / 3, rtol=1e-12)
    for k, cut in enumerate(split.cuts):
        sides = [part.nodes[part.node_sets[cut.name]] for part in split.parts[k : k + 2]]
        assert_array_equal(*sides)  # in the same order
        assert_allclose(sides[0][:, 0], k + 1.0)
        assert cut.n_nodes == len(sides[0]) == (np.abs(mesh.nodes[:, 0] - (k + 1)) < 1e-9).sum()
        assert_allclose(cut.point, [k + 1.0, 0.5, 0.5], atol=1e-12)


def test_groups_stay_with_their_parts():
    mesh = box_mesh(4, 1, 1, lx=4.0)
    first, second = split_mesh(mesh, 2).parts
    assert set(first.node_sets) == {"left", "bottom", "top", "cut_1"}
    assert set(second.node_sets) == {"right", "bottom", "top", "cut_1"}
    assert set(first.cell_sets) == {"left half", "all"}
    for part in (first, second):
        assert_allclose(part.nodes[part.node_sets["top"]][:, 2], 1.0)
        assert len(part.cell_sets["all"]["hexahedron"]) == 2
    assert_allclose(second.nodes[second.node_sets["right"]][:, 0], 4.0)


def test_numbers_of_the_file_stay():
    plain = box_mesh(2, 1, 1)
    mesh = Mesh(
        plain.nodes, plain.cells,
        node_numbers=1000 + np.arange(len(plain.nodes)), cell_numbers={"hexahedron": np.array([7, 9])},
    )  # fmt: skip
    for part, number in zip(split_mesh(mesh, 2, axis=(1, 0, 0)).parts, (7, 9), strict=True):
        assert_array_equal(part.nodes, mesh.nodes[part.node_numbers - 1000])
        assert part.cell_numbers["hexahedron"].tolist() == [number]
        assert part.notes == ()


def test_cuts_can_be_placed():
    split = split_mesh(box_mesh(8, 1, 1, lx=4.0), at=[0.5, 2.5], axis=(2, 0, 0))
    assert [part.n_cells for part in split.parts] == [1, 4, 3]
    assert_allclose([cut.point[0] for cut in split.cuts], [0.5, 2.5])


def test_lines_keep_their_directions_and_offsets():
    line = straight_line((0, 0, 0), (0, 0, 3), 3)
    rng = np.random.default_rng(0)
    mesh = LineMesh(
        line.nodes, line.lines, line.line_sets, line.node_sets,
        orientations=rng.normal(size=(3, 3)), offsets=rng.normal(size=(3, 2, 3)),
    )  # fmt: skip
    parts = split_mesh(mesh, 3).parts
    for k, part in enumerate(parts):
        assert part.orientations is not None
        assert part.offsets is not None
        assert_array_equal(part.nodes[part.lines[0]], mesh.nodes[mesh.lines[k]])
        assert_array_equal(part.orientations[0], mesh.orientations[k])
        assert_array_equal(part.offsets[0], mesh.offsets[k])
    assert set(parts[0].node_sets) == {"start", "cut_1"}
    assert set(parts[1].node_sets) == {"cut_1", "cut_2"}


def test_default_axis_is_the_longest_direction():
    line = straight_line((1, 1, 1), (1 - 3, 1 + 4, 1), 5)
    assert_allclose(split_mesh(line, 2).axis, [-0.6, 0.8, 0], atol=1e-12)


def hairpin() -> LineMesh:
    """Up along x and back: the ends are at the same place along it."""
    x = np.array([0, 1, 2, 3, 3, 2, 1, 0.0])
    nodes = np.stack([x, np.repeat([0.0, 1.0], 4), np.zeros(8)], axis=1)
    return LineMesh(nodes, np.stack([np.arange(7), np.arange(1, 8)], axis=1))


def test_two_legs_are_cut_both():
    split = split_mesh(hairpin(), at=[1.0, 2.0], axis=(1, 0, 0))
    assert [cut.n_nodes for cut in split.cuts] == [2, 2]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: split_mesh(box_mesh(4, 1, 1, lx=4.0), 1), "expected 2 parts or more, got 1"),
        (lambda: split_mesh(box_mesh(4, 1, 1, lx=4.0)), "either a number of parts or the places"),
        (lambda: split_mesh(box_mesh(4, 1, 1, lx=4.0), 9), r"part \d of 9 has no cell.*take fewer parts"),
        (lambda: split_mesh(box_mesh(4, 1, 1, lx=4.0), 2, axis=(0, 0, 0)), "axis: expected a direction"),
        (lambda: split_mesh(box_mesh(4, 1, 1, lx=4.0), at=[3.0, 1.0]), "ascending numbers between 0 and 4"),
        (lambda: split_mesh(box_mesh(4, 1, 1, lx=4.0), at=[5.0]), "ascending numbers between 0 and 4"),
        (lambda: split_mesh(straight_line((0, 0, 0), (1, 0, 0), 4), 2, axis=(0, 1, 0)), "no extent along"),
        (lambda: split_mesh(two_pieces(), 2), "share no node; the mesh is in pieces"),
        (lambda: split_mesh(ladder(), at=[0.4, 0.6], axis=(1, 0, 0)), "parts 1 and 3 share 1 nodes"),
    ],
)
def test_a_cut_that_cannot_be_is_refused(call, message):
    with pytest.raises(MeshError, match=message):
        call()


def two_pieces() -> LineMesh:
    return LineMesh(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]]), np.array([[0, 1], [2, 3]]))


def ladder() -> LineMesh:
    """Cells 0-1 and 1-2 with centres outside a thin part, whose own cell hangs on node 1."""
    nodes = np.array([[0.0, 0, 0], [0.5, 0, 0], [1, 0, 0], [0.5, 1, 0]])
    return LineMesh(nodes, np.array([[0, 1], [1, 2], [1, 3]]))


def test_a_shell_keeps_its_stiffeners_each_once():
    plate = flat_plate(3.0, 1.0, 6, 2)
    grid = np.flatnonzero((plate.nodes[:, 0] % 1.0 < 1e-9) & (plate.nodes[:, 0] < 2.5)).reshape(-1, 3)  # across
    along = np.flatnonzero(np.abs(plate.nodes[:, 1]) < 1e-9)
    along = along[np.argsort(plate.nodes[along, 0])]
    lines = np.concatenate([grid[:, :2], grid[:, 1:], np.stack([along[:-1], along[1:]], axis=1)])
    mesh = replace(plate, lines=lines, line_sets={"rib": np.arange(len(lines))}, node_sets={"edge": along})
    split = split_mesh(mesh, 3)
    assert [part.n_cells for part in split.parts] == [4, 4, 4]
    found = [part.nodes[part.lines].round(9) for part in split.parts]
    whole = {tuple(map(tuple, line)) for line in mesh.nodes[mesh.lines].round(9)}
    assert sum(len(part) for part in found) == len(whole)
    assert {tuple(map(tuple, line)) for part in found for line in part} == whole
    for k, part in enumerate(split.parts):
        assert len(part.line_sets["rib"]) == len(part.lines)
        assert (part.nodes[part.lines].mean(axis=1)[:, 0] >= k - 1e-9).all()
        assert (part.nodes[part.lines].mean(axis=1)[:, 0] < k + 1 - 1e-9).all()  # those on a cut are behind it
        assert_allclose(part.nodes[part.node_sets["edge"]][:, 1], 0)
