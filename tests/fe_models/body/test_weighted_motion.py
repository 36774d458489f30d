"""The mean motion with weights per component: matrices of NX Nastran, rigid motions, least squares, translations."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.io import loadmat
from scipy.spatial.transform import Rotation

from fe_models.assembly.constraints import characteristic_length, weighted_motion
from fe_models.body.couplings.couplings import mean_motion
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.files.nastran.bulk_data.cards import read_cards
from fe_models.files.nastran.bulk_data.coordinate_systems import read_grid_points
from fe_models.foundation.errors import BodyError

DATA = Path(__file__).parent / "data"
RNG = np.random.default_rng(5)


def rbe3(card):
    """Reference, its components, and weight per component of each member, by reading on where a weight has a point."""
    weights: dict[int, np.ndarray] = {}
    words = [word for word in card.fields[4:] if word]
    k = 0
    while k < len(words):
        weight, components = float(words[k]), [int(c) - 1 for c in words[k + 1]]
        k += 2
        while k < len(words) and "." not in words[k]:
            weights.setdefault(int(words[k]), np.zeros(6))[components] += weight
            k += 1
    return card.integer(3), tuple(int(c) - 1 for c in card.text(4)), weights


@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_matrices_are_those_of_nastran(number):
    """GM of NX Nastran 9: grid points in chained cylindrical and spherical systems, weights of rotations, components.

    Cases 1 to 3 differ in the system of the reference point; case 4 has its components 1346 alone and two members.
    """
    name = f"make_gm_nx9_rbe3_{number}"
    file = loadmat(DATA / f"{name}.mat")
    gm, uset = file["gm"]["k0"][0, 0], file["uset"]["k0"][0, 0]
    cards = list(read_cards(name, (DATA / f"{name}.dat").read_text()))
    points = read_grid_points(cards)
    ids = [int(row[0]) for row in uset if row[1] == 1]
    for row in uset[::6]:  # the places and systems themselves are those of Nastran
        assert_allclose(points.positions[int(row[0])], row[3:], rtol=1e-6, atol=1e-6 * abs(uset[:, 3:]).max())
    reference, components, weights = rbe3(next(card for card in cards if card.name == "RBE3"))
    members = sorted(weights)

    def axes_of(number):
        return points.axes.get(number, np.eye(3))

    A = weighted_motion(
        np.array([points.positions[member] for member in members]),
        np.array([weights[member] for member in members]),
        points.positions[reference],
        axes=np.array([axes_of(member) for member in members]),
        components=components,
        triad=axes_of(reference),
    )
    n_set = [(number, c) for number in ids for c in range(6) if (number, c) not in {(reference, c) for c in components}]
    expected = np.zeros_like(A)
    for k, member in enumerate(members):
        local = gm[:, [n_set.index((member, c)) for c in range(6)]]
        expected[:, 6 * k : 6 * k + 3] = local[:, :3] @ axes_of(member).T
        expected[:, 6 * k + 3 : 6 * k + 6] = local[:, 3:] @ axes_of(member).T
    assert_allclose(A, expected, rtol=0, atol=1e-7 * abs(expected).max())  # its places are in singles


@pytest.fixture
def cloud():
    points = RNG.standard_normal((6, 3)) * [1.0, 2.0, 3.0] + 5.0
    return points, RNG.uniform(0.1, 2.0, (6, 6)), np.array([4.0, 6.0, 5.0])


def rigid(points, reference):
    G = np.zeros((len(points), 6, 6))
    G[:, :3] = rigid_motion_of_points(points, reference)
    G[:, 3:, 3:] = np.eye(3)
    return G.reshape(-1, 6)


def test_rigid_motions_are_met_exactly(cloud):
    points, weights, reference = cloud
    axes = Rotation.random(6, rng=2).as_matrix()
    A = weighted_motion(points, weights, reference, axes=axes)
    assert_allclose(A @ rigid(points, reference), np.eye(6), rtol=0, atol=1e-12)


def test_any_other_motion_is_farther_away(cloud):
    """The sum of weighted squares does not fall in any of 50 random directions from its answer."""
    points, weights, reference = cloud
    u = RNG.standard_normal(36)
    L = characteristic_length(points, reference)
    W = (weights * np.repeat([1.0, L**2], 3)).ravel()
    G = rigid(points, reference)

    def distance(motion):
        return np.sum(W * (u - G @ motion) ** 2)

    best = weighted_motion(points, weights, reference) @ u
    assert all(distance(best + 1e-3 * RNG.standard_normal(6)) > distance(best) for _ in range(50))


def test_weights_of_translations_alone_are_the_mean_motion(cloud):
    points, weights, reference = cloud
    alone = np.repeat(weights[:, :1], 6, axis=1) * [1, 1, 1, 0, 0, 0]
    A = weighted_motion(points, alone, reference).reshape(6, 6, 6)
    assert_allclose(A[:, :, :3].reshape(6, -1), mean_motion(points, weights[:, 0], reference), rtol=0, atol=1e-12)
    assert not A[:, :, 3:].any()


def test_the_matrix_does_not_depend_on_the_unit_of_length(cloud):
    """Displacements and rotations of a model in millimetres, brought back to metres."""
    points, weights, reference = cloud
    scale = np.repeat([1000.0, 1.0], 3)
    in_mm = weighted_motion(1000 * points, weights, 1000 * reference)
    assert_allclose(in_mm * np.tile(scale, 6) / scale[:, None], weighted_motion(points, weights, reference), atol=1e-12)


def test_a_force_at_the_reference_is_spread_without_changing_its_moment(cloud):
    points, weights, reference = cloud
    A = weighted_motion(points, weights, reference)
    wrench = RNG.standard_normal(6)
    f = A.T @ wrench
    assert_allclose(rigid(points, reference).T @ f, wrench, rtol=0, atol=1e-11)


def test_members_on_a_line_say_the_components_that_they_can():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    weights = np.tile([1.0, 1, 1, 0, 0, 0], (3, 1))
    reference = np.array([1.0, 0, 0])
    A = weighted_motion(points, weights, reference, components=(0, 1, 2, 4, 5))
    G = rigid(points, reference)[:, [0, 1, 2, 4, 5]]
    assert_allclose(A @ G, np.eye(5), rtol=0, atol=1e-12)
    with pytest.raises(BodyError, match="components 4 of the reference point: they lie on a line"):
        weighted_motion(points, weights, reference, components=(3,))
    with pytest.raises(BodyError, match="they lie on a line"):
        weighted_motion(points, weights, reference)
    weights[0, 3] = 0.5  # one rotation about the line is enough
    assert_allclose(weighted_motion(points, weights, reference) @ rigid(points, reference), np.eye(6), atol=1e-12)


@pytest.mark.parametrize(
    ("weights", "word"),
    [
        (np.ones((2, 3)), r"expected weights \(3, 6\)"),
        (np.zeros((3, 6)), "one above zero"),
        (-np.ones((3, 6)), "zero or more"),
        (np.full((3, 6), np.nan), "finite"),
    ],
)
def test_weights_that_are_none_are_refused(weights, word):
    with pytest.raises(BodyError, match=word):
        weighted_motion(np.eye(3), weights, np.zeros(3))
