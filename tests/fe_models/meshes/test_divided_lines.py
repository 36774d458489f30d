"""Lines cut into equal ones, in Python and by a column of a table."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import fe_models as fm
from fe_models.errors import BeamError, MeshError
from tests.fe_models.small_shells import SI, STEEL


def frame():
    """A post and a beam on it, with offsets, an orientation and numbers of nodes."""
    return fm.beams.LineMesh(
        np.array([(0.0, 0, 0), (0, 0, 3), (4, 0, 3)]),
        np.array([(0, 1), (1, 2)]),
        line_sets={"post": [0], "beam": [1]},
        node_sets={"foot": [0], "beam": [1, 2]},
        orientations=np.array([(0.0, 1, 0), (np.nan,) * 3]),
        offsets=np.array([[(0.0, 0, 0), (0, 0, 0)], [(0, 0, 0.1), (0, 0, 0.5)]]),
        node_numbers=np.array([1, 7, 3]),
    )


def test_pieces_are_equal_and_keep_groups_orientations_and_offsets():
    mesh = fm.beams.divide_lines(frame(), [1, 4])
    assert_array_equal(mesh.lines, [(0, 1), (1, 3), (3, 4), (4, 5), (5, 2)])
    assert_allclose(mesh.nodes[3:], [(1, 0, 3), (2, 0, 3), (3, 0, 3)], rtol=0, atol=1e-15)
    assert_array_equal(mesh.node_numbers, [1, 7, 3, -1, -1, -1])
    assert_array_equal(mesh.line_sets["post"], [0])
    assert_array_equal(mesh.line_sets["beam"], [1, 2, 3, 4])
    assert_array_equal(mesh.node_sets["beam"], [1, 2, 3, 4, 5])
    assert_array_equal(mesh.node_sets["foot"], [0])
    assert_array_equal(mesh.orientations[0], (0, 1, 0))
    assert np.isnan(mesh.orientations[1:]).all()
    assert_allclose(mesh.offsets[1:, 0, 2], [0.1, 0.2, 0.3, 0.4], rtol=1e-15)
    assert_allclose(mesh.offsets[1:, 1, 2], [0.2, 0.3, 0.4, 0.5], rtol=1e-15)
    whole = fm.beams.divide_lines(frame(), 1)
    assert_array_equal(whole.lines, frame().lines)
    assert_array_equal(whole.nodes, frame().nodes)


def test_a_divided_line_is_the_line_of_so_many_elements():
    one = fm.beams.divide_lines(fm.beams.straight_line((0, 0, 0), (1, 2, 0.5), 1), 5)
    five = fm.beams.straight_line((0, 0, 0), (1, 2, 0.5), 5)
    bar = fm.beams.BeamProperty(fm.beams.Circle(0.02), STEEL)
    found, expected = (fm.beam_body(mesh, bar, name="b", units=SI) for mesh in (one, five))
    order = [0, 2, 3, 4, 5, 1]
    assert_allclose(one.nodes[order], five.nodes, rtol=0, atol=1e-15)
    dofs = (6 * np.array(order)[:, None] + np.arange(6)).ravel()
    K = expected.K.toarray()
    assert_allclose(found.K.toarray()[np.ix_(dofs, dofs)], K, rtol=0, atol=1e-11 * np.abs(K).max())


@pytest.mark.parametrize("n", [0, -1, 1.5, True, [1, 2, 3], [[1, 2]]])
def test_impossible_numbers_are_refused(n):
    with pytest.raises(BeamError, match="divide_lines: expected"):
        fm.beams.divide_lines(frame(), n)


def test_a_table_of_lines_says_how_many_elements_each_has(tmp_path):
    nodes, lines = tmp_path / "nodes.csv", tmp_path / "lines.csv"
    nodes.write_text("node,x,y,z,sets\n1,0,0,0,foot\n2,0,0,3,\n3,4,0,3,tip\n99,0,5,0,\n")
    lines.write_text("node1,node2,group,third,elements\n1,2,post,99,3\n2,3,beam,,\n")
    mesh = fm.files.read_tables(nodes, lines)
    assert len(mesh.lines) == 4
    assert_allclose(mesh.nodes[3:], [(0, 0, 1), (0, 0, 2)], rtol=0, atol=1e-15)
    assert_array_equal(mesh.line_sets["post"], [0, 1, 2])
    assert_array_equal(np.sort(mesh.node_sets["post"]), [0, 1, 3, 4])
    assert_array_equal(mesh.node_sets["tip"], [2])
    lines.write_text("node1,node2,elements\n1,2,0\n2,3,\n99,1,\n")
    with pytest.raises(MeshError, match=r"line 2: column elements: expected a whole number from 1 on, got '0'"):
        fm.files.read_tables(nodes, lines)
