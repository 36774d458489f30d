"""Curved beams of Nastran beside the energy of Winkler's theory with forces at the centroid."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.cms.jobs.decks.nastran_bodies import (
    added_matrices,
    along_arc,
    arc_directions,
    arc_flexibility,
    arm,
    body_of,
)

E, NU, RHO = 2.1e11, 0.28, 7800.0
G = E / 2 / (1 + NU)
A, I1, I2, J, K1, K2, NSM = 6e-3, 8e-6, 3e-6, 5e-6, 0.8, 0.7, 3.0
WTMASS = 0.5
TURN = np.linalg.qr(np.array([[1.0, 0.4, 0.2], [-0.2, 1.0, 0.5], [0.3, -0.6, 1.0]]))[0]
TURN = TURN * np.sign(np.linalg.det(TURN))
CENTER = np.array([3.0, -5.0, 2.0])


def frame_at(phi):
    return arc_directions(phi, TURN)


def section(size=1.0, young=E):
    """Return A, I1, I2, J, shear areas, E and G of a section."""
    return A * size**2, I1 * size**4, I2 * size**4, J * size**4, K1 * A * size**2, K2 * A * size**2, young


def end_flexibility(R, angle, values):
    return arc_flexibility(R, angle, TURN, values, NU)


def expected(R, angle, grids, ends, values):
    """Return K at both grid points, (12, 12): of the arc between its centroids, with rigid arms."""
    K_end = np.linalg.inv(end_flexibility(R, angle, values))
    B = np.hstack([-arm(ends[1] - ends[0]), np.eye(6)])
    arms = np.zeros((12, 12))
    arms[:6, :6], arms[6:, 6:] = (arm(x - g) for x, g in zip(ends, grids, strict=True))
    return arms.T @ B.T @ K_end @ B @ arms


def case(radius, angle, RC=0.0, ZC=0.0):
    """Return both grid points, both centroids, and the directions of the vectors for each GEOM."""
    grids = [CENTER + radius * frame_at(phi)[0] for phi in (0, angle)]
    ends = [CENTER + (radius + RC) * frame_at(phi)[0] + ZC * frame_at(phi)[2] for phi in (0, angle)]
    outward = frame_at(angle / 2)[0]
    vectors = {
        1: 0.7 * (CENTER - grids[0]),
        2: 1.3 * frame_at(0)[1],
        3: 0.4 * outward + 0.3 * (grids[1] - grids[0]),
        4: 0.4 * outward - 0.2 * (grids[1] - grids[0]),
    }
    return grids, ends, vectors


def words(x):
    return ",".join(repr(float(v)) for v in x)


def deck(grids, young=E, size=1.0, cd=""):
    """Return two grid points that a light bar joins, without mass but a point."""
    lines = [f"GRID,{n},,{words(x)},{cd if n == 1 else ''}" for n, x in enumerate(grids, start=1)]
    lines += ["CORD2R,7,,0.,0.,0.,.3,.2,1.\n,1.,.1,.4", f"CBAR,1,1,1,2,{words(TURN[:, 2])},BGG"]
    lines += [f"PBAR,1,2,{1e-5 * size**2!r},{1e-9 * size**4!r},{1e-9 * size**4!r},{2e-9 * size**4!r}"]
    lines += [f"MAT1,1,{young!r},,{NU},{RHO}", f"MAT1,2,{young!r},,{NU}", "PARAM,COUPMASS,1", "CONM2,90,1,,.001"]
    lines += [f"PARAM,WTMASS,{WTMASS}"]
    return "\n".join(lines) + "\n"


def assert_same(found, wanted, rtol=1e-8):
    assert_allclose(found, wanted, rtol=0, atol=rtol * np.abs(wanted).max())


def property_of(RB="", THETAB="", RC=0.0, ZC=0.0, size=1.0, nsm="", DELTAN="", values=(A, I1, I2, J), shear=(K1, K2)):
    a, i1, i2, j = (value * size**power for value, power in zip(values, (2, 4, 4, 4), strict=True))
    first = f"PBEND,9,1,{a!r},{i1!r},{i2!r},{j!r},{RB},{THETAB}\n,,,,,,,,\n"
    return f"{first},{shear[0]},{shear[1]},{nsm},{RC!r},{ZC!r},{DELTAN}\n"


@pytest.mark.parametrize(("size", "young"), [(1.0, E), (0.02, E * 1e-3)])
@pytest.mark.parametrize(
    ("geom", "degrees"), [(1, 35), (1, 150), (2, 90), (2, 230), (3, 10), (3, 120), (4, 75), (4, 179)]
)
def test_an_arc_has_the_flexibility_of_winklers_theory(tmp_path, geom, degrees, size, young):
    angle, R, RC, ZC = np.deg2rad(degrees), 0.8 * size, 0.05 * size, -0.03 * size
    grids, ends, vectors = case(R - RC, angle, RC, ZC)
    data = {3: {"RB": repr(R)}, 4: {"THETAB": repr(float(degrees))}}.get(geom, {})
    cards = f"CBEND,5,9,1,2,{words(vectors[geom])},{geom}\n" + property_of(**data, RC=RC, ZC=ZC, size=size)
    K, _ = added_matrices(tmp_path, deck(grids, young, size), cards, grids)
    wanted = expected(R, angle, grids, ends, section(size, young))
    scale = np.tile([1, 1, 1, 1 / size, 1 / size, 1 / size], 2)
    assert_same(K * np.outer(scale, scale), wanted * np.outer(scale, scale))


def test_a_quarter_ring_moves_by_the_closed_forms_of_castigliano(tmp_path):
    """Thin and without shear; held at GA. Tip forces F: inward pi F R³/(4 E I), F R³/(2 E I) along, across the plane
    F R³ (pi/(4 E I2) + (3 pi/4 - 2)/(G J)); a couple M turns the tip by M R pi/(2 E I1).
    """
    R, thin = 2.0, (1e-2, 4e-10, 3e-10, 5e-10)
    grids, _, vectors = case(R, np.pi / 2)
    cards = f"CBEND,5,9,1,2,{words(vectors[1])},1\n" + property_of(values=thin, shear=("", ""))
    K, _ = added_matrices(tmp_path, deck(grids, size=1e-3), cards, grids)
    r, t, z = frame_at(np.pi / 2)
    T = np.kron(np.eye(2), np.array([r, t, z]))
    C = T @ np.linalg.inv(K[6:, 6:]) @ T.T
    _, i1, i2, j = thin
    assert_allclose(C[0, 0], np.pi * R**3 / (4 * E * i1), rtol=1e-5)
    assert_allclose(C[1, 1], (3 * np.pi / 4 - 2) * R**3 / (E * i1), rtol=1e-5)
    assert_allclose(abs(C[0, 1]), R**3 / (2 * E * i1), rtol=1e-5)
    assert_allclose(C[2, 2], R**3 * (np.pi / (4 * E * i2) + (3 * np.pi / 4 - 2) / (G * j)), rtol=1e-6)
    assert_allclose(C[5, 5], np.pi * R / (2 * E * i1), rtol=1e-6)


def test_the_vector_may_be_a_grid_point_or_along_displacement_axes(tmp_path):
    grids, ends, vectors = case(0.8, 1.1)
    wanted = expected(0.8, 1.1, grids, ends, section())
    point = f"GRID,50,,{words(grids[0] + vectors[3])}\nCBEND,5,9,1,2,50,,,3\n"
    K, _ = added_matrices(tmp_path / "a", deck(grids), point + property_of(RB="0.8"), grids)
    assert_same(K, wanted)
    z = np.array([0.3, 0.2, 1.0]) / np.linalg.norm([0.3, 0.2, 1.0])
    x = np.array([1.0, 0.1, 0.4]) - z * (z @ [1.0, 0.1, 0.4])
    axes = np.array([x / np.linalg.norm(x), np.cross(z, x / np.linalg.norm(x)), z])
    turned = f"CBEND,5,9,1,2,{words(axes @ vectors[2])},2\n"
    K, _ = added_matrices(tmp_path / "b", deck(grids, cd="7"), turned + property_of(), grids)
    assert_same(K, wanted)


@pytest.mark.parametrize(("RM", "T"), [(0.05, 0.008), (0.04, 0.08), (0.05, 0.0)])
def test_a_bend_of_a_pipe_has_its_ring_as_section(tmp_path, RM, T):
    """FSI = 1: no flattening. Hollow, hollow with no hole left, and solid where T is blank; shear by Cowper.

    The neutral axis lies at A/∫ dA/r. The energy then is M_n² R/(2 E I) + N² R_n/(2 E A) about this axis.
    """
    R, angle = 0.9, 1.2
    grids, ends, vectors = case(R, angle)
    cards = f"CBEND,5,9,1,2,{words(vectors[1])},1\nPBEND,9,1,1,{RM},{T or ''}\n"
    K, _ = added_matrices(tmp_path, deck(grids), cards, grids)
    outer, inner = (RM + T / 2, RM - T / 2) if T else (RM, 0.0)
    a, inertia, m = np.pi * (outer**2 - inner**2), np.pi / 4 * (outer**4 - inner**4), inner / outer
    kappa = 6 * (1 + NU) * (1 + m**2) ** 2 / ((7 + 6 * NU) * (1 + m**2) ** 2 + (20 + 12 * NU) * m**2)
    sines, weights = np.polynomial.legendre.leggauss(200)
    sines, weights = np.sin(np.pi / 2 * sines), np.pi / 2 * weights * np.cos(np.pi / 2 * sines) ** 2
    by_radius = [2 * rho**2 * weights @ (1 / (R + rho * sines)) for rho in (outer, inner)]  # ∫ dA/r of discs, by strips
    R_n = a / (by_radius[0] - by_radius[1])
    offset = R - R_n
    values = (a, inertia, inertia, 2 * inertia, kappa * a, kappa * a, E)
    C = end_flexibility(R, angle, values)
    e = inertia / (a * R)
    end = R * frame_at(angle)[0]

    def correction(phi):
        r, t, z = frame_at(phi)
        N = np.concatenate([t, np.zeros(3)])
        M = [np.concatenate([np.cross(z, end - (R - h) * r), z]) for h in (offset, e)]
        bend = (np.outer(M[0], M[0]) - np.outer(M[1], M[1])) * R / (E * inertia)
        return bend + np.outer(N, N) * (e - offset) / (E * a)

    K_end = np.linalg.inv(C + along_arc(correction, angle))
    B = np.hstack([-arm(ends[1] - ends[0]), np.eye(6)])
    assert_same(K, B.T @ K_end @ B, 1e-6)


@pytest.mark.parametrize("degrees", [20, 160])
def test_each_half_of_an_arc_is_a_rigid_piece_of_its_end(tmp_path, degrees):
    angle, R, RC, ZC = np.deg2rad(degrees), 0.8, 0.05, -0.03
    grids, _, vectors = case(R - RC, angle, RC, ZC)
    cards = f"CBEND,5,9,1,2,{words(vectors[1])},1\n" + property_of(RC=RC, ZC=ZC, nsm=NSM)
    _, M = added_matrices(tmp_path, deck(grids), cards, grids)
    x, w = np.polynomial.legendre.leggauss(30)
    wanted = np.zeros((12, 12))
    for k, first in enumerate((0.0, angle / 2)):
        for phi, weight in zip(first + (x + 1) * angle / 4, w * angle / 4, strict=True):
            r, _, z = frame_at(phi)
            move = arm(CENTER + R * r + ZC * z - grids[k])[:3]
            at = slice(6 * k, 6 * k + 6)
            wanted[at, at] += WTMASS * (RHO * A + NSM) * R * weight * move.T @ move
    assert_same(M, wanted)


def test_a_given_neutral_axis_that_is_the_default_is_taken(tmp_path):
    grids, ends, vectors = case(0.8, 1.1)
    cards = f"CBEND,5,9,1,2,{words(vectors[1])},1\n" + property_of(DELTAN=f"{I1 / A / 0.8:.5g}")
    K, _ = added_matrices(tmp_path, deck(grids), cards, grids)
    assert_same(K, expected(0.8, 1.1, grids, ends, section()))


@pytest.mark.parametrize(
    ("cards", "why"),
    [
        ("CBEND,5,8,1,2,V1,1", "names PBEND 8, which is not defined"),
        ("CBEND,5,9,1,1,V1,1", "has no length between its ends"),
        ("CBEND,5,9,1,2,D,3", "its vector is along the line of its ends, or missing"),
        ("CBEND,5,9,1,2,ACROSS,1", "GEOM = 1: its vector is across the line of its ends"),
        ("CBEND,5,9,1,2,V3,3", r"GEOM = 3: RB - RC = 0 is less than half"),
        ("CBEND,5,9,1,2,V4,4", r"GEOM = 4: expected THETAB between 0 and 180 degrees, got \(blank\)"),
        ("CBEND,5,9,1,2,V4", r"GEOM = \(blank\): expected 1, 2, 3 or 4"),
        (
            "CBEND,5,7,1,2,V4,4\nPBEND,7,1,1.,1.,1.,1.,,.01",
            "its arc has an angle of 0.01 degrees; expected 0.06 to 350",
        ),
        ("CBEND,5,7,1,2,V1,1\nPBEND,7,1,1.-3,1.-7,0.,1.-7", "A, I1, I2 and J must be above zero"),
        ("CBEND,5,7,1,2,V1,1\nPBEND,7,1,2,.1,.01", "FSI = 2: flexibility factors of pipes that flatten; only FSI = 1"),
        ("CBEND,5,7,1,2,V1,1\nPBEND,7,1,1,.1,.3", "expected 0 <= T/2 <= RM and RM"),
        ("CBEND,5,7,1,2,V1,1\nPBEND,7,8,1,.1,.01\nMAT8,8,1.+9,1.+9,.3,1.+9", "material 8 is not known here, or not"),
        ("CBEND,5,7,1,2,V1,1\nPBEND,7,1,1.-3,1.-7,1.-7,1.-7\n,,,,,,,,\n,,,,,,.02", r"DELTAN = 0.02: only its default"),
    ],
)
def test_arcs_that_cannot_be_taken_are_refused(tmp_path, cards, why):
    grids, _, vectors = case(0.8, 1.1)
    named = {f"V{k}": v for k, v in vectors.items()} | {"D": grids[1] - grids[0]}
    named["ACROSS"] = np.cross(named["D"], TURN[:, 2])
    for name, vector in named.items():
        cards = cards.replace(f"2,{name}", f"2,{words(vector)}").replace(f"1,{name}", f"1,{words(vector)}")
    with pytest.raises(ValueError, match=why):
        body_of(tmp_path, deck(grids) + cards + "\n" + property_of())
