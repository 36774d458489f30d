"""Cards of Nastran beside an assembler of this file: released and offset bars, sections, scalar elements, plates."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import eigh
from scipy.ndimage import label
from scipy.sparse import coo_array
from scipy.sparse.linalg import spsolve

import cms
from cms.reduction.basis.frames import frame_condition
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
    dofs_of,
    expected_bar,
    tip_flexibility,
)


@pytest.mark.parametrize(
    ("card", "expected"),
    [
        (f"{ORIENTED}\n", {}),
        (f"{ORIENTED}\n,,56\n", {"pins": (10, 11)}),
        (f"{ORIENTED}\n,45,6\n", {"pins": (3, 4, 11)}),
        (f"{ORIENTED}\n,,1\n", {"pins": (6,)}),
        (f"{ORIENTED}\n,,,.1,.2,-.1,.1,.2,-.1\n", {"w_a": (0.1, 0.2, -0.1), "w_b": (0.1, 0.2, -0.1)}),
        (f"{ORIENTED}\n,,,.1,.2,-.1,-.2,.1,.3\n", {"w_a": (0.1, 0.2, -0.1), "w_b": (-0.2, 0.1, 0.3)}),
        (f"{ORIENTED}\n,3,,.1,.2,-.1,.1,.2,-.1\n", {"w_a": (0.1, 0.2, -0.1), "w_b": (0.1, 0.2, -0.1), "pins": (2,)}),
        (f"{ORIENTED}\n,,56,,,,-.2,.1,.3\n", {"w_b": (-0.2, 0.1, 0.3), "pins": (10, 11)}),
    ],
)
def test_a_bar_with_released_ends_and_offsets(tmp_path, card, expected):
    body, _ = body_of(tmp_path, GRIDS + card + SECTION + MATERIAL)
    K = expected_bar(**expected)
    assert_allclose(condensed(body, (GA, GB)), K, rtol=0, atol=1e-9 * abs(K).max())


@pytest.mark.parametrize(
    ("card", "property_", "pins"),
    [
        (ORIENTED, "PBAR,1,1,2.-3,3.-6,1.-6\n", (9,)),
        (f"{ORIENTED}\n,,5", "PBAR,1,1,2.-3,3.-6,1.-6,0.\n", (9, 10)),
        (f"{ORIENTED}\n,4,1", "PBAR,1,1,2.-3,3.-6,1.-6\n", (3, 6)),
        (ORIENTED.replace("CBAR", "CBEAM"), "PBEAM,1,1,2.-3,3.-6,1.-6\n,,,,,,,,\n,0.,0.\n", (9,)),
    ],
)
def test_a_bar_without_torsion_constant_resists_no_torque(tmp_path, card, property_, pins):
    """J = 0, also with other released motions, and with a translation released at end B."""
    body, _ = body_of(tmp_path, f"{GRIDS}{card}\n{property_}{MATERIAL}")
    K = expected_bar(pins=pins)
    assert_allclose(condensed(body, (GA, GB)), K, rtol=0, atol=1e-9 * abs(K).max())


@pytest.mark.parametrize(("n_bars", "has_frame", "n_free"), [(1, False, 6), (2, False, 6), (3, False, 7), (3, True, 6)])
def test_bars_without_torsion_are_a_mechanism_only_where_nothing_holds_their_rotation(
    tmp_path, n_bars, has_frame, n_free
):
    """A row of three: the nodes between turn about the line without energy, unless a frame holds both."""
    text = "".join(f"GRID,{k},,{float(k)},0.,0.\nGRID,{10 + k},,{float(k)},1.,.2\n" for k in range(1, 5))
    text += "".join(f"CBAR,{k},1,{k},{k + 1},0.,0.,1.\n" for k in range(1, n_bars + 1))
    text += "CBAR,12,2,2,12,0.,0.,1.\nCBAR,13,2,3,13,0.,0.,1.\nCBAR,14,2,12,13,0.,0.,1.\n" if has_frame else ""
    body, _ = body_of(
        tmp_path, f"{text}PBAR,1,1,2.-3,3.-6,1.-6\n{SECTION.replace('PBAR,1,', 'PBAR,2,')}{MATERIAL}", is_coupled=True
    )
    values = np.linalg.eigvalsh(body.K.toarray())
    assert np.sum(values < 1e-9 * values[-1]) == n_free


def test_offsets_along_axes_of_the_element(tmp_path):
    """OFFT = GOO: W along x, y, z of the bar between its grid points."""
    R = axes_of(GB - GA, V)
    w_a, w_b = R.T @ [0.0, 0.2, -0.1], R.T @ [0.05, 0.2, 0.3]
    body, _ = body_of(tmp_path, f"{GRIDS}{ORIENTED},GOO\n,,,0.,.2,-.1,.05,.2,.3\n{SECTION}{MATERIAL}")
    K = expected_bar(w_a, w_b)
    assert_allclose(condensed(body, (GA, GB)), K, rtol=0, atol=1e-9 * abs(K).max())


@pytest.mark.parametrize("I12", [0.9e-6, -1.4e-6])
def test_a_product_of_inertia_turns_the_principal_axes(tmp_path, I12):
    """The tip of a cantilever: u_y, u_z = L³/(3 E) [[I2, -I12], [-I12, I1]]/(I1 I2 - I12²) F."""
    body, _ = body_of(tmp_path, GRIDS + f"{ORIENTED}\nPBAR,1,1,2.-3,3.-6,1.-6,2.-6\n,,,,,,,,\n,,,{I12!r}\n" + MATERIAL)
    R = axes_of(GB - GA, V)
    tip = np.linalg.inv(condensed(body, (GA, GB))[6:, 6:])[:3, :3]
    L = np.linalg.norm(GB - GA)
    flexibility = L**3 / (3 * E) * np.array([[I2, -I12], [-I12, I1]]) / (I1 * I2 - I12**2)
    assert_allclose((R @ tip @ R.T)[1:, 1:], flexibility, rtol=1e-9)


def polygon_moments(shape, n=400):
    """Return A, ∫ y², ∫ z², ∫ y z about the centroid of a shape given as a test of points (z, y), by a fine raster."""
    z_low, z_high, y_low, y_high, inside = shape
    ranges = ((z_low, z_high), (y_low, y_high))
    z, y = (np.linspace(low, high, n + 1)[:-1] + (high - low) / n / 2 for low, high in ranges)
    Z, Y = np.meshgrid(z, y)
    has = inside(Z, Y)
    cell = (z_high - z_low) * (y_high - y_low) / n**2
    area = has.sum() * cell
    y, z = Y[has] - Y[has].mean(), Z[has] - Z[has].mean()
    return area, (y**2).sum() * cell, (z**2).sum() * cell, (y * z).sum() * cell


def raster_torsion_constant(shape, n=160):
    """Return J of a shape, with its holes, by Prandtl's stress function on a raster of cells.

    Flux balances of each cell, and of each hole as one cell of its own: sum c (phi_i - phi_j) = 2 A_i with phi = 0
    outside; J = 2 ∫ phi dA, holes included.
    """
    z_low, z_high, y_low, y_high, inside = shape
    d_z, d_y = (z_high - z_low) / n, (y_high - y_low) / n
    z, y = z_low + d_z * (np.arange(n) + 0.5), y_low + d_y * (np.arange(n) + 0.5)
    has = np.pad(inside(*np.meshgrid(z, y)), 1)
    gaps, n_gaps = label(~has)
    number = gaps - 2  # -1 outside, then holes, then cells
    number[has] = n_gaps - 1 + np.arange(has.sum())
    size = n_gaps - 1 + has.sum()
    K = coo_array((size + 1, size + 1)).tocsr()
    for a, b, wall_a, wall_b, c in (
        (number[:, :-1], number[:, 1:], has[:, :-1], has[:, 1:], d_y / d_z),
        (number[:-1], number[1:], has[:-1], has[1:], d_z / d_y),
    ):
        faces = wall_a | wall_b
        a, b = a[faces], b[faces]
        k = np.where((wall_a & wall_b)[faces], c, 2 * c)  # half a cell to the edge of the shape
        rows, columns = np.concatenate([a, b, a, b]) + 1, np.concatenate([a, b, b, a]) + 1
        K += coo_array((np.concatenate([k, k, -k, -k]), (rows, columns)), shape=K.shape).tocsr()
    area = np.bincount(number.ravel() + 1, minlength=size + 1)[1:] * d_z * d_y
    return 4 * area @ spsolve(K[1:, 1:].tocsc(), area)


@pytest.mark.parametrize(
    ("shape", "exact"),
    [
        ((-1, 1, -1, 1, lambda z, y: abs(z) < 1), 0.140577 * 2**4),
        ((-1, 1, -1, 1, lambda z, y: np.hypot(z, y) < 1), np.pi / 2),
        ((-1, 1, -1, 1, lambda z, y: between(np.hypot(z, y), 0.6, 1)), np.pi / 2 * (1 - 0.6**4)),
    ],
)
def test_the_raster_knows_the_torsion_of_a_square_a_circle_and_a_tube(shape, exact):
    """Timoshenko and Goodier, Theory of Elasticity, torsion of a square: 0.1406 (2a)⁴."""
    assert_allclose(raster_torsion_constant(shape), exact, rtol=0.015)


def between(x, low, high):
    return (x > low) & (x < high)


SHAPES = {
    # I: height 10, bottom flange 8 x 1, top flange 6 x 2, web 1
    "I": ((10, 8, 6, 1, 1, 2), (-4, 4, 0, 10, lambda z, y: (y < 1) | ((y > 8) & (abs(z) < 3)) | (abs(z) < 0.5))),
    "I1": ((6, 2, 8, 10), (-4, 4, 0, 10, lambda z, y: (y < 1) | (y > 9) | (abs(z) < 1))),
    "CHAN": ((8, 10, 2, 1), (0, 8, 0, 10, lambda z, y: (z < 2) | (y < 1) | (y > 9))),
    "CHAN1": ((6, 2, 8, 10), (0, 8, 0, 10, lambda z, y: (z < 2) | (y < 1) | (y > 9))),
    "CHAN2": ((1, 2, 10, 8), (-4, 4, 0, 10, lambda z, y: (abs(z) > 3) | (y < 2))),
    "T": ((8, 10, 2, 1), (-4, 4, 0, 10, lambda z, y: (y > 8) | (abs(z) < 0.5))),
    "T2": ((8, 10, 2, 1), (-4, 4, 0, 10, lambda z, y: (y < 2) | (abs(z) < 0.5))),
    "T1": ((8, 10, 2, 1), (-10, 2, -4, 4, lambda z, y: (z > 0) | (abs(y) < 0.5))),
    "CROSS": ((6, 2, 10, 1), (-4, 4, -5, 5, lambda z, y: (abs(z) < 1) | (abs(y) < 0.5))),
    "H": ((6, 4, 10, 2), (-5, 5, -5, 5, lambda z, y: (abs(z) > 3) | (abs(y) < 1))),
    "BOX1": ((8, 10, 1, 2, 1, 2), (0, 8, 0, 10, lambda z, y: (y > 9) | (y < 2) | (z < 1) | (z > 6))),
    "HEXA": ((2, 10, 8), (-5, 5, -4, 4, lambda z, y: abs(z) < 5 - 2 * abs(y) / 4)),
    "HAT": (
        (6, 1, 8, 3),
        (-7, 7, 0, 6, lambda z, y: ((abs(z) < 4) & ((y > 5) | (abs(z) > 3))) | ((abs(z) > 4) & (y < 1))),
    ),
    "Z": ((3, 2, 8, 10), (-4, 4, 0, 10, lambda z, y: (abs(z) < 1) | ((y > 9) & (z < 0)) | ((y < 1) & (z > 0)))),
    "L": ((8, 10, 1, 2), (0, 8, 0, 10, lambda z, y: (z < 2) | (y < 1))),
    "HAT1": (
        (14, 7, 8, 1, 2),
        (-7, 7, 0, 7, lambda z, y: (y < 2) | ((abs(z) < 4) & ((y > 6) | (abs(z) > 3))) | ((abs(z) > 4) & (y < 3))),
    ),
    "DBOX": (
        (16, 10, 6, 1, 2, 3, 1, 2, 2, 1),
        (0, 16, 0, 10, lambda z, y: (z < 1) | between(z, 5, 7) | (z > 13) | ((z < 6) & ((y > 9) | (y < 2)))
         | ((z > 6) & ((y > 8) | (y < 1)))),
    ),
    "TUBE2": ((5, 1), (-5, 5, -5, 5, lambda z, y: between(np.hypot(z, y), 4, 5))),
}  # fmt: skip


@pytest.mark.parametrize("name", SHAPES)
def test_sections_of_the_library(tmp_path, name):
    """A, I1, I2 beside a raster of the shape that the guide draws; J roughly, as the walls of these shapes are thick.

    Junctions and thick walls add to the sum of rectangles and to Bredt's J: most for HAT1, with brims three thick.
    """
    dimensions, shape = SHAPES[name]
    words = [f"{d / 100:g}" for d in dimensions]
    lines = ",".join(words[:8]) + ("\n," + ",".join(words[8:]) if len(words) > 8 else "")
    body, deck = body_of(tmp_path, GRIDS + f"{ORIENTED}\nPBARL,1,1,,{name}\n,{lines}\n" + MATERIAL)
    sides = tuple(x / 100 for x in shape[:4])
    scaled = (*sides, lambda z, y: shape[4](100 * z, 100 * y))
    area, i1, i2, i12 = polygon_moments(scaled)
    det = i1 * i2 - i12**2
    F = tip_flexibility(body)
    L = np.linalg.norm(GB - GA)
    has_shear = name == "TUBE2"  # the tube of a job has its shear deformation
    assert_allclose(F[0, 0], L / E / area, rtol=0.02)
    bending = L**3 / 3 / E / det * np.array([[i2, -i12], [-i12, i1]])
    assert_allclose(F[1:3, 1:3], bending, rtol=0, atol=(0.06 if has_shear else 0.02) * bending.max())
    assert F[3, 3] > L / G / (i1 + i2) * 0.99  # J is at most the polar moment
    assert 0.65 < L / G / F[3, 3] / raster_torsion_constant(scaled) < 1.05
    up = (body.dofs[:, 1] == 2).astype(float)
    assert_allclose(up @ body.M @ up, RHO * area * L, rtol=0.02)
    assert has_shear or any("J as the sum of its rectangles" in row[2] for row in deck.ledger.rows())


THIN = {
    "BOX1": (
        (8, 10, 0.25, 0.5, 0.25, 0.5),
        (0, 8, 0, 10, lambda z, y: (y > 9.75) | (y < 0.5) | (z < 0.25) | (z > 7.5)),
    ),
    "HAT1": (
        (12, 7, 8, 0.25, 0.5),
        (-6, 6, 0, 7, lambda z, y: (y < 0.5) | ((abs(z) < 4) & ((y > 6.75) | (abs(z) > 3.75)))
         | ((abs(z) > 4) & (y < 0.75))),
    ),
    "DBOX": (
        (16, 10, 6, 0.25, 0.5, 0.75, 0.25, 0.5, 0.5, 0.25),
        (0, 16, 0, 10, lambda z, y: (z < 0.25) | between(z, 5.75, 6.25) | (z > 15.25)
         | ((z < 6) & ((y > 9.75) | (y < 0.5))) | ((z > 6) & ((y > 9.5) | (y < 0.25)))),
    ),
}  # fmt: skip


@pytest.mark.parametrize(("name", "rtol"), [("BOX1", 0.03), ("DBOX", 0.03), ("HAT1", 0.07)])
def test_closed_sections_of_thin_walls_have_the_torsion_of_their_cells(tmp_path, name, rtol):
    """Bredt's J errs by about the part of a wall in the width, 3 %; that of HAT1 leaves out its brims too."""
    dimensions, shape = THIN[name]
    words = [f"{d / 100:g}" for d in dimensions]
    lines = ",".join(words[:8]) + ("\n," + ",".join(words[8:]) if len(words) > 8 else "")
    body, _ = body_of(tmp_path, GRIDS + f"{ORIENTED}\nPBARL,1,1,,{name}\n,{lines}\n" + MATERIAL)
    J_deck = np.linalg.norm(GB - GA) / G / tip_flexibility(body)[3, 3]
    assert_allclose(J_deck * 100**4, raster_torsion_constant(shape, n=320), rtol=rtol)


def test_the_neutral_axis_of_a_beam_lies_off_the_line_of_its_ends(tmp_path):
    """PBEAM with N1 = .05, N2 = -.02: an axial force at the grid points, which are shear centres, bends the beam."""
    section = "PBEAM,1,1,2.-3,3.-6,1.-6,,2.-6\n,,,,,,,,\n,0.,0.,,,,,,\n,,,,,.05,-.02\n"
    text = f"{GRIDS}{ORIENTED.replace('CBAR', 'CBEAM')}\n{section}"
    body, _ = body_of(tmp_path, text + MATERIAL)
    F = tip_flexibility(body)
    L = np.linalg.norm(GB - GA)
    # force along x at the tip's node: moments -n × x at the centroid; u_x = L/EA + L n1²/(E I1) + L n2²/(E I2)
    assert_allclose(F[0, 0], L / E * (1 / A + 0.05**2 / I1 + 0.02**2 / I2), rtol=1e-8)
    assert_allclose(F[1, 1], L**3 / 3 / E / I1, rtol=1e-8)
    assert_allclose(F[3, 3], L / G / J, rtol=1e-8)  # torsion about the line of the ends
    assert abs(F[1, 3]) < 1e-9 * F[3, 3]


PAIR = """GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.
GRID,3,,{x},{y},0.
GRID,4,,2.,.5,.3
CBAR,1,1,1,2,0.,1.,0.
CBAR,2,1,3,4,0.,1.,0.
"""


def test_scalar_elements_add_between_the_same_components(tmp_path):
    text = PAIR.format(x="1.", y="0.") + SECTION + MATERIAL + "CORD2R,5,,0.,0.,0.,0.,0.,1.\n,1.,1.,0.\n"
    plain, _ = body_of(tmp_path, text)
    text += "CELAS1,11,5,2,1,3,1\nCELAS1,12,6,2,6,3,6\nPELAS,5,1.+6,,,6,2.+6\nCDAMP2,13,7.,2,2,3,2\n"
    body, _ = body_of(tmp_path, text)
    rng = np.random.default_rng(3)
    u = rng.normal(size=body.n_dof)
    index = {(node, c): np.flatnonzero((body.dofs == (node, c)).all(axis=1))[0] for node in (1, 2) for c in range(6)}
    d = {c: u[index[1, c]] - u[index[2, c]] for c in range(6)}
    assert_allclose(u @ (body.K - plain.K) @ u, 1e6 * d[0] ** 2 + 2e6 * d[5] ** 2, rtol=1e-9)
    assert_allclose(u @ body.D @ u, 7 * d[1] ** 2, rtol=1e-9)


def test_the_modulus_follows_from_shear_modulus_and_poissons_ratio(tmp_path):
    """E = 2 G (1 + NU): the same bars from G and NU as from E and NU."""
    text = PAIR.format(x="1.", y="0.") + "RBE2,9,2,123456,3\n" + SECTION
    given, _ = body_of(tmp_path, text + "MAT1,1,2.6+11,,.3,7800.\n")
    blank, _ = body_of(tmp_path, text + "MAT1,1,,1.+11,.3,7800.\n")
    assert_allclose(blank.K.toarray(), given.K.toarray(), rtol=1e-12, atol=1e-12 * abs(given.K).max())


def test_a_turned_section_with_an_offset_is_its_principal_one(tmp_path):
    """I12 turns the principal axes by a; the bar with these axes for orientation and the same offsets is the same."""
    a, I_1, I_2 = 0.35, 4e-6, 1e-6
    c, s = float(np.cos(a)), float(np.sin(a))
    I1, I2, I12 = c * c * I_1 + s * s * I_2, s * s * I_1 + c * c * I_2, c * s * (I_1 - I_2)
    bodies = []
    for moments, v in (((I1, I2, I12), (0.0, 1.0, 0.0)), ((I_1, I_2, 0.0), (0.0, c, s))):
        text = "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,4,,2.,.5,.3\n"
        text += "CBAR,2,1,2,4,0.,1.,0.\nPBAR,1,1,1.-3,2.-6,1.-6,3.-6\n"
        text += f"CBAR,1,2,1,2,{','.join(repr(x) for x in v)}\n,,,0.,.07,-.04,0.,.07,-.04\n"
        text += f"PBAR,2,1,1.-3,{moments[0]!r},{moments[1]!r},3.-6\n,,,,,,,,\n,,,{moments[2]!r}\n"
        bodies.append(body_of(tmp_path, text + "MAT1,1,7.+10,,.3,2700.\nPARAM,COUPMASS,1\n")[0])
    for name in ("K", "M"):
        turned, principal = (getattr(body, name).toarray() for body in bodies)
        assert_allclose(turned, principal, rtol=0, atol=1e-10 * np.abs(principal).max())


def test_a_chain_of_scalar_points_is_no_part_of_the_body(tmp_path):
    """Masses, springs and dampers between scalar points and the ground: the deck without them has the same matrices."""
    text = PAIR.format(x="1.", y="0.") + SECTION + MATERIAL
    chain = "SPOINT,901,902\nCELAS1,11,5,901,,902\nCELAS2,12,1.,901,0,902,0\nCELAS3,13,5,901,902\nCELAS4,14,2.,901\n"
    chain += "CDAMP1,21,5,901\nCDAMP2,22,1.,,,902\nCDAMP3,23,5,901,902\nCDAMP4,24,2.,,902\nPELAS,5,1.+6\nPDAMP,5,2.\n"
    chain += "CMASS1,31,5,901\nCMASS2,32,1.,902\nCMASS3,33,5,901,902\nCMASS4,34,2.,901\nPMASS,5,3.\n"
    plain, _ = body_of(tmp_path, text)
    body, deck = body_of(tmp_path, text + chain)
    deck.ledger.require_whole()
    for found, expected in ((body.K, plain.K), (body.M, plain.M)):
        assert_array_equal(found.toarray(), expected.toarray())
    assert body.D is None
    assert not deck.supports
    named = {name for name, count, why in deck.ledger.rows() if "between scalar points" in why and count == "1"}
    assert named == {f"{kind}{k}" for kind in ("CELAS", "CDAMP", "CMASS") for k in (1, 2, 3, 4)}


def test_springs_between_points_apart_along_their_direction_balance(tmp_path):
    """CELAS between points 1 m apart along its own direction, in axes that are turned in the plane."""
    text = PAIR.replace("1.,0.,0.", "1.,0.,0.,5").replace("{x},{y},0.", "1.8,.6,0.,5") + SECTION + MATERIAL
    text += "CORD2R,5,,0.,0.,0.,0.,0.,1.\n,4.,3.,0.\n"
    plain, _ = body_of(tmp_path, text)
    body, deck = body_of(tmp_path, text + "CELAS2,11,1.+6,2,1,3,1\n")
    deck.ledger.require_whole()
    u = np.random.default_rng(3).normal(size=body.n_dof)
    e = np.array([0.8, 0.6, 0.0])
    d = sum(sign * e[c] * u[(body.dofs == (node, c)).all(axis=1)] for node, sign in ((1, 1), (2, -1)) for c in range(3))
    assert_allclose(u @ (body.K - plain.K) @ u, 1e6 * d[0] ** 2, rtol=1e-9)


@pytest.mark.parametrize(
    ("x", "y", "card", "why"),
    [
        ("1.", "0.", "CELAS1,11,77,2,1,3,1", "names PELAS 77, which is not defined"),
        ("1.", "0.", "CELAS2,11,5.,2,1,3,2", "between different components"),
        ("1.", ".4", "CELAS2,11,5.,2,1,3,1", "apart across its direction"),
        ("1.", "0.", "CDAMP1,11,77,2,1,3,1", "names PDAMP 77, which is not defined"),
        ("1.", "0.", "CMASS2,11,5.,2,1", "another mass along each axis"),
        ("1.", "0.", "CMASS2,11,5.,2,1,3,1", "between two points"),
        ("1.", "0.", "CBUSH,11,77,2,3,,,,0", "names PBUSH 77, which is not defined"),
        ("1.", "0.", "SPOINT,901\nCELAS2,11,5.,2,1,901", "to a scalar point"),
        ("1.", "0.", "SPOINT,901\nCMASS2,11,5.,2,1,901", "at a scalar point"),
        ("1.", "0.", "SPOINT,901\nCELAS4,11,5.,2,901", "names grid point 2; expected scalar points"),
        ("1.", "0.", "SPOINT,901\nMPC,1,901,0,1.,2,1,1.", "of scalar points"),
    ],
)
def test_scalar_elements_that_do_not_balance_are_refused(tmp_path, x, y, card, why):
    with pytest.raises(ValueError, match=why):
        body_of(tmp_path, PAIR.format(x=x, y=y) + SECTION + MATERIAL + card)


def test_an_element_to_the_ground_becomes_an_interface_of_the_free_body(tmp_path):
    held = "CELAS2,11,5.+3,2,1\nCBUSH,12,5,3\nPBUSH,5,K,1.,1."
    body, deck = body_of(tmp_path, PAIR.format(x="1.", y=".4") + SECTION + MATERIAL + held)
    assert sum("to the ground" in row[2] for row in deck.ledger.rows()) == 2
    assert {support.components for support in deck.supports} == {(0,), (0, 1, 2, 3, 4, 5)}
    assert sorted(int(node) for interface in body.interfaces for node in interface.nodes) == [1, 2]
    assert np.sum(eigh(body.K.toarray(), eigvals_only=True) < 1e-3) == 12  # two free bars


@pytest.mark.parametrize(("card", "components"), [("CELAS2,11,5.+3,2,1,3,1", (0, 0)), ("CDAMP2,11,5.,2,1,3,2", (0, 1))])
def test_an_element_without_balance_that_is_left_out_leaves_interfaces_at_its_ends(tmp_path, card, components):
    """Points apart across its direction, or along two directions: the body is that of the deck without the card."""
    text = PAIR.format(x="1.", y=".4") + SECTION + MATERIAL
    body, deck = body_of(tmp_path, text + card + "\n", leave_out=(card.partition(",")[0],))
    expected, _ = body_of(tmp_path, text)
    assert_allclose(body.K.toarray(), expected.K.toarray(), rtol=1e-14)
    held = {
        (int(node), c)
        for support in deck.supports
        for node in deck.mesh.node_numbers[deck.mesh.node_sets[support.nodes]]
        for c in support.components
    }
    assert held == {(2, components[0]), (3, components[1])}


@pytest.mark.parametrize("at", ["3,1", "3,2", "4,1"])
def test_a_spring_to_a_component_that_is_held_acts_to_the_ground(tmp_path, at):
    """Apart across its direction or along another component: the deck has k u² / 2 of the free end alone."""
    text = PAIR.format(x="1.", y=".4") + SECTION + MATERIAL + "SPC1,9,12,3,4\n"
    body, deck = body_of(tmp_path, text + f"CELAS2,11,5.+3,2,1,{at}\n")
    expected, grounded = body_of(tmp_path, text + "CELAS2,11,5.+3,2,1\n")
    assert_allclose(body.K.toarray(), expected.K.toarray(), rtol=1e-14)
    assert deck.supports == grounded.supports
    (note,) = (row[2] for row in deck.ledger.rows() if row[0] == "CELAS2")
    assert f"ties ux of grid point 2 to the ground with 5000, at grid point {at[0]}, which is held there" in note
    body, deck = body_of(tmp_path, text + f"SPC1,9,1,2\nCELAS2,11,5.+3,2,1,{at}\n")
    assert any("between components that are held" in row[2] for row in deck.ledger.rows())


MPCS = "".join(f"MPC,7,3,{c},1.,2,{c},-1.\n" for c in (1, 2, 3)) + "MPC,8,3,1,1.,2,1,-1.\nMPCADD,9,7,8\n"


@pytest.mark.parametrize(
    ("control", "n_free"),
    [("METHOD=1", 12), ("MPC=7", 9), ("MPC=8", 11), ("SUBCASE 1\nMPC=8\nSUBCASE 2\nMPC=8", 11)],
)
def test_equations_of_the_set_that_the_case_control_selects(tmp_path, control, n_free):
    """Two free bars of twelve motions without energy; each equation takes one."""
    text = PAIR.format(x="1.", y="0.") + SECTION + MATERIAL + MPCS
    body, _ = body_of(tmp_path, text, head=f"SOL 103\nCEND\n{control}\nBEGIN BULK\n")
    values = eigh(body.K.toarray(), eigvals_only=True)
    assert int(np.sum(values < 1e-7 * values[-1])) == n_free


def test_subcases_with_different_equations_are_refused(tmp_path):
    text = PAIR.format(x="1.", y="0.") + SECTION + MATERIAL + MPCS
    for control in ("SUBCASE 1\nMPC=7\nSUBCASE 2\nMPC=8", "SUBCASE 1\nMPC=7\nSUBCASE 2\nLOAD=8"):
        with pytest.raises(ValueError, match="subcases select different sets"):
            body_of(tmp_path, text, head=f"SOL 103\nCEND\n{control}\nBEGIN BULK\n")


def test_parameters_of_the_case_control_count(tmp_path):
    text = GRIDS + f"{ORIENTED}\n" + SECTION + MATERIAL
    plain, _ = body_of(tmp_path, text)
    body, _ = body_of(tmp_path, text, head="SOL 103\nCEND\nPARAM,WTMASS,.5\nBEGIN BULK\n")
    assert_allclose(body.M.toarray(), 0.5 * plain.M.toarray(), rtol=1e-12, atol=1e-12)
    both, deck = body_of(tmp_path, text + "PARAM,WTMASS,3.\n", head="SOL 103\nCEND\nPARAM,WTMASS,.5\nBEGIN BULK\n")
    assert (both.M != body.M).nnz == 0  # the case control comes first
    assert "WTMASS = .5 of the case control counts, not 3. of the bulk data" in str(deck.ledger.rows())
    with pytest.raises(ValueError, match=r"WTMASS = 3\., but .* says 2\."):
        body_of(tmp_path, text + "PARAM,WTMASS,2.\nPARAM,WTMASS,3.\n")
    for line in ("K2GG = STIFF", "NSM = 5"):
        with pytest.raises(ValueError, match="it adds to the body"):
            body_of(tmp_path, text, head=f"SOL 103\nCEND\n{line}\nBEGIN BULK\n")


def test_wtmass_scales_every_mass(tmp_path):
    """Of materials, of lengths and areas, of rods, and those of points by CONM1, CONM2 and CMASS2."""
    text = (
        "GRID,1,,0.,0.,0.\nGRID,2,,1.,.2,.1\nGRID,3,,1.5,1.,.3\nGRID,4,,.4,1.2,.8\n"
        "CBAR,1,1,1,2,0.,0.,1.\nCBAR,2,1,2,3,0.,0.,1.\nCBAR,5,1,4,1,0.,0.,1.\nPBAR,1,1,2.-3,3.-6,1.-6,2.-6,1.7\n"
        "CROD,3,2,3,4\nPROD,2,1,1.-3,1.-6,,.9\n" + MATERIAL +
        "CONM2,10,2,,3.,.1,.2,-.1\n,.5,,.6,,,.7\nCMASS2,12,1.5,4,1\nCMASS2,13,1.5,4,2\nCMASS2,14,1.5,4,3\n"
        "CONM1,11,3,,2.,,2.,,\n,2.,,,,.4,,,\n,,.5,,,,,,.6\n"
    )  # fmt: skip
    plain, _ = body_of(tmp_path, text)
    scaled, _ = body_of(tmp_path, "PARAM,WTMASS,.25\n" + text)
    M = plain.M.toarray()
    x = (plain.dofs[:, 1] == 0).astype(float)
    lengths = [np.linalg.norm(each) for each in ([1, 0.2, 0.1], [0.5, 0.8, 0.2], [0.4, 1.2, 0.8], [1.1, -0.2, -0.5])]
    line = 7800 * 2e-3 + 1.7
    expected = line * sum(lengths[:3]) + (7800 * 1e-3 + 0.9) * lengths[3] + 3.0 + 1.5 + 2.0
    assert_allclose(x @ M @ x, expected, rtol=1e-9)
    assert_allclose(scaled.M.toarray(), 0.25 * M, rtol=0, atol=1e-12 * np.abs(M).max())
    assert_allclose(scaled.K.toarray(), plain.K.toarray(), rtol=1e-12, atol=0)


def test_structural_damping_is_named(tmp_path):
    text = GRIDS + f"{ORIENTED}\n" + SECTION + "MAT1,1,2.+11,,.3,7800.,,,.05\nPARAM,G,.02\n"
    body, deck = body_of(tmp_path, text)
    rows = [row[2] for row in deck.ledger.rows()]
    assert body.D is None
    assert any("GE = .05 is left out" in row for row in rows)
    assert any("G = .02 is left out" in row for row in rows)


STRIP = "".join(f"GRID,{2 * k + j + 1},,{k / 8},{0.1 * j},0.\n" for k in range(9) for j in (0, 1))
STRIP += "".join(f"CQUAD4,{k + 1},1,{2 * k + 1},{2 * k + 3},{2 * k + 4},{2 * k + 2}\n" for k in range(8))
STRIP += "MAT1,2,1.+11,,0.,7800.\nMAT1,1,2.+11,,0.,7800.\nPARAM,COUPMASS,1\n"


@pytest.mark.parametrize(
    ("property_", "bending", "shear"),
    [
        ("PSHELL,1,1,.02,1,,1", 1.0, 1.0),
        ("PSHELL,1,1,.02,1,2.5,1", 2.5, 1.0),
        ("PSHELL,1,1,.02,2,2.5,1", 1.25, 1.0),
        ("PSHELL,1,1,.02,1,,1,.0001", 1.0, 1.2e-4),
        ("PSHELL,1,1,.02,1,,2,.001", 1.0, 0.6e-3),
    ],
)
def test_plates_with_ratios_of_bending_and_shear(tmp_path, property_, bending, shear):
    """The tip of a strip of nu = 0, 1 m long: F L³/(3 E I) + F L/(5/6 G A), membrane as it is."""
    body, _ = body_of(tmp_path, STRIP + property_)
    K = body.K.toarray()
    x = body.nodes[body.dofs[:, 0], 0]
    free = np.flatnonzero(x > 1e-9)
    tip = np.flatnonzero(x[free] > 0.999)
    component = body.dofs[free, 1]
    width, t = 0.1, 0.02
    for c, exact in (
        (2, 1 / (3 * E * bending * width * t**3 / 12) + 1 / (5 / 6 * shear * E / 2 * width * t)),
        (0, 1 / (E * width * t)),
    ):
        f = np.zeros(len(free))
        at = tip[component[tip] == c]
        f[at] = 1 / len(at)
        u = np.linalg.solve(K[np.ix_(free, free)], f)
        assert_allclose(u[at].mean(), exact, rtol=5e-3)


def test_replicated_cards_are_written_out(tmp_path):
    text = "GRID,1,,0.,0.,0.\n=,*(1),=,*(.2),*(.1),==\n=(3)\nCBAR,1,1,1,2,0.,1.,0.\n=,*1,=,*1,*1,==\n=2\n"
    body, deck = body_of(tmp_path, text + SECTION + MATERIAL)
    assert list(deck.mesh.node_numbers) == [1, 2, 3, 4, 5]
    assert_allclose(deck.mesh.nodes, np.outer(np.arange(5), [0.2, 0.1, 0]), atol=1e-15)
    up = (body.dofs[:, 1] == 2).astype(float)
    assert_allclose(up @ body.M @ up, RHO * A * 4 * np.hypot(0.2, 0.1), rtol=1e-12)


def test_a_deck_with_equations_of_several_arguments(tmp_path):
    """The text of DEQATN has commas; it is no free-field card."""
    text = GRIDS + f"{ORIENTED}\nDEQATN  301     Z(A,B,C,D,E,F,G,H,I,J)=SUM(A,B,C,D,E,F,G,H,I,J)\n+       ;Y=2\n"
    _, deck = body_of(tmp_path, text + SECTION + MATERIAL)
    assert ("DEQATN", "1", "belongs to the analysis, not to the body") in deck.ledger.rows()


def test_light_beams_between_point_masses_need_no_density(tmp_path):
    """Nastran takes RHO that is not given as zero; a deck without any mass asks for it."""
    text = GRIDS + f"{ORIENTED}\n" + SECTION + "MAT1,1,2.+11,,.3\n"
    with pytest.raises(ValueError, match="1 materials have no density"):
        body_of(tmp_path, text)
    body, deck = body_of(tmp_path, text + "CONM2,7,2,,3.\n")
    up = (body.dofs[:, 1] == 2).astype(float)
    assert_allclose(up @ body.M @ up, 3.0, rtol=1e-14)
    assert any(row[0] == "density" and "massless" in row[2] for row in deck.ledger.rows())


@pytest.mark.parametrize(("control", "names"), [("METHOD=1", {1, 2}), ("SPC=3", {1}), ("SPC=4", {2})])
def test_supports_make_interfaces_of_the_set_that_is_selected_or_of_all(tmp_path, control, names):
    text = GRIDS + f"{ORIENTED}\n" + SECTION + MATERIAL + "SPC1,3,123456,1\nSPC1,4,123456,2\n"
    _, deck = body_of(tmp_path, text, head=f"SOL 103\nCEND\n{control}\nBEGIN BULK\n")
    held = {int(number) for each in deck.supports for number in deck.mesh.node_numbers[deck.mesh.node_sets[each.nodes]]}
    assert held == names


def test_scalar_masses_that_differ_by_rounding_are_a_point_mass(tmp_path):
    """Three cards along each axis, summed in another order: 0.1 + 0.2 + 0.3 in general is not 0.3 + 0.2 + 0.1."""
    sums = [(0.1, 0.2, 0.3), (0.3, 0.2, 0.1), (0.2, 0.1, 0.3)]
    cards = "".join(
        f"CMASS2,{10 * c + k},{m},2,{c + 1}\n" for c, each in enumerate(sums) for k, m in enumerate(each, 10)
    )
    text = GRIDS + f"{ORIENTED}\n" + SECTION + MATERIAL
    plain, _ = body_of(tmp_path, text)
    body, _ = body_of(tmp_path, text + cards)
    added = (body.M - plain.M).toarray()
    assert_allclose(added[np.ix_(*[dofs_of(body, (GB,))] * 2)], np.diag([0.6] * 3 + [0.0] * 3), atol=1e-12)
    with pytest.raises(ValueError, match="another mass along each axis"):
        body_of(tmp_path, text + cards + "CMASS2,99,1.-6,2,1\n")


def test_scalar_masses_count_along_the_axes_that_the_deck_leaves_free(tmp_path):
    """CMASS along y and z of a point held along x, and along two axes in a planar deck; three are the same body."""
    text = GRIDS + f"{ORIENTED}\n" + SECTION + MATERIAL
    cards = [f"CMASS2,{c},2.5,2,{c}\n" for c in (1, 2, 3)]
    whole, _ = body_of(tmp_path, text + "".join(cards))
    partly, deck = body_of(tmp_path, text + "".join(cards[1:]) + "SPC1,1,1,2\n")
    assert_allclose(partly.M.toarray(), whole.M.toarray(), rtol=1e-13)
    assert any("along the axes that the deck leaves free: a point mass" in row[2] for row in deck.ledger.rows())
    planar = "GRID,1,,.1,.2,.3,,345\nGRID,2,,1.3,.9,.3,,345\nCBAR,1,1,1,2,0.,0.,1.\n" + SECTION + MATERIAL
    flat = [body_of(tmp_path, planar + "".join(chosen))[0].M.toarray() for chosen in (cards, cards[:2])]
    assert_allclose(flat[1], flat[0], rtol=1e-13)
    with pytest.raises(ValueError, match="another mass along each axis"):
        body_of(tmp_path, planar + cards[0])
    with pytest.raises(ValueError, match="another mass along each axis"):
        body_of(tmp_path, text + cards[1] + "SPC1,1,1,2\n")


def test_rubber_has_the_energy_of_its_law_at_small_strain(tmp_path):
    """The energy of a cube in small uniform strain is that of A10 (I1 - 3) + A01 (I2 - 3) + D1 (J - 1)²."""
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]) + 0.3
    text = "".join(f"GRID,{k},,{x},{y},{z}\n" for k, (x, y, z) in enumerate(corners.tolist(), start=1))
    text += "CHEXA,1,9,1,2,3,4,5,6\n,7,8\n"
    A10, A01, D1 = 1.3e6, 4e5, 6e6
    body, deck = body_of(tmp_path, text + f"PLSOLID,9,9\nMATHP,9,{A10},{A01},{D1},1000.\n")
    assert f"{29.2 / 78.8:.4g}" in str(deck.ledger.rows())  # (3 K - 2 G)/(6 K + 2 G)
    H = 1e-6 * np.random.default_rng(0).normal(size=(3, 3))
    F = np.longdouble(H) + np.eye(3)
    C = F.T @ F
    J = F[0] @ np.cross(F[1], F[2])
    I1, I2 = np.trace(C) / J ** (2 / np.longdouble(3)), (np.trace(C) ** 2 - np.trace(C @ C)) / 2
    W = A10 * (I1 - 3) + A01 * (I2 / J ** (4 / np.longdouble(3)) - 3) + D1 * (J - 1) ** 2
    u = (body.nodes @ H.T)[body.dofs[:, 0], body.dofs[:, 1]]
    assert_allclose(u @ (body.K @ u) / 2, float(W), rtol=1e-4)
    default, _ = body_of(tmp_path, text + f"PLSOLID,9,9\nMATHP,9,{A10},{A01},,1000.\n")
    written, _ = body_of(tmp_path, text + f"PLSOLID,9,9\nMATHP,9,{A10},{A01},{1000 * (A10 + A01)},1000.\n")
    assert_allclose(default.K.toarray(), written.K.toarray(), rtol=1e-9)
    for card, why in ((f"MATHP,9,{A10}\n,\n,\n,\n,\n,\n,5\n", "fitted to measured"), ("MATHP,9,,,1.\n", "above zero")):
        with pytest.raises(ValueError, match=why):
            body_of(tmp_path, text + "PLSOLID,9,9\n" + card)


def test_an_equation_that_only_moves_a_point_of_no_element_leaves_the_body_free(tmp_path):
    """Point 3 belongs to nothing: u_3z = 2 u_2x + u_1y says how it moves, and a force there has no place to act."""
    text = GRIDS + f"{ORIENTED}\n" + SECTION + MATERIAL + "GRID,3,,4.,5.,6.\nGRID,4,,4.,5.,7.\nPARAM,COUPMASS,1\n"
    plain, _ = body_of(tmp_path, text)
    one = "MPC,5,2,1,2.,1,2,1.\n,,3,3,-1.\n"
    body, deck = body_of(tmp_path, text + one + "FORCE,6,3,,1.,0.,0.,1.\n")
    assert (body.K != plain.K).nnz == 0
    assert (body.M != plain.M).nnz == 0
    notes = str(deck.ledger.rows())
    assert "only says how a point of no element moves (3)" in notes
    assert "at a point of no element (3)" in notes
    for held in (one + "MPC,5,2,2,2.,3,3,1.\n", one + "SPC1,7,3,3\n"):  # another equation of it, or it is held
        with pytest.raises(ValueError, match=r"node .* has no dof"):
            body_of(tmp_path, text + held)


@pytest.mark.parametrize("normal", [0, 1, 2])
def test_a_planar_truss_is_a_body_whose_points_turn_rigidly_out_of_the_plane(tmp_path, normal):
    """Five rods with masses at their ends, held in a plane: natural frequencies by a truss in two dimensions."""
    plane = np.array([[0.3, 0.1], [2.3, 0.5], [2.0, 1.9], [0.1, 1.5]])
    across = [axis for axis in range(3) if axis != normal]
    points = np.full((4, 3), 0.7)
    points[:, across] = plane
    rods, masses = [(0, 1), (1, 2), (2, 3), (3, 0), (0, 2)], [2.0, 3.0, 1.5, 4.0]
    text = "".join(f"GRID,{k},,{','.join(map(str, x))}\n" for k, x in enumerate(points.tolist(), start=1))
    text += "".join(f"CROD,{k},9,{a + 1},{b + 1}\n" for k, (a, b) in enumerate(rods, start=1))
    text += "".join(f"CONM2,{k + 20},{k + 1},,{m}\n" for k, m in enumerate(masses))
    held = "".join(sorted(str(1 + normal) + "".join(str(4 + c) for c in across)))
    body, deck = body_of(tmp_path, text + f"PROD,9,1,1.-3\nMAT1,1,2.+11,,.3\nSPC1,1,{held},1,THRU,4\n", is_coupled=True)
    assert deck.plane == normal
    K, M = np.zeros((8, 8)), np.diag(np.repeat(masses, 2))
    for a, b in rods:
        x = plane[b] - plane[a]
        row = np.zeros(8)
        row[2 * a : 2 * a + 2], row[2 * b : 2 * b + 2] = -x, x
        K += 2e11 * 1e-3 / np.linalg.norm(x) ** 3 * np.outer(row, row)
    expected = np.sort(eigh(K, M, eigvals_only=True))[3:]
    found = np.sort(eigh(body.K.toarray(), body.M.toarray(), eigvals_only=True))
    assert len(found) == 8 + 3
    assert_allclose(found[6:], expected, rtol=1e-9)
    assert np.abs(found[:6]).max() < 1e-9 * found[-1]


@pytest.mark.parametrize(
    "frame", [cms.TisserandFrame(), cms.reduction.BuckensFrame(), cms.NodalFrame(at="support_123456")]
)
@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.6, 0.48, 0.64)])
def test_masses_on_one_line_are_refused_with_the_axis(tmp_path, frame, axis):
    """Light beams between point masses: no moment of inertia about their line; a small one is enough."""
    points = [np.array([3.0, 1.0, 2.0]) + k * np.array(axis) for k in range(4)]
    text = "".join(f"GRID,{k},,{','.join(map(repr, x.tolist()))}\n" for k, x in enumerate(points, start=1))
    text += "".join(f"CONM2,{10 + k},{k},,10.,,,,\n,INERTIA\n" for k in range(1, 5))
    text += "".join(f"CBAR,{k},1,{k},{k + 1},.1,-.3,1.\n" for k in range(1, 4)) + SECTION + "MAT1,1,7.+10,,.33\n"
    text += "SPC1,1,123456,1\n"
    bare, _ = body_of(tmp_path, text.replace("INERTIA", "0."), is_coupled=True)
    words = "|".join(str(np.round(sign * np.array(axis), 3).tolist()) for sign in (1, -1)).replace("-0.0", "-?0.0")
    words = words.replace("[", r"\[").replace("]", r"\]").replace(".", r"\.")
    with pytest.raises(ValueError, match=f"no moment of inertia about the axis ({words})"):
        frame_condition(bare, frame)
    enough, _ = body_of(tmp_path, text.replace("INERTIA", "1.-3,0.,1.-3,0.,0.,1.-3"), is_coupled=True)
    assert frame_condition(enough, frame).center == pytest.approx(np.mean(points, axis=0))


OWN_G = 7e10  #: of a MAT1 whose E and NU give another one
DISAGREES = f"MAT1,1,2.+11,{OWN_G},.3,7800.\n"


def test_bars_have_the_shear_modulus_of_a_material_that_disagrees_with_itself(tmp_path):
    """E bends and stretches, G twists and shears: u = L³/(3 E I) + L/(K A G), as the usage table of MAT1 says."""
    L = np.linalg.norm(GB - GA)
    body, deck = body_of(tmp_path, GRIDS + f"{ORIENTED}\nPBAR,1,1,2.-3,3.-6,1.-6,2.-6\n,,,,,,,,\n,.8,.5\n" + DISAGREES)
    shear = [L / (k * A * OWN_G) for k in (0.8, 0.5)]
    expected = [L / (E * A), L**3 / (3 * E * I1) + shear[0], L**3 / (3 * E * I2) + shear[1], L / (OWN_G * J)]
    assert_allclose(tip_flexibility(body).diagonal()[:4], expected, rtol=1e-9)
    assert any("E, G and NU disagree" in row[2] for row in deck.ledger.rows())
    body, _ = body_of(tmp_path, GRIDS + f"{ORIENTED}\nPBARL,1,1,,ROD\n,.02\n" + DISAGREES)
    assert_allclose(tip_flexibility(body)[3, 3], L / (OWN_G * np.pi / 2 * 0.02**4), rtol=1e-9)
    far = DISAGREES.replace(str(OWN_G), "1.+10")
    body, _ = body_of(tmp_path, GRIDS + f"{ORIENTED}\n" + SECTION + far)
    assert_allclose(tip_flexibility(body)[3, 3], L / (1e10 * J), rtol=1e-9)
    with pytest.raises(ValueError, match=r"E/\(2 G\) - 1 = 9 is no Poisson's ratio"):
        body_of(tmp_path, GRIDS + f"{ORIENTED}\nPBARL,1,1,,ROD\n,.02\n" + far)


def test_a_rod_has_the_shear_modulus_of_its_material(tmp_path):
    text = GRIDS + f"{ORIENTED}\n" + SECTION + MATERIAL
    K = [
        body_of(tmp_path, text + card)[0].K.toarray()
        for card in ("", "CONROD,9,1,2,2,.1,.01\n" + DISAGREES.replace("MAT1,1", "MAT1,2"))
    ]
    x = (GB - GA) / np.linalg.norm(GB - GA)
    added = (K[1] - K[0])[3:6, 3:6]
    assert_allclose(
        added, OWN_G * 0.01 / np.linalg.norm(GB - GA) * np.outer(x, x), atol=1e-6 * np.abs(K[0]).max() * 1e-6
    )


def test_shells_have_the_shear_modulus_of_their_material_across_their_plane_only(tmp_path):
    """The same body as with (TS/T) G as the deck gives it; solids have E and NU alone."""
    grids = "".join(
        f"GRID,{k},,{x},{y},{z}\n"
        for k, (x, y, z) in enumerate(
            [(0, 0, 0), (2, 0, 0.1), (2.1, 1, 0), (0, 1.2, 0), (0.1, 0, 1), (2, 0.1, 1), (2, 1, 1.1), (0, 1, 1)],
            start=1,
        )
    )
    shell, factor = grids + "CTRIA3,1,1,1,2,3\n", OWN_G / G
    K = lambda text: body_of(tmp_path, text)[0].K.toarray()  # noqa: E731
    expected = K(shell + f"PSHELL,1,1,.3,1,,1,{5 / 6 * factor!r}\n" + MATERIAL)
    assert_allclose(K(shell + "PSHELL,1,1,.3,1,,1\n" + DISAGREES), expected, rtol=1e-9, atol=1e-9 * expected.max())
    assert_allclose(K(shell + "PSHELL,1,1,.3,1\n" + DISAGREES), expected, rtol=1e-9, atol=1e-9 * expected.max())
    third = MATERIAL + DISAGREES.replace("MAT1,1", "MAT1,2")
    assert_allclose(K(shell + "PSHELL,1,1,.3,1,,2\n" + third), expected, rtol=1e-9, atol=1e-9 * expected.max())
    mixed = "MAT1,2,2.+11,,.2\n" + DISAGREES
    of_mixed = [
        K(shell + f"PSHELL,1,1,.3,2,,{mid},{ts!r}\n" + cards)
        for mid, ts, cards in ((1, 5 / 6, mixed), (3, 5 / 6 * factor, mixed + MATERIAL.replace("MAT1,1", "MAT1,3")))
    ]
    assert_allclose(of_mixed[0], of_mixed[1], rtol=1e-9, atol=1e-9 * expected.max())
    layers = "PCOMP,1,-.15,,,,,,\n,1,.1,,,1,.2\n"
    two = [K(shell + layers + cards) for cards in (DISAGREES, MATERIAL)]
    assert np.abs(two[0] - two[1]).max() > 1e-4 * expected.max()
    assert_allclose(two[0], expected, rtol=1e-6, atol=1e-6 * expected.max())
    solid = grids + "CHEXA,1,9,1,2,3,4,5,6\n,7,8\nPSOLID,9,1\n"
    assert_allclose(K(solid + DISAGREES), K(solid + MATERIAL), rtol=1e-14)


def test_a_material_of_one_modulus_is_noted_or_refused(tmp_path):
    """Nastran takes the other two as zero: a bar without torsion, or one without stretch."""
    _, deck = body_of(tmp_path, GRIDS + f"{ORIENTED}\n" + SECTION + "MAT1,1,2.+11,,,7800.\n")
    assert any("E alone: NU = 0 and G = E/2 here, G = 0 in Nastran" in row[2] for row in deck.ledger.rows())
    with pytest.raises(ValueError, match="G alone: E and NU would be zero"):
        body_of(tmp_path, GRIDS + f"{ORIENTED}\n" + SECTION + "MAT1,1,,7.+10,,7800.\n")
