"""What a deck of Nastran ties, holds and cuts: axes of points, gaps, middle grids, planes, tapers, shear centres."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import null_space

from tests.cms.jobs.decks.nastran_bodies import (
    GA,
    GB,
    GRIDS,
    I1,
    I2,
    MATERIAL,
    ORIENTED,
    RHO,
    SECTION,
    A,
    E,
    G,
    J,
    V,
    axes_of,
    body_of,
    condensed,
    tip_flexibility,
)

TURNED = "CORD2R,7,,0.,0.,0.,.3,.2,1.\n,1.,.1,.4\n"
POINTS = np.array([[0, 0, 0], [1, 0, 0.1], [1.1, 0.2, 0.3], [2, 0.5, 0.3]])
ACROSS = POINTS[2] - POINTS[1]
TWO_BARS = "".join(
    f"GRID,{k},,{x},{y},{z}{',7' if k == 3 else ''}\n" for k, (x, y, z) in enumerate(POINTS.tolist(), start=1)
)
TWO_BARS += "CBAR,1,1,1,2,0.,1.,0.\nCBAR,2,1,3,4,0.,1.,0.\n" + SECTION + MATERIAL + TURNED


def system_7():
    """The axes of CORD2R 7, rows."""
    z = np.array([0.3, 0.2, 1.0]) / np.linalg.norm([0.3, 0.2, 1.0])
    x = np.array([1.0, 0.1, 0.4])
    x = x - (x @ z) * z
    x = x / np.linalg.norm(x)
    return np.array([x, np.cross(z, x), z])


def free_stiffness(tmp_path):
    """K of the two bars alone, (24, 24), node by node."""
    body, _ = body_of(tmp_path, TWO_BARS)
    order = [int(np.flatnonzero((body.dofs == (n, c)).all(axis=1))[0]) for n in node_rows(body) for c in range(6)]
    return body.K.toarray()[np.ix_(order, order)]


def node_rows(body):
    return [int(np.argmin(np.linalg.norm(body.nodes - p, axis=1))) for p in POINTS]


def allowed_energies(K, rows):
    """Return the eigenvalues of K on the motions that satisfy equations, (n, 24) rows."""
    Z = null_space(np.atleast_2d(rows))
    return np.linalg.eigvalsh(Z.T @ K @ Z)


def row_of(*terms):
    """Return an equation of (node from 1, component 0-5, coefficient), the axes of node 3 being those of system 7."""
    R, row = system_7(), np.zeros(24)
    for node, c, a in terms:
        first = 6 * (node - 1) + c - c % 3
        row[first : first + 3] += a * (R[c % 3] if node == 3 else np.eye(3)[c % 3])
    return row


def rigid_rows(components):
    """Return e · (u_3 - u_2 - theta_2 × r) = 0 along the axes of point 3."""
    r, R = POINTS[2] - POINTS[1], system_7()
    rows = []
    for c in components:
        row = row_of((3, c, 1.0))
        first = c - c % 3
        row[6 + first : 9 + first] -= R[c % 3]
        if first == 0:
            row[9:12] -= np.cross(r, R[c % 3])
        rows.append(row)
    return rows


@pytest.mark.parametrize(
    ("cards", "rows"),
    [
        ("MPC,1,3,2,2.,2,1,-1.\n,,1,4,.5\n", [row_of((3, 1, 2.0), (2, 0, -1.0), (1, 3, 0.5))]),
        (
            "MPC,1,3,1,1.,2,1,-1.\nMPC,1,3,3,1.,3,2,.5\n,,2,5,.2\n",
            [row_of((3, 0, 1.0), (2, 0, -1.0)), row_of((3, 2, 1.0), (3, 1, 0.5), (2, 4, 0.2))],
        ),
        ("MPC,1,2,1,1.,3,2,-1.\n", [row_of((2, 0, 1.0), (3, 1, -1.0))]),
        ("RBE2,9,2,13,3\n", rigid_rows([0, 2])),
        ("RBAR,9,2,3,123456,,,1246\n", rigid_rows([0, 1, 3, 5])),
        ("RROD,9,2,3,1\n", [np.r_[np.zeros(6), -ACROSS, np.zeros(3), ACROSS, np.zeros(9)]]),
    ],
)  # fmt: skip
def test_equations_along_axes_of_their_own_points(tmp_path, cards, rows):
    body, _ = body_of(tmp_path, TWO_BARS + cards)
    K = free_stiffness(tmp_path)
    n = 24 - len(rows)
    assert body.n_dof == n
    full = np.zeros((24, n))  # every motion of the deck's body as one of the free bars
    recovery = body.recovery
    place = {(int(node), int(c)): k for k, (node, c) in enumerate(recovery.dofs)}
    T = recovery.matrix.toarray()
    for k, node in enumerate(node_rows(body)):
        for c in range(6):
            full[6 * k + c] = T[place[node, c]]
    assert np.abs(np.array(rows) @ full).max() < 1e-12 * np.abs(rows).max()
    assert np.linalg.matrix_rank(full) == n
    assert_allclose(body.K.toarray(), full.T @ K @ full, rtol=0, atol=1e-9 * np.abs(K).max())


def test_equations_that_say_too_much_of_a_point_are_refused(tmp_path):
    cards = "MPC,1,3,1,1.,2,1,-1.\nMPC,1,3,1,1.,1,1,-1.\n"
    with pytest.raises(ValueError, match="equations that say more of a grid point"):
        body_of(tmp_path, TWO_BARS + cards)


def test_supports_along_axes_of_their_own_points_have_them(tmp_path):
    body, deck = body_of(tmp_path, TWO_BARS + "SPC1,1,13,3\nSPC1,1,123,1\nSPC1,1,2,99\nGRID,99,,5.,5.,5.\n")
    by = {support.components: support for support in deck.supports}
    assert by[0, 1, 2].axes is None
    assert_allclose(by[0, 2].axes, system_7(), rtol=0, atol=1e-12)
    assert any("points of no element" in row[2] for row in deck.ledger.rows())
    turned = next(i for i in body.interfaces if i.name == by[0, 2].name)
    assert_allclose(turned.triad, system_7().T, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("gap", "along", "across"),
    [
        ("PGAP,9,0.,,1.+6,,2.+5", 1e6, 2e5),
        ("PGAP,9,-.1,,1.+6,,,.1", 1e6, 1e5),
        ("PGAP,9,.1,,1.+6,3.+2,2.+5", 3e2, 0.0),
        ("PGAP,9,.1,,1.+6,,2.+5", 0.0, 0.0),
    ],
)
def test_a_gap_is_the_spring_of_its_first_state(tmp_path, gap, along, across):
    text = TWO_BARS.replace("GRID,3,,1.1,0.2,0.3", "GRID,3,,1.,0.,.1")
    plain, _ = body_of(tmp_path, text)
    body, deck = body_of(tmp_path, text + f"CGAP,8,9,2,3,,,,7\n{gap}\n")
    R = system_7()
    u = np.random.default_rng(2).normal(size=body.n_dof)
    at = {(n, c): u[(body.dofs == (n, c)).all(axis=1)][0] for n in (1, 2) for c in range(3)}
    d = R @ np.array([at[1, c] - at[2, c] for c in range(3)])
    expected = along * d[0] ** 2 + across * (d[1] ** 2 + d[2] ** 2)
    assert_allclose(u @ (body.K - plain.K) @ u, expected, rtol=1e-9, atol=1e-9 * (u @ plain.K @ u))
    assert any("at first: a linear spring" in row[2] for row in deck.ledger.rows())


def test_a_spring_along_the_line_of_two_points(tmp_path):
    plain, _ = body_of(tmp_path, TWO_BARS)
    body, _ = body_of(tmp_path, TWO_BARS + "CBUSH1D,8,9,2,3\nPBUSH1D,9,1.+5,20.\n")
    e = POINTS[2] - POINTS[1]
    e = e / np.linalg.norm(e)
    u = np.random.default_rng(2).normal(size=body.n_dof)
    at = {(n, c): u[(body.dofs == (n, c)).all(axis=1)][0] for n in (1, 2) for c in range(3)}
    d = e @ np.array([at[2, c] - at[1, c] for c in range(3)])
    assert_allclose(u @ (body.K - plain.K) @ u, 1e5 * d**2, rtol=1e-8)
    assert_allclose(u @ body.D @ u, 20 * d**2, rtol=1e-9)


@pytest.mark.parametrize(
    ("further", "is_noted"),
    [("", False), (",,,1.,2.", False), (",,,,,\n,SPRING", True), (",,,1.,2.,\n,SPRING,TABLE,12", True)],
)
def test_a_law_of_pbush1d_is_noted_and_its_stress_recovery_is_not(tmp_path, further, is_noted):
    """Fields 6 and 7, SA and SE, are harmless; the laws begin with field 9."""
    _, deck = body_of(tmp_path, TWO_BARS + f"CBUSH1D,8,9,2,3\nPBUSH1D,9,1.+5,20.{further}\n")
    why = "laws that are not linear, or vary with time: K and C are taken"
    assert [row[2] for row in deck.ledger.rows() if row[0] == "PBUSH1D"] == [why] * is_noted


def test_a_spring_to_a_held_point_of_nothing_else_is_one_to_the_ground(tmp_path):
    text = TWO_BARS + "GRID,5,,1.,0.,.1,,123456\nCELAS2,8,1.+5,2,1,5,1\n"
    plain, _ = body_of(tmp_path, TWO_BARS)
    body, deck = body_of(tmp_path, text)
    assert_allclose(body.K.toarray(), plain.K.toarray(), rtol=0, atol=1e-12 * abs(plain.K).max())
    assert any("tie grid point 2 to point 5, which is held" in row[2] for row in deck.ledger.rows())
    assert [support.name for support in deck.supports] == ["grounded_123"]


BRICK = """GRID,1,,0.,0.,0.
GRID,2,,2.,0.,.1
GRID,3,,2.1,1.,0.
GRID,4,,0.,1.2,0.
GRID,5,,.1,0.,1.
GRID,6,,2.,.1,1.
GRID,7,,2.,1.,1.1
GRID,8,,0.,1.,1.
MAT1,1,2.+11,,.3,7800.
PSOLID,9,1
PARAM,COUPMASS,1
"""
CELLS = {"CHEXA": (8, 20), "CPENTA": (6, 15), "CTETRA": (4, 10)}


@pytest.mark.parametrize("name", CELLS)
def test_a_solid_with_one_middle_grid_is_of_first_order_elsewhere(tmp_path, name):
    """K and M of the partial cell are those of the full one on motions that leave the other edges straight."""
    corners, n = CELLS[name]
    words = [str(k + 1) for k in range(corners)]
    head = BRICK + "GRID,50,,1.,.03,.05\n"
    full_grids, middles = "", []
    pairs = {
        "CHEXA": "12 23 34 41 15 26 37 48 56 67 78 85", "CPENTA": "12 23 31 14 25 36 45 56 64",
        "CTETRA": "12 23 31 14 24 34",
    }[name].split()  # fmt: skip
    points = {int(line.split(",")[1]): np.array(line.split(",")[3:6], float) for line in BRICK.splitlines()[:8]}
    for k, pair in enumerate(pairs):
        a, b = (points[int(letter)] for letter in pair)
        place = (a + b) / 2 if k else np.array([1.0, 0.03, 0.05])
        full_grids += f"GRID,{50 + k},,{','.join(repr(float(x)) for x in place)}\n"
        middles.append(str(50 + k))
    partial, _ = body_of(tmp_path, head + card(name, [*words, "50", *[""] * (n - corners - 1)]))
    whole, _ = body_of(tmp_path, BRICK + full_grids + card(name, [*words, *middles]))
    assert partial.n_dof == 3 * (corners + 1)
    place = {(int(node), int(c)): k for k, (node, c) in enumerate(partial.recovery.dofs)}
    T = np.zeros((whole.n_dof, partial.n_dof))
    for row, (node, c) in enumerate(whole.dofs):
        there = int(np.argmin(np.linalg.norm(partial.nodes - whole.nodes[node], axis=1)))
        T[row] = partial.recovery.matrix.toarray()[place[there, int(c)]]
    for pair in pairs[1:]:  # by hand: the mean of the corners of the edge
        here, a, b = (
            np.flatnonzero((np.abs(whole.nodes - p) < 1e-9).all(axis=1))[0]
            for p in ((points[int(pair[0])] + points[int(pair[1])]) / 2, points[int(pair[0])], points[int(pair[1])])
        )
        for c in range(3):
            rows = [int(np.flatnonzero((whole.dofs == (m, c)).all(axis=1))[0]) for m in (here, a, b)]
            assert_allclose(T[rows[0]], (T[rows[1]] + T[rows[2]]) / 2, rtol=0, atol=1e-14)
    for ours, theirs in ((partial.K, whole.K), (partial.M, whole.M)):
        assert_allclose(ours.toarray(), T.T @ theirs @ T, rtol=0, atol=1e-10 * abs(theirs).max())


def card(name, words):
    fields = [name, "1", "9", *words]
    lines = [",".join(fields[:9])]
    for k in range(9, len(fields), 8):
        lines.append("," + ",".join(fields[k : k + 8]))
    return "\n".join(lines) + "\n"


FLAT = "".join(f"GRID,{k},,{x},{y},0.,,345\n" for k, x, y in ((1, 0.0, 0.0), (2, 1.0, 0.2), (3, 2.0, 0.1)))
FLAT += "CBEAM,1,1,1,2,0.,1.,0.\nCBEAM,2,1,2,3,0.,1.,0.\nPBEAM,1,1,2.-3,3.-6,1.-6\n" + MATERIAL


def test_a_deck_that_holds_all_points_in_a_plane_is_planar(tmp_path):
    """Beams without torsion constant: three motions of the plane and three rigid ones out of it cost no energy."""
    body, deck = body_of(tmp_path, FLAT + "SPC1,1,12,1\n", is_coupled=True)
    assert deck.plane == 2
    assert [support.components for support in deck.supports] == [(0, 1)]
    values = np.linalg.eigvalsh(body.K.toarray())
    assert body.n_dof == 3 * 3 + 3
    assert int(np.sum(values < 1e-9 * values[-1])) == 6
    _, deck = body_of(tmp_path, FLAT.replace("0.1,0.,,345", "0.1,0.,,34"))
    assert deck.plane is None
    _, deck = body_of(tmp_path, FLAT.replace("2.0,0.1,0.", "2.0,0.1,.3"))
    assert deck.plane is None  # held, but not in one plane


def test_membranes_are_read_where_the_deck_is_planar(tmp_path):
    """Nu = 0, one square of 1 by 1: the strain energy of a stretch and of a shear are E t/2 and G t/2."""
    grids = "".join(
        f"GRID,{k},,{x},{y},0.,,3456\n" for k, x, y in ((1, 0.0, 0.0), (2, 1.0, 0.0), (3, 1.0, 1.0), (4, 0.0, 1.0))
    )
    text = grids + "CQUAD4,1,1,1,2,3,4\nPSHELL,1,1,.05\nMAT1,1,2.+11,,0.,7800.\n"
    body, deck = body_of(tmp_path, text, is_coupled=True)
    assert any("plane = 'xy'" in row[2] for row in deck.ledger.rows())
    assert not deck.supports
    node, c = body.dofs.T
    for stretch, modulus in ((np.array([[1, 0], [0, 0]]), 2e11), (np.array([[0, 1], [0, 0]]), 1e11)):
        u = np.zeros(body.n_dof)
        for k in range(body.n_dof):
            if c[k] < 2:
                u[k] = (stretch @ body.nodes[node[k], :2])[c[k]]
            elif c[k] == 5:
                u[k] = (stretch[1, 0] - stretch[0, 1]) / 2
        assert_allclose(u @ body.K @ u, modulus * 0.05, rtol=1e-9)
    with pytest.raises(ValueError, match="a membrane, without stiffness in bending; only where the deck is planar"):
        body_of(tmp_path, text.replace("3456", "456"))


TAPER = "PBEAM,1,1,2.-3,3.-6,1.-6,,2.-6,.4\n,,,,,,,,\n,YESA,1.,4.-3,6.-6,3.-6,,6.-6,.8\n,0.,0.\n"


def test_a_tapered_beam_is_made_of_pieces(tmp_path):
    """Flexibilities of a cantilever with A, I, J linear in x: integrals of the closed form by 4000 steps."""
    body, deck = body_of(tmp_path, f"{GRIDS}{ORIENTED.replace('CBAR', 'CBEAM')}\n{TAPER}{MATERIAL}")
    F = tip_flexibility(body)
    L = np.linalg.norm(GB - GA)
    x = (np.arange(4000) + 0.5) / 4000 * L
    s = x / L
    a, i1, i2, j = A * (1 + s), I1 * (1 + s), I2 * (1 + 2 * s), J * (1 + 2 * s)
    h = L / 4000
    expected = [
        (h / E / a).sum(),
        (h * (L - x) ** 2 / E / i1).sum(),
        (h * (L - x) ** 2 / E / i2).sum(),
        (h / G / j).sum(),
    ]
    assert_allclose([F[0, 0], F[1, 1], F[2, 2], F[3, 3]], expected, rtol=4e-3)
    assert_allclose(F[1, 5], (h * (L - x) / E / i1).sum(), rtol=4e-3)
    up = (body.dofs[:, 1] == 2).astype(float)
    assert_allclose(up @ body.M @ up, L * (RHO * 1.5 * A + 0.6), rtol=1e-9)
    assert any("tapers: 12 pieces" in row[2] for row in deck.ledger.rows())


def test_a_tapered_beam_without_torsion_constant_bends_as_with_one(tmp_path):
    found = []
    for taper in (TAPER, TAPER.replace(",,2.-6,", ",,0.,").replace(",,6.-6,", ",,0.,")):
        (tmp_path / str(len(found))).mkdir()
        text = f"{GRIDS}{ORIENTED.replace('CBAR', 'CBEAM')}\n{taper}{MATERIAL}"
        body, _ = body_of(tmp_path / str(len(found)), text)
        T = np.kron(np.eye(4), axes_of(GB - GA, V))
        found.append(T @ condensed(body, (GA, GB)) @ T.T)
    twist = [3, 9]
    assert np.abs(found[1][twist]).max() < 1e-9 * np.abs(found[1]).max()
    assert found[0][3, 3] > 1e-4 * found[0][4, 4]
    for K in found:
        K[twist] = K[:, twist] = 0.0
    assert_allclose(found[1], found[0], rtol=0, atol=1e-9 * np.abs(found[0]).max())


def test_tapered_beams_of_the_library_keep_their_mass_pins_and_offsets(tmp_path):
    """BAR of 0.1 x 0.2 to 0.2 x 0.2, released about y and z at end B, offset at both ends."""
    section = "PBEAML,1,1,,BAR\n,.1,.2,.5,YES,1.,.2,.2,.7\n"
    beam = f"{ORIENTED.replace('CBAR', 'CBEAM')}\n,,56,.0,.1,.2,.0,.1,-.1\n"
    body, deck = body_of(tmp_path, GRIDS + beam + section + MATERIAL)
    ends = np.stack([GA, GB]) + np.array([[0, 0.1, 0.2], [0, 0.1, -0.1]])
    L = np.linalg.norm(ends[1] - ends[0])
    up = (body.dofs[:, 1] == 2).astype(float)
    assert_allclose(up @ body.M @ up, L * (RHO * 0.03 + 0.6), rtol=1e-9)
    values = np.linalg.eigvalsh(body.K.toarray())
    assert int(np.sum(values < 1e-9 * values[-1])) == 6 + 2  # end B is left to turn about two axes
    assert len(deck.mesh.nodes) == 2 + 11 + 2  # ends, between the pieces, released or offset ends
    plain, _ = body_of(tmp_path, GRIDS + beam + section.replace("YES,1.,.2,.2,.7", "YES,1.,.1,.2,.5") + MATERIAL)
    assert plain.n_dof < body.n_dof
    with pytest.raises(ValueError, match="stations that cannot be understood"):
        body_of(tmp_path, GRIDS + beam + section.replace("YES", "PERHAPS") + MATERIAL)


def test_pieces_of_a_taper_have_properties_of_their_own_beside_those_of_shells(tmp_path):
    """PSHELL 5 would have the number of a piece if pieces were numbered from the last beam on."""
    shell = "GRID,11,,0.,0.,0.\nGRID,12,,1.,0.,0.\nGRID,13,,1.,1.,0.\nGRID,14,,0.,1.,0.\n"
    shell += "CQUAD4,7,5,11,12,13,14\nPSHELL,5,1,.01,1,,1\n"
    body, _ = body_of(tmp_path, f"{GRIDS}{ORIENTED.replace('CBAR', 'CBEAM')}\n{TAPER}{MATERIAL}{shell}")
    up = (body.dofs[:, 1] == 2).astype(float)
    mass = np.linalg.norm(GB - GA) * (RHO * 1.5 * A + 0.6) + RHO * 0.01
    assert_allclose(up @ body.M @ up, mass, rtol=1e-9)


def test_a_taper_of_a_small_size_beside_large_ones_counts(tmp_path):
    """Second moments of a wire, 1e-13 m⁴, beside added mass of 10 kg/m."""
    section = "PBEAM,1,1,1.-6,1.-13,1.-13,,2.-13,10.\n,,,,,,,,\n,YESA,1.,1.-6,2.-13,2.-13,,4.-13,10.\n"
    _, deck = body_of(tmp_path, f"{GRIDS}{ORIENTED.replace('CBAR', 'CBEAM')}\n{section}{MATERIAL}")
    assert any("tapers: 12 pieces" in row[2] for row in deck.ledger.rows())


def test_a_rigid_element_with_thermal_expansion_and_its_temperature(tmp_path):
    """RBE2 ends with ALPHA and TREF, which move no point here."""
    plain, _ = body_of(tmp_path, TWO_BARS + "RBE2,9,2,123456,3\n")
    body, _ = body_of(tmp_path, TWO_BARS + "RBE2,9,2,123456,3,6.5-6,20.\n")
    assert_allclose(body.K.toarray(), plain.K.toarray(), rtol=0, atol=0)


@pytest.mark.parametrize("cards", ["CVISC,8,9,2,3\nPVISC,9,5.\n", "CROD,8,9,2,3\nPROD,9,1,1.-3\n"])
def test_elements_along_no_line_are_refused(tmp_path, cards):
    with pytest.raises(ValueError, match=f"{cards[:4]}.*: has no length between its ends"):
        body_of(tmp_path, TWO_BARS.replace("GRID,3,,1.1,0.2,0.3", "GRID,3,,1.,0.,.1") + cards)


def test_a_mass_matrix_of_large_inertia_may_not_differ_along_its_axes(tmp_path):
    """3 kg along x and 3.003 kg along y, beside 1e8 kg m²."""
    mass = "CONM1,7,2,,3.,0.,{},0.,0.\n,3.,0.,0.,0.,1.+8,0.,0.,0.\n,0.,1.+8,0.,0.,0.,0.,0.,1.+8\n"
    body_of(tmp_path, TWO_BARS + mass.format("3."))
    with pytest.raises(ValueError, match="CONM1: no mass matrix of a rigid piece"):
        body_of(tmp_path, TWO_BARS + mass.format("3.003"))


#: middle lines of the walls: (y, z) of their ends and thickness, of shapes as PBEAML draws them, in cm
WALLS = {
    "I": (
        (10, 8, 6, 1, 1, 2),
        [((0.5, -4), (0.5, 0), 1), ((0.5, 0), (0.5, 4), 1), ((9, -3), (9, 0), 2), ((9, 0), (9, 3), 2),
         ((0.5, 0), (9, 0), 1)],
    ),
    "CHAN": (
        (8, 10, 1, 0.5), [((0.25, 0.5), (9.75, 0.5), 1), ((0.25, 0.5), (0.25, 8), 0.5), ((9.75, 0.5), (9.75, 8), 0.5)]
    ),
    "CHAN1": (
        (7, 1, 9, 10), [((0.25, 0.5), (9.75, 0.5), 1), ((0.25, 0.5), (0.25, 8), 0.5), ((9.75, 0.5), (9.75, 8), 0.5)]
    ),
    "CHAN2": (
        (0.5, 1, 8, 10),
        [((0.5, -4.75), (0.5, 4.75), 1), ((0.5, -4.75), (8, -4.75), 0.5), ((0.5, 4.75), (8, 4.75), 0.5)],
    ),
    "L": ((8, 10, 0.5, 1), [((0.25, 0.5), (0.25, 8), 0.5), ((0.25, 0.5), (10, 0.5), 1)]),
    "T": ((8, 10, 1, 0.5), [((9.5, -4), (9.5, 0), 1), ((9.5, 0), (9.5, 4), 1), ((9.5, 0), (0, 0), 0.5)]),
    "T1": ((8, 10, 1, 0.5), [((-4, 0), (0, 0), 1), ((0, 0), (4, 0), 1), ((0, 0), (0, -10.5), 0.5)]),
    "T2": ((8, 10, 1, 0.5), [((0.5, -4), (0.5, 0), 1), ((0.5, 0), (0.5, 4), 1), ((0.5, 0), (10, 0), 0.5)]),
}  # fmt: skip


def shear_centre_offset(walls, n=400):
    """Return the centroid from the shear centre along y and z, by sectorial coordinates of thin walls.

    The shear centre is the pole whose omega has no moments: with omega_D = omega - d_y z + d_z y, both ∫ omega_D y dA
    and ∫ omega_D z dA vanish, y and z from the centroid.
    """
    points, areas, omegas = [], [], []
    at_start = {tuple(walls[0][0]): 0.0}
    for _ in range(len(walls)):
        for start, end, _ in walls:
            for a, b in ((start, end), (end, start)):
                if tuple(a) in at_start and tuple(b) not in at_start:
                    at_start[tuple(b)] = at_start[tuple(a)] + a[0] * b[1] - a[1] * b[0]
    for start, end, thickness in walls:
        s = (np.arange(n) + 0.5) / n
        p = np.outer(1 - s, start) + np.outer(s, end)
        points.append(p)
        areas.append(np.full(n, thickness * np.linalg.norm(np.subtract(end, start)) / n))
        omegas.append(at_start[tuple(start)] + (start[0] * p[:, 1] - start[1] * p[:, 0]))
    p, area, omega = np.concatenate(points), np.concatenate(areas), np.concatenate(omegas)
    centre = area @ p / area.sum()
    y, z = (p - centre).T
    omega = omega - area @ omega / area.sum()
    S = np.array([[area @ (y * z), -area @ y**2], [area @ z**2, -area @ (y * z)]])
    d = np.linalg.solve(S, [area @ (omega * y), area @ (omega * z)])
    return centre - d


@pytest.mark.parametrize("name", WALLS)
def test_beams_of_the_library_have_their_ends_at_the_shear_centre(tmp_path, name):
    """A force along x at the tip's node acts at the shear centre: it bends the beam by its arm to the centroid."""
    dimensions, walls = WALLS[name]
    n_y, n_z = shear_centre_offset(walls)
    words = ",".join(f"{d / 100:g}" for d in dimensions)
    beam = ORIENTED.replace("CBAR", "CBEAM")
    body, deck = body_of(tmp_path, GRIDS + f"{beam}\nPBEAML,1,1,,{name}\n,{words}\n" + MATERIAL)
    F = tip_flexibility(body)
    # the couple about z and y that turns the tip as the axial force does: M_z = n_y N, M_y = -n_z N
    arm = np.linalg.solve(F[np.ix_([5, 4], [5, 4])], F[[5, 4], 0])
    size = max(dimensions)
    assert_allclose(np.array([arm[0], -arm[1]]) * 100, [n_y, n_z], rtol=0, atol=0.01 * size)
    assert deck.lines[0].shape["shape"] == "general"
