"""Nonlinear constraints of CalculiX, linear at the undeformed place: motions that keep planes, lines, angles."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fe_models.errors import MeshError
from fe_models.files.read_deck import parse_deck
from tests.bodies import box_mesh
from tests.decks import write_deck

TURN = Rotation.from_rotvec([0.5, -0.3, 0.8]).as_matrix()


def deck_of(folder, points, line, extra=""):
    """A brick with further nodes 101, 102, ... and one *MPC."""
    path = write_deck(folder / "block.inp", box_mesh(1, 1, 1, 1.0, 1.0, 1.0, "hexahedron"))
    nodes = "".join(
        f"{101 + k}, {x!r}, {y!r}, {z!r}\n" for k, (x, y, z) in enumerate(np.asarray(points, float).tolist())
    )
    text = path.read_text().replace("*ELEMENT", nodes + "*ELEMENT", 1)
    text += '*MATERIAL, NAME=M\n*ELASTIC\n200., .3\n*DENSITY\n1.\n*SOLID SECTION, ELSET="all", MATERIAL=M\n'
    path.write_text(text + f"*MPC\n{line}\n{extra}")
    return parse_deck(path)


def matrix(deck, numbers):
    """The equations over components 1 to 3 of nodes 101, 102, ..."""
    place = {f"node_{number}": k for k, number in enumerate(numbers)}
    A = np.zeros((len(deck.equations), 3 * len(numbers)))
    for row, equation in zip(A, deck.equations, strict=True):
        for name, c, a in equation.terms:
            if name in place and c < 3:
                row[3 * place[name] + c] += a
    return A


def rigid_and_in(points, *more):
    """Displacements, (motions, 3 n): rigid ones, and others."""
    rigid = [np.tile(axis, (len(points), 1)) for axis in np.eye(3)] + [np.cross(axis, points) for axis in np.eye(3)]
    return np.array([u.ravel() for u in (*rigid, *more)])


@pytest.mark.parametrize("size", [1.0, 1e-3, 1e3])
def test_nodes_of_a_plane_stay_in_one(tmp_path, size):
    """Four of seven equations' worth: rigid motions and all motions within the plane pass, one across it does not."""
    rng = np.random.default_rng(3)
    points = np.c_[rng.uniform(-1, 1, (6, 2)), np.zeros(6)]
    points[2] = 2 * points[1] - points[0]  # the first three on one line
    points = size * points @ TURN.T
    deck = deck_of(tmp_path, points, "PLANE, 101, 102, 103, 104,\n105, 106")
    A = matrix(deck, range(101, 107))
    assert A.shape[0] == 3
    assert np.linalg.matrix_rank(A) == 3
    within = [rng.normal(size=(6, 2)) @ TURN.T[:2] for _ in range(3)]
    assert_allclose(A @ rigid_and_in(points, *within).T, 0, atol=1e-13 * max(size, 1))
    across = np.zeros((6, 3))
    across[4] = TURN[:, 2]
    assert abs(A @ across.ravel()).max() > 0.1


def test_nodes_of_a_line_stay_on_one(tmp_path):
    t = TURN[:, 0]
    points = np.outer([0.0, 2.0, 0.7, 3.0], t) + np.array([1.0, 2.0, 3.0])
    deck = deck_of(tmp_path, points, "STRAIGHT, 101, 102, 103, 104")
    A = matrix(deck, range(101, 105))
    assert np.linalg.matrix_rank(A) == len(A) == 4
    along = np.outer([0.3, -1.0, 2.0, 0.1], t)
    assert_allclose(A @ rigid_and_in(points, along).T, 0, atol=1e-13)
    assert abs(A @ np.eye(12)[7]).max() > 0.1


def test_the_mean_angle_of_nodes_is_the_rotation_of_a_node_at_their_centroid(tmp_path):
    """A finite small turn about -z, measured node by node: the angle between the arms before and after."""
    ring = np.array([[1.0, 0.0, 0], [0.2, 1.5, 0], [-1.4, 0.1, 0], [0.2, -1.6, 0]]) * [1.0, 1.0, 0.0]
    ring -= ring.mean(axis=0)
    points = np.vstack([ring, [0, 0, -1]])
    listed = ", ".join(str(n) for n in range(101, 105) for _ in range(3))
    step = "*BOUNDARY\n105, 1\n*STEP\n*STATIC\n*CLOAD\n105, 1, 4.\n*END STEP\n"
    deck = deck_of(tmp_path, points, f"MEANROT, {listed}, 105", step)
    (equation,) = deck.equations
    theta = {c: a for name, c, a in equation.terms if name == "node_105"}
    assert list(theta) == [5]
    u = 1e-6 * np.random.default_rng(5).normal(size=(4, 3))
    moved = ring + u - u.mean(axis=0)
    before, after = (np.arctan2(X[:, 1], X[:, 0]) for X in (ring, moved))
    angle = (matrix(deck, range(101, 105))[0] @ u.ravel()) / -theta[5]
    assert_allclose(angle, np.angle(np.exp(1j * (after - before))).mean(), rtol=1e-5)
    row = int(deck.mesh.node_sets["node_105"][0])
    assert_allclose(deck.mesh.nodes[row], 0, atol=1e-15)
    assert not deck.supports  # a node that follows others in the mean has no dofs for an interface
    assert any("the angle of node 105 is free here" in row[2] for row in deck.ledger.rows())
    assert deck.loads[0].forces["node_105"] == (0, 0, 0, 0, 0, -4.0)  # the axis is -z
    assert deck.couplings[0].components == (0, 1, 2)


@pytest.mark.parametrize(
    ("points", "line", "words"),
    [
        (np.eye(3), "PLANE, 101, 102, 103", "expected four nodes or more"),
        (np.outer(range(4), [1, 0, 0]), "PLANE, 101, 102, 103, 104", "all nodes lie on one line"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 1]], "PLANE, 101, 102, 103, 104", "do not lie in one plane"),
        ([[0, 0, 0], [1, 0, 0], [2, 1, 0]], "STRAIGHT, 101, 102, 103", "do not lie on the line"),
        ([[0, 0, 0], [1, 0, 0], [0, 0, 1]], "MEANROT, 101, 102, 103", "expected every node three times"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 1]], "MEANROT, 101, 101, 101, 102, 102, 102, 103", "not along x, y or z"),
        ([[0, 0, 0], [1, 0, 0]], "MEANROT, 101, 101, 101, 102, 102, 102, 1", "belongs to an element"),
        ([[0, 0, 0], [1, 0, 1], [0, 0, 1]], "MEANROT, 101, 101, 101, 102, 102, 102, 103", "turns about other axes"),
        ([[0, 0, 0], [1, 0, 0], [3, 0, 0]], "DIST, 101, 101, 101, 102, 102, 102, 103", "is not linear"),
        (np.eye(3), "MINE, 101, 102, 103", "not known here"),
    ],
)  # fmt: skip
def test_constraints_that_cannot_be_linear_are_refused_with_the_reason(tmp_path, points, line, words):
    deck = deck_of(tmp_path, points, line)
    with pytest.raises(MeshError, match=words):
        deck.ledger.require_whole()
