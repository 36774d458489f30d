"""Offsets of shells of Nastran (ZOFFS, Z0): every card, every kind of property, elements of different offsets."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.cms.jobs.decks.nastran_bodies import arm, body_of

CORNERS = np.array([[0, 0], [2, 0.1], [2.1, 1], [-0.1, 1.2]])
TURN = np.linalg.qr(np.array([[1.0, 0.3, 0.2], [0.1, 1.0, -0.4], [-0.3, 0.2, 1.0]]))[0]
TURN = TURN * np.sign(np.linalg.det(TURN))
NORMAL = TURN[:, 2]
PROPERTIES = {
    "PSHELL": "PSHELL,1,1,.05,1,,1,,2.",
    "PSHELL of MAT8": "PSHELL,1,3,.05,3,,3",
    "PCOMP": "PCOMP,1,,1.,,,,,\n,3,.02,30.,,1,.03,",
}
MATERIALS = "MAT1,1,2.+11,,.3,7800.\nMAT8,3,1.4+11,1.+10,.3,5.+9,4.+9,3.+9,1600.\nPARAM,COUPMASS,1\n"
#: card -> local grids, and its fields behind them up to ZOFFS
CARDS = {
    "CTRIA3": ("123", ["0."]),
    "CTRIAR": ("123", ["0."]),
    "CTRIA6": ("123567", ["0."]),
    "CQUAD4": ("1234", ["0."]),
    "CQUADR": ("1234", ["0."]),
    "CQUAD8": ("12345678", ["", "", "", "", "0."]),
}


def deck(cards, property_):
    """Return a deck of these cards: name, offset, whether it stands 3 to the side, number from 1."""
    lines, grids = [], []
    for k, (name, offset) in enumerate(cards):
        letters, between = CARDS[name]
        n = 3 if name.startswith("CTRI") else 4
        flat = [*CORNERS[:n], *((CORNERS[j] + CORNERS[(j + 1) % n]) / 2 for j in range(n))]
        places = {letter: flat[j] for j, letter in enumerate("123567" if n == 3 else "12345678")}
        numbers = []
        for letter in letters:
            x = TURN @ np.array([*(places[letter] + [3.0 * k, 0.0]), 0.4])
            numbers.append(str(100 * k + int(letter)))
            grids.append(f"GRID,{numbers[-1]},,{','.join(repr(float(v)) for v in x)}")
        fields = [name, str(k + 1), "1", *numbers, *between, *([] if offset is None else [repr(offset)])]
        lines.append(",".join(fields[:9]))
        lines += ["," + ",".join(fields[j : j + 8]) for j in range(9, len(fields), 8)]
    return "\n".join([*grids, *lines, property_]) + "\n" + MATERIALS


def on_arms(body, offsets):
    """Return the motion of the nodes moved by offset × normal of their element by that of the nodes, (n_dof, n_dof)."""
    T = np.zeros((body.n_dof, body.n_dof))
    for node in range(len(body.nodes)):
        at = np.flatnonzero(body.dofs[:, 0] == node)
        side = int((TURN.T @ body.nodes[node])[0] > 2.6)
        T[np.ix_(at, at)] = arm(offsets[side] * NORMAL)[np.ix_(body.dofs[at, 1], body.dofs[at, 1])]
    return T


@pytest.mark.parametrize("property_", PROPERTIES)
@pytest.mark.parametrize("name", CARDS)
def test_an_offset_moves_the_shell_along_its_normal(tmp_path, name, property_):
    """K and M are those of the shell at the grid points, which rigid arms carry; two cells of one property."""
    plain, _ = body_of(tmp_path, deck([(name, None), (name, None)], PROPERTIES[property_]))
    body, found = body_of(tmp_path, deck([(name, 0.07), (name, -0.03)], PROPERTIES[property_]))
    T = on_arms(plain, (0.07, -0.03))
    moving = np.unique(plain.dofs[:, 0])
    assert_allclose(body.nodes[moving], plain.nodes[moving], rtol=0, atol=1e-12)
    for ours, theirs in ((body.K, plain.K), (body.M, plain.M)):
        expected = T.T @ theirs.toarray() @ T
        assert_allclose(ours.toarray(), expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    assert sorted(round(shell.offset, 12) for shell in found.shells) == [-0.03, 0.07]


def test_the_bottom_of_layers_and_the_offset_of_an_element_add(tmp_path):
    """Z0 = -.01 of a stack of 0.05: its middle lies 0.015 above the grid points, and ZOFFS on top."""
    text = deck([("CQUAD4", 0.07), ("CQUAD4", None)], PROPERTIES["PCOMP"].replace("PCOMP,1,,", "PCOMP,1,-.01,"))
    _, found = body_of(tmp_path, text)
    assert_allclose(sorted(shell.offset for shell in found.shells), [0.015, 0.085], rtol=1e-12)
