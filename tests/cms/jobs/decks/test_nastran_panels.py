"""Shear panels of Nastran beside the stress field of Garvey's panel in space, integrated by this file."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.cms.jobs.decks.nastran_bodies import added_matrices, axes_of, body_of

E, NU, T, RHO, NSM = 7e10, 0.33, 0.004, 2700.0, 1.5
G = E / 2 / (1 + NU)
WTMASS = 0.5
TURN = np.linalg.qr(np.array([[1.0, 0.4, 0.2], [-0.2, 1.0, 0.5], [0.3, -0.6, 1.0]]))[0]
TURN = TURN * np.sign(np.linalg.det(TURN))
SHAPES = {
    "rectangle": [(0, 0), (1.3, 0), (1.3, 0.7), (0, 0.7)],
    "parallelogram": [(0, 0), (1.3, 0.2), (1.8, 0.9), (0.5, 0.7)],
    "edges 12 and 34 parallel": [(0, 0), (1.5, 0), (1.2, 0.8), (0.3, 0.8)],
    "edges 23 and 41 parallel": [(0, 0), (1.2, 0.3), (1.2, 1.0), (0, 1.4)],
    "no parallel edges": [(0, 0), (1.4, -0.2), (1.7, 1.3), (0.2, 0.8)],
    "nearly parallel edges": [(0, 0), (1.0, 0.0), (1.04, 0.9), (0.03, 0.87)],
}


def corners_of(name, size, warp=0.0):
    lift = size * warp * np.array([1, -1, 1, -1])
    flat = [TURN @ [*(size * np.array(p, dtype=float)), z] for p, z in zip(SHAPES[name], lift, strict=True)]
    return np.array(flat) + size * np.array([4.0, -2.0, 3.0])


def deck(corners, young, size):
    """Return a frame around four corners, without mass, and the cards of grids and materials."""
    lines = [f"GRID,{n},,{','.join(repr(float(v)) for v in x)}" for n, x in enumerate(corners, start=1)]
    v = ",".join(map(str, TURN[:, 2]))
    lines += [f"CBAR,{n},1,{n},{n % 4 + 1},{v}" for n in range(1, 5)]
    lines += [f"PBAR,1,2,{1e-5 * size**2!r},{1e-9 * size**4!r},{1e-9 * size**4!r},{2e-9 * size**4!r}"]
    lines += [f"MAT1,1,{young!r},,{NU},{RHO}", f"MAT1,2,{young!r},,{NU}", "PARAM,COUPMASS,1", "CONM2,90,1,,.001"]
    lines += [f"PARAM,WTMASS,{WTMASS}"]
    return "\n".join(lines) + "\n"


def meeting(a, b, c, d):
    """Return where the lines a b and c d meet; None if they are parallel."""
    A = np.column_stack([b - a, c - d])
    if abs(np.linalg.det(A)) < 1e-9 * np.prod(np.linalg.norm(A, axis=0)):
        return None
    return a + np.linalg.solve(A, c - a)[0] * (b - a)


def stress_field(P):
    """Return the flow times unit length of Garvey's state at points, (n, 2, 2), as a function of the points, (n, 2).

    Principal lines run to the points R and S where opposite edges meet. The flow sym((R - x) ⊗ (S - x))/d³, with d the
    distance from the line R S, is free of divergence. For a point at infinity its direction stands for R - x, and d is
    the distance from the line through the other point along it; if both are at infinity, d is constant.
    """
    R, S = meeting(P[0], P[1], P[3], P[2]), meeting(P[0], P[3], P[1], P[2])

    def flow(x):
        to_R = R - x if R is not None else np.tile(P[1] - P[0], (len(x), 1))
        to_S = S - x if S is not None else np.tile(P[3] - P[0], (len(x), 1))
        if R is None and S is None:
            d = np.ones(len(x))
        else:
            origin = R if R is not None else S
            line = S - R if R is not None and S is not None else P[3] - P[0] if S is None else P[1] - P[0]
            d = np.abs((x - origin) @ [-line[1], line[0]]) / np.linalg.norm(line)
        both = to_R[:, :, None] * to_S[:, None, :]
        return (both + both.transpose(0, 2, 1)) / d[:, None, None] ** 3

    return flow


def triangle_points(a, b, c, n=24):
    """Return points and weights on a triangle, from Gauss points on a square with one side drawn to a point."""
    x, w = np.polynomial.legendre.leggauss(n)
    r, s = np.meshgrid((x + 1) / 2, (x + 1) / 2, indexing="ij")
    points = a + r[..., None] * ((b - a) + s[..., None] * (c - b))
    area = abs(np.linalg.det([b - a, c - b]))
    return points.reshape(-1, 2), (np.outer(w, w) / 4 * r * area).ravel()


def expected_panel(corners, thickness, young):
    """Return f fᵀ/(2 U), (12, 12), with half of the force of an edge at each end and the energy of plane stress."""
    n = np.cross(corners[2] - corners[0], corners[3] - corners[1])
    axes = axes_of(n, corners[1] - corners[0])[1:]
    P = (corners - corners[0]) @ axes.T
    flow = stress_field(P)
    f = np.zeros((4, 2))
    x, w = np.polynomial.legendre.leggauss(24)
    for k in range(4):
        a, b = P[k], P[(k + 1) % 4]
        outward = np.array([b[1] - a[1], a[0] - b[0]])
        traction = flow(a + (x[:, None] + 1) / 2 * (b - a)) @ outward
        assert np.abs(traction @ outward).max() < 1e-12 * np.abs(traction).max() * np.linalg.norm(outward)
        force = w @ traction / 2
        f[k] += force / 2
        f[(k + 1) % 4] += force / 2
    energy = 0.0
    for triangle in ((0, 1, 2), (0, 2, 3)):
        points, weights = triangle_points(*P[list(triangle)])
        N = flow(points)
        squares, trace = np.sum(N**2, axis=(1, 2)), N[:, 0, 0] + N[:, 1, 1]
        energy += weights @ ((1 + NU) * squares - NU * trace**2) / (2 * young * thickness)
    force = (f @ axes).ravel()
    return np.outer(force, force) / (2 * energy)


def rods(corners, areas, young):
    K = np.zeros((12, 12))
    for k in range(4):
        j = (k + 1) % 4
        e = corners[j] - corners[k]
        L = np.linalg.norm(e)
        b = np.zeros(12)
        b[3 * k : 3 * k + 3], b[3 * j : 3 * j + 3] = -e / L, e / L
        K += young * areas[k] / L * np.outer(b, b)
    return K


def added(tmp_path, corners, cards, young=E, size=1.0):
    """Return what a panel adds to K and M by the translations of its corners, (12, 12); nothing to the rotations."""
    K, M = added_matrices(tmp_path, deck(corners, young, size), cards, corners)
    moves = [6 * k + c for k in range(4) for c in range(3)]
    turns = [6 * k + c for k in range(4) for c in range(3, 6)]
    for matrix in (K, M):
        assert np.abs(matrix[turns]).max() <= 1e-9 * np.abs(matrix).max()
    return K[np.ix_(moves, moves)], M[np.ix_(moves, moves)]


def assert_same(found, wanted, rtol=1e-8):
    assert_allclose(found, wanted, rtol=0, atol=rtol * np.abs(wanted).max())


@pytest.mark.parametrize(("size", "young"), [(1.0, E), (0.02, E * 1e-3)])
@pytest.mark.parametrize("name", SHAPES)
def test_a_panel_resists_its_shear_flow_alone(tmp_path, name, size, young):
    corners, t = corners_of(name, size), T * size
    K, _ = added(tmp_path, corners, f"CSHEAR,9,9,1,2,3,4\nPSHEAR,9,1,{t!r}\n", young, size)
    assert_same(K, expected_panel(corners, t, young))


def test_a_rectangular_panel_has_the_flow_of_the_textbook(tmp_path):
    """A rectangle a by b sheared by gamma has U = G t gamma² a b/2; no other motion of the corners has any."""
    corners = np.array([(0, 0, 0), (1.3, 0, 0), (1.3, 0.7, 0), (0, 0.7, 0)], dtype=float)
    K, _ = added(tmp_path, corners, f"CSHEAR,9,9,1,2,3,4\nPSHEAR,9,1,{T}\n")
    for gradient, energy in ((np.eye(3)[[1, 0, 2]] * [1, 1, 0], 4 * G * T * 1.3 * 0.7 / 2), (np.diag([1, -0.4, 0]), 0)):
        u = (corners @ gradient.T).ravel()
        assert_allclose(u @ K @ u / 2, energy, rtol=1e-9, atol=1e-12 * G * T)


@pytest.mark.parametrize("name", ["rectangle", "no parallel edges"])
def test_a_warped_panel_is_that_of_its_mean_plane_and_moves_rigidly(tmp_path, name):
    corners = corners_of(name, 1.0, warp=0.06)
    K, _ = added(tmp_path, corners, f"CSHEAR,9,9,1,2,3,4\nPSHEAR,9,1,{T}\n")
    assert_same(K, expected_panel(corners, T, E))
    for axis in np.eye(3):
        assert np.abs(K @ np.cross(axis, corners).ravel()).max() < 1e-9 * np.abs(K).max()


@pytest.mark.parametrize(("F1", "F2"), [(0.6, 1.0), (0.0, 1.01), (30.0, 1.02)])
def test_effectiveness_makes_rods_along_the_edges(tmp_path, F1, F2):
    """F T S/(L + L') up to 1.01, F T²/2 above."""
    corners = corners_of("no parallel edges", 1.0)
    K, _ = added(tmp_path, corners, f"CSHEAR,9,9,1,2,3,4\nPSHEAR,9,1,{T},,{F1},{F2}\n")
    lengths = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    S = np.linalg.norm(np.cross(corners[2] - corners[0], corners[3] - corners[1])) / 2
    areas = [
        F * T * S / (lengths[k] + lengths[(k + 2) % 4]) if F <= 1.01 else F * T**2 / 2
        for k, F in enumerate((F1, F2, F1, F2))
    ]
    assert_same(K, expected_panel(corners, T, E) + rods(corners, areas, E))


@pytest.mark.parametrize("name", ["parallelogram", "no parallel edges"])
def test_the_mass_of_a_panel_lies_at_its_corners_and_keeps_its_centre(tmp_path, name):
    """Total (rho T + NSM) S, and the centroid of the area, by its two triangles."""
    corners = corners_of(name, 1.0)
    _, M = added(tmp_path, corners, f"CSHEAR,9,9,1,2,3,4\nPSHEAR,9,1,{T},{NSM}\n")
    triangles = [corners[list(k)] for k in ((0, 1, 2), (0, 2, 3))]
    areas = [np.linalg.norm(np.cross(t[1] - t[0], t[2] - t[0])) / 2 for t in triangles]
    m = np.diag(M).reshape(4, 3)
    assert_allclose(M, np.diag(np.diag(M)), rtol=0, atol=1e-12 * m.max())
    assert_allclose(m, np.repeat(m[:, :1], 3, axis=1), rtol=1e-9)
    assert_allclose(m[:, 0].sum(), WTMASS * (RHO * T + NSM) * sum(areas), rtol=1e-9)
    centre = sum(a * t.mean(axis=0) for a, t in zip(areas, triangles, strict=True)) / sum(areas)
    assert_allclose(m[:, 0] @ corners / m[:, 0].sum(), centre, rtol=1e-9)


@pytest.mark.parametrize(
    ("cards", "why"),
    [
        ("CSHEAR,9,8,1,2,3,4", "names PSHEAR 8, which is not defined"),
        ("CSHEAR,9,9,1,3,2,4", "its corners make no convex quadrilateral"),
        ("CSHEAR,9,7,1,2,3,4\nPSHEAR,7,1,0.", "T must be above zero"),
        ("CSHEAR,9,7,1,2,3,4\nPSHEAR,7,1,.1,,-1.", "F1 and F2 must not be below zero"),
        ("CSHEAR,9,7,1,2,3,4\nPSHEAR,7,8,.1\nMAT8,8,1.+9,1.+9,.3,1.+9", "material 8 is not known here, or not iso"),
        ("CSHEAR,9,9,1,2,3,4\nMDLPRM,SHEARP,HARDER", "MDLPRM, SHEARP, HARDER: only Garvey's panel"),
    ],
)
def test_panels_that_cannot_be_taken_are_refused(tmp_path, cards, why):
    with pytest.raises(ValueError, match=why):
        body_of(tmp_path, deck(corners_of("rectangle", 1.0), E, 1.0) + f"{cards}\nPSHEAR,9,1,.1\n")


def test_a_stringer_box_of_panels_and_rods_is_a_body(tmp_path):
    """Points of panels and rods alone have no stiffness in rotation; a closed box twists by Bredt's theory.

    Bulkheads at both ends, no warping restraint: T = 4 A² G t theta'/s, within the field of constant flow exactly.
    """
    a, b, length = 0.4, 0.3, 1.2
    grids = [(x, y, z) for x in (0.0, length) for y, z in ((0, 0), (a, 0), (a, b), (0, b))]
    text = "".join(f"GRID,{n},,{x!r},{float(y)!r},{float(z)!r}\n" for n, (x, y, z) in enumerate(grids, start=1))
    walls = [(1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8), (1, 2, 3, 4), (5, 6, 7, 8)]
    text += "".join(f"CSHEAR,{n},9,{','.join(map(str, w))}\n" for n, w in enumerate(walls, start=1))
    edges = {tuple(sorted((w[k], w[k - 1]))) for w in walls for k in range(4)}
    text += "".join(f"CONROD,{100 + n},{i},{j},1,1.-3\n" for n, (i, j) in enumerate(sorted(edges)))
    text += f"PSHEAR,9,1,{T}\nMAT1,1,{E!r},,{NU},{RHO}\n"
    body, _ = body_of(tmp_path, text, is_coupled=True)
    at = {(int(n), int(c)): k for k, (n, c) in enumerate(body.dofs)}
    moves = [at[n, c] for n in range(8) for c in range(3)]
    K = body.K.toarray()
    rest = np.setdiff1d(np.arange(len(K)), moves)
    K = (
        K[np.ix_(moves, moves)]
        - K[np.ix_(moves, rest)] @ np.linalg.pinv(K[np.ix_(rest, rest)]) @ K[np.ix_(rest, moves)]
    )
    force = np.zeros((8, 3))
    q = 1.0 / (2 * a * b)  # flow of a unit torque
    for first, sign in ((0, -1), (4, 1)):
        for k in range(4):
            i, j = first + k, first + (k + 1) % 4
            e = np.subtract(grids[j], grids[i])
            force[[i, j]] += sign * q * e / 2
    u = np.linalg.pinv(K) @ force.ravel()
    flexibility = length * 2 * (a + b) / (4 * (a * b) ** 2 * G * T)
    assert_allclose(force.ravel() @ u, flexibility, rtol=1e-9)


def test_corners_of_a_massless_panel_alone_take_supports_loads_and_equations(tmp_path):
    """Two corners of no other element: the deck must not take them for points that nothing uses."""
    corners = corners_of("rectangle", 1.0)
    text = "\n".join(
        line for line in deck(corners, E, 1.0).split("\n") if not line.startswith(("CBAR,2", "CBAR,3", "CBAR,4"))
    )
    cards = "CSHEAR,9,9,1,2,3,4\nPSHEAR,9,2,.1\nMPC,1,3,1,1.,4,1,-1.\nSPC1,1,3,3\nFORCE,1,4,,1.,1.,0.,0.\n"
    _, made = body_of(tmp_path, text + cards)
    assert [term[:2] for equation in made.equations for term in equation.terms][-2:] == [("node_3", 0), ("node_4", 0)]
    assert [support.nodes for support in made.supports] == ["node_3"]
    assert [dict(load.forces) for load in made.loads] == [{"node_4": (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)}]
