"""Boxes of unequal walls: limits that are known, an even box and a channel, and their place in a deck."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fe_models.elements.beams.sections import BoxSection
from fe_models.errors import MeshError
from fe_models.files.abaqus.uneven_box import uneven_box
from fe_models.files.read_deck import parse_deck

KEYS = {"area": "A", "iy": "Iy", "iz": "Iz", "torsion": "J", "shear_area_y": "A_sy", "shear_area_z": "A_sz"}


def test_an_even_box_has_the_numbers_of_our_box():
    """Its shear areas are Cowper's at nu = 0."""
    box, ours = uneven_box(2.0, 1.0, (0.02, 0.03, 0.02, 0.03)), BoxSection(2.0, 1.0, 0.02, 0.03).properties(0.0)
    for key, name in KEYS.items():
        assert_allclose(box.shape[key], getattr(ours, name), rtol=1e-12)
    assert_allclose([*box.centroid, *box.shape["shear_center"]], 0, atol=1e-15)


@pytest.mark.parametrize("side", range(4))
def test_a_box_without_a_wall_is_a_channel(side):
    """Shear centre b² h² t / (4 I) outside of the web, along middle lines; J is the sum of t³ b / 3."""
    b, h, t = 50.0, 100.0, 1.0
    walls = [t] * 4
    walls[side] = 1e-9
    outer = (b, h) if side % 2 == 0 else (h, b)
    box = uneven_box(*outer, tuple(walls))
    web, flange = h - t, b - t / 2
    inertia = web**3 * t / 12 + 2 * flange * t * (web / 2) ** 2
    expected = -(b / 2 - t / 2 + flange**2 * web**2 * t / 4 / inertia)  # from the middle, away from the open side
    along = np.array(box.centroid) + box.shape["shear_center"]
    at = expected * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])[side]
    assert_allclose(along, at, rtol=1e-8, atol=1e-8)
    assert_allclose(box.shape["torsion"], (2 * flange + web) * t**3 / 3, rtol=1e-4)


def test_area_and_moments_are_those_of_strips():
    """Sums over 400 x 400 squares of the outer rectangle that lie in the walls, about their own centroid."""
    b, h, walls = 3.0, 2.0, (0.3, 0.2, 0.15, 0.2)
    at = (np.arange(400) + 0.5) / 400 - 0.5
    y, z = (x.ravel() for x in np.meshgrid(b * at, h * at))
    inside = (y > b / 2 - walls[0]) | (z > h / 2 - walls[1]) | (y < -b / 2 + walls[2]) | (z < -h / 2 + walls[3])
    y, z, dA = y[inside], z[inside], b * h / 400**2
    box = uneven_box(b, h, walls)
    assert_allclose(box.centroid, [y.mean(), z.mean()], atol=1e-12)
    assert_allclose(box.shape["area"], len(y) * dA, rtol=1e-12)
    assert_allclose(box.shape["iz"], ((y - y.mean()) ** 2).sum() * dA, rtol=1e-4)
    assert_allclose(box.shape["iy"], ((z - z.mean()) ** 2).sum() * dA, rtol=1e-4)


DECK = """*NODE
1, 0, 0, 0
2, 0, 0, 1
*ELEMENT, TYPE=B31, ELSET=arm
1, 1, 2
*BEAM GENERAL SECTION, ELSET=arm, MATERIAL=M, SECTION=BOX
3., 2., 0.3, 0.2, 0.15, 0.2
1., 0., 0.
*MATERIAL, NAME=M
*ELASTIC
210., .25
*DENSITY
1.
"""


def test_the_centroid_lies_towards_the_thick_wall(tmp_path):
    """Wall 1 stands at +1, as CalculiX 2.20 has it: a cantilever pulled at its node bends towards the thick wall."""
    path = tmp_path / "box.inp"
    path.write_text(DECK)
    (line,) = parse_deck(path).lines
    assert line.offset[0] > 0.1
    assert line.offset[1] == 0
    path.write_text(DECK.replace("0.15, 0.2\n", "0.15, 0.25\n"))
    with pytest.raises(MeshError, match=r"1 .*BOX: walls that differ both ways"):
        parse_deck(path).ledger.require_whole()
    path.write_text(DECK.replace("0.3, 0.2, 0.15", "2.9, 0.2, 0.15"))
    with pytest.raises(MeshError, match="leave a hole"):
        parse_deck(path)
