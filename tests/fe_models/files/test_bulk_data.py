"""Cards of Nastran in all their fields, coordinate systems and the places and axes of grid points in them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fe_models.errors import MeshError
from fe_models.files.nastran.bulk_data.cards import read_cards
from fe_models.files.nastran.bulk_data.coordinate_systems import read_grid_points


def points_of(text):
    return read_grid_points(read_cards("deck", text))


def test_small_large_and_free_fields_say_the_same():
    texts = (
        "GRID           7       2     1.5   2.5-3  -3.D+1       3",
        "GRID*                  7               2             1.5           2.5-3*A\n"
        "*A               -3.D+1               3",
        "grid,7,2,1.5,2.5-3,-3.D+1,3",
        "GRID*,7,2,1.5,2.5E-3\n*,-30.,3",
        "GRID   7,2,1.5,2.5-3,-3.D+1,3",
    )
    for text in texts:
        (card,) = read_cards("deck", text)
        assert card.name == "GRID"
        assert [card.integer(1), card.integer(2), card.integer(6)] == [7, 2, 3]
        assert [card.real(3), card.real(4), card.real(5)] == [1.5, 2.5e-3, -30.0]
        assert card.text(7) == card.text(99) == ""


def test_continuations_join_and_comments_end_a_line():
    (card,) = read_cards("deck", "RBE2,1,2,123,4,5,6,7,8,+A $ first\n$ between\n+A,9,10")
    assert [card.integer(k) for k in (*range(4, 10), 9, 10)] == [4, 5, 6, 7, 8, 9, 9, 10]


def test_a_blank_field_that_is_counted_up_begins_at_zero():
    cards = list(read_cards("deck", "GRID,1,,1.,2.,3.\n=,*(1),=,=,=,*(.5),*(7)\n=(1)\n"))
    assert [card.integer(6, 0) for card in cards] == [0, 7, 14]
    assert [card.real(5) for card in cards] == [3.0, 3.5, 4.0]


def test_case_control_is_not_bulk_data_and_enddata_ends_it():
    text = "SOL 103\nCEND\nSPC = 3\nBEGIN BULK\nSPOINT,1\nENDDATA\nSPOINT,2\n"
    assert [card.fields[0] for card in read_cards("deck", text)] == ["1"]


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("+A,1,2", "continuation without a card"),
        ("GRID,1\n1054,1,2", "line 2: expected the name of a card, got '1054'"),
        ("RBE2,1,2,123,4,5,6,7,8,+A\n+B,9", "asks for the continuation 'A', but line 2 has 'B'"),
        ("GRID,x", "field 2: expected an integer, got 'x'"),
        ("GRID,1,,a", "field 4: expected a real number"),
        ("GRID,1,5", "needs coordinate system 5"),
        ("GRID,1,1\nCORD1R,1,1,2,3\nGRID,2\nGRID,3", "is defined by itself"),
        ("CORD2R,1,,0.,0.,0.,0.,0.,1.,+\n+,0.,0.,2.", "lie on one line"),
        ("CORD1R,1,1,2,3\nGRID,1", "needs grid point 2"),
        ("GRID,1,,1.\nGRID,1,,2.", "is defined otherwise at deck, line 1"),
        ("CORD2R,1,2,0.,0.,0.,0.,0.,1.,+\n+,1.,0.,0.\nCORD2R,2,1,0.,0.,0.,0.,0.,1.,+\n+,1.,0.,0.", "defined by itself"),
    ],
)
def test_cards_that_do_not_define_a_model_are_refused(text, word):
    with pytest.raises(MeshError, match=word):
        points_of(text)


def test_the_same_card_twice_counts_once():
    assert len(points_of("GRID,1,,1.\nGRID*,1,,1.0,0.").positions) == 1


def test_cylindrical_and_spherical_places_and_axes():
    """A system at (1, 0, 0) with z along basic x and x along basic y: a chain of two, the second at its origin."""
    text = (
        "CORD2R,1,,1.,0.,0.,2.,0.,0.,+\n+,1.,1.,0.\n"
        "CORD2C,2,1,0.,0.,0.,0.,0.,1.,+\n+,1.,0.,0.\n"
        "CORD2S,3,1,0.,0.,0.,0.,0.,1.,+\n+,1.,0.,0.\n"
        "GRDSET,,2\nGRID,1,,2.,90.,3.,2\nGRID,2,3,2.,90.,90.,3\nGRID,3,1,1.,2.,3.,1\nGRID,4,0,1.,2.,3.\nGRID,5,2,0.,0.,4.,2"
    )
    points = points_of(text)
    # in system 1: (0, 2, 3); its x is basic y, its y basic z, its z basic x
    assert_allclose(points.positions[1], [1 + 3, 0, 2], atol=1e-14)
    assert_allclose(points.positions[2], [1, 0, 2], atol=1e-14)
    assert_allclose(points.positions[3], [1 + 3, 1, 2], atol=1e-14)
    assert_allclose(points.positions[4], [1, 2, 3], atol=1e-14)
    e_x, e_y, e_z = np.eye(3)
    assert_allclose(points.axes[1], np.stack([e_z, -e_y, e_x], axis=1), atol=1e-14)  # r, theta, z
    assert_allclose(points.axes[2], np.stack([e_z, -e_x, -e_y], axis=1), atol=1e-14)  # r, theta, phi
    assert_allclose(points.axes[3], np.stack([e_y, e_z, e_x], axis=1), atol=1e-14)
    assert_allclose(points.axes[5], np.stack([e_y, e_z, e_x], axis=1), atol=1e-14)  # on the axis: r along x
    assert 4 not in points.axes


def test_systems_of_three_grid_points():
    text = "GRID,1,,1.,1.,1.\nGRID,2,,1.,1.,2.\nGRID,3,,1.,5.,1.\nCORD1R,9,1,2,3\nGRID,4,9,1.,0.,0.,9"
    points = points_of(text)
    assert_allclose(points.positions[4], [1, 2, 1], atol=1e-14)
    assert_allclose(points.axes[4], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-14)


def test_a_card_of_three_grid_points_may_define_two_systems():
    """Of the second one z is along y of the mesh, and x along z."""
    places = "GRID,1\nGRID,2,,0.,0.,1.\nGRID,3,,1.,0.,0.\nGRID,11,,1.,2.,3.\nGRID,12,,1.,5.,3.\nGRID,13,,1.,2.,7.\n"
    points = points_of(places + "CORD1R,8,1,2,3,9,11,12,13\nGRID,20,8,1.,2.,3.,8\nGRID,21,9,1.,2.,3.,9")
    assert_allclose(points.positions[20], [1, 2, 3], atol=1e-14)
    assert_allclose(points.positions[21], [1 + 2, 2 + 3, 3 + 1], atol=1e-14)
    assert_allclose(points.axes[21], [[0, 1, 0], [0, 0, 1], [1, 0, 0]], atol=1e-14)


@pytest.mark.parametrize("shape", ["C", "S"])
def test_axes_are_the_directions_in_which_coordinates_grow(shape):
    """Central differences of the place, along each coordinate."""
    card = f"CORD2{shape},1,,1.,2.,3.,2.,2.,4.,+\n+,0.,5.,1.\n"
    given = np.array([1.3, 40.0, 70.0])

    def at(coordinates):
        return points_of(card + "GRID,1,1," + ",".join(f"{c:.10f}" for c in coordinates) + ",1")

    axes = at(given).axes[1]
    for k in range(3):
        step = np.eye(3)[k] * 1e-3
        change = at(given + step).positions[1] - at(given - step).positions[1]
        assert_allclose(axes[:, k], change / np.linalg.norm(change), atol=1e-6)
