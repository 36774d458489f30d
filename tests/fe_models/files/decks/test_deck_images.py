"""Images of decks: axes and vectors go where a motion takes them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fe_models.files.decks.deck_images import Motion, moved_deck
from fe_models.files.decks.ledger import Ledger
from fe_models.files.read_deck import parse_deck

DECK = """BEGIN BULK
CORD2R,5,,0.,0.,0.,.3,.2,1.
,1.,.1,.4
GRID,1,,0.,0.,0.,5
GRID,2,,1.,0.,.2
GRID,3,,1.,0.,.2
CBAR,1,1,1,2,.1,1.,.2
PBAR,1,1,1.-3,2.-6,1.-6,2.-6
MAT1,1,7.+10,,.33,2700.
CBUSH,2,2,2,3,,,,5
PBUSH,2,K,1.+5,2.+5,3.+5
CONM2,3,3,,2.
SPC1,1,13,1
FORCE,2,2,,1.,.3,.4,.5
MOMENT,2,2,,1.,.3,.4,.5
ENDDATA
"""
TURN = Rotation.from_rotvec([0.4, -0.2, 0.9]).as_matrix()
MIRROR = TURN @ np.diag([1.0, 1.0, -1.0])


@pytest.mark.parametrize(("Q", "side"), [(TURN, 1.0), (MIRROR, -1.0)], ids=["rotation", "reflection"])
def test_axes_and_loads_of_an_image_go_with_the_motion(tmp_path, Q, side):
    """In a mirror the third axis is turned round, so that the axes are right-handed, and moments are pseudovectors."""
    path = tmp_path / "own.bdf"
    path.write_text(DECK)
    deck = parse_deck(path)
    moved = moved_deck(deck, Motion(Q, np.array([1.0, 2.0, 3.0])), Ledger("image"), "a part")
    keep = np.diag([1.0, 1.0, side])
    (support,), (spring,) = deck.supports, deck.springs
    assert_allclose(moved.supports[0].axes, keep @ np.array(support.axes) @ Q.T, rtol=0, atol=1e-12)
    assert_allclose(moved.springs[0].triad, keep @ np.array(spring.triad) @ Q.T, rtol=0, atol=1e-12)
    ((_, six),), ((_, image),) = deck.loads[0].forces.items(), moved.loads[0].forces.items()
    assert_allclose(image, np.concatenate([Q @ six[:3], side * Q @ six[3:]]), rtol=0, atol=1e-12)
    assert_allclose(moved.mesh.nodes, deck.mesh.nodes @ Q.T + [1, 2, 3], rtol=0, atol=1e-12)
    for axes in (moved.supports[0].axes, moved.springs[0].triad):
        assert_allclose(np.linalg.det(axes), 1.0, rtol=1e-12)
