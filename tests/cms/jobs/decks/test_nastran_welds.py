"""Welds of Nastran between plates of unequal meshes, turned and off the origin, beside an assembler of this file."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import root

from tests.cms.jobs.decks.nastran_bodies import arm, axes_of, body_of

E, NU, D = 7e10, 0.3, 0.31
G = E / 2 / (1 + NU)
TURN = np.linalg.qr(np.array([[1.0, 0.4, 0.2], [-0.2, 1.0, 0.5], [0.3, -0.6, 1.0]]))[0]
TURN = TURN * np.sign(np.linalg.det(TURN))


def plates():
    """Return grids and shells: a lower plate of quads, one of them warped, an upper one, inclined, of triangles."""
    grids, shells = {}, {}
    for j in range(4):
        for i in range(5):
            lift = 0.03 if (i, j) == (4, 3) else 0.0
            grids[1 + 5 * j + i] = np.array([0.5 * i + 0.07 * j, 0.45 * j - 0.05 * (i % 2), lift])
    for j in range(3):
        for i in range(4):
            n = 1 + 5 * j + i
            shells[100 + 4 * j + i] = (n, n + 1, n + 6, n + 5)
    for j in range(4):
        for i in range(4):
            x, y = 0.63 * i - 0.1 + 0.05 * j, 0.52 * j - 0.2
            grids[51 + 4 * j + i] = np.array([x, y, 0.4 + 0.1 * x - 0.05 * y])
    for j in range(3):
        for i in range(3):
            n = 51 + 4 * j + i
            shells[200 + 6 * j + 2 * i], shells[201 + 6 * j + 2 * i] = (n, n + 1, n + 4), (n + 1, n + 5, n + 4)
    return grids, shells


def placed(size):
    grids, shells = plates()
    return {number: size * (TURN @ x + [3.0, -1.0, 2.0]) for number, x in grids.items()}, shells


def deck(grids, shells, cards, points=(), young=E, size=1.0):
    lines = [f"GRID,{n},,{','.join(repr(float(v)) for v in x)}" for n, x in {**grids, **dict(points)}.items()]
    for n, corners in shells.items():
        name, pid = ("CQUAD4", 7) if len(corners) == 4 else ("CTRIA3", 8)
        lines.append(f"{name},{n},{pid}," + ",".join(map(str, corners)))
    lines += [f"PSHELL,{pid},1,{size * t!r},1,,1" for pid, t in ((7, 0.02), (8, 0.03))]
    lines += [f"MAT1,1,{young!r},,{NU},2700.", "PARAM,COUPMASS,1"]
    return "\n".join([*lines, cards]) + "\n"


def shape(corners, place):
    r, s = place
    if len(corners) == 3:
        return np.array([1 - r - s, r, s])
    return np.array([(1 - r) * (1 - s), (1 + r) * (1 - s), (1 + r) * (1 + s), (1 - r) * (1 + s)]) / 4


def at_line(corners, point, along):
    """Return where a line pierces a patch, in natural coordinates, by the solver of scipy."""
    size = np.linalg.norm(corners[1] - corners[0])

    def miss(x):
        return (shape(corners, x[:2]) @ corners - point) / size - x[2] * along

    found = root(miss, [0.2, 0.2, 0.0], options={"xtol": 1e-14})
    return found.x[:2] if np.abs(found.fun).max() < 1e-9 else np.full(2, 9.0)


def is_in(corners, place):
    return min(*place, 1 - sum(place)) > -1e-9 if len(corners) == 3 else np.abs(place).max() < 1 + 1e-9


def shell_under(grids, shells, numbers, point):
    """Return the number of the shell on which a point has its normal projection."""
    patches = {n: np.array([grids[k] for k in shells[n]]) for n in shells if n in numbers}
    return next(n for n, patch in patches.items() if is_in(patch, foot(patch, point)))


LOWER, UPPER = range(100, 200), range(200, 300)


def normal_at(corners, place, h=1e-6):
    d = [(shape(corners, place + e) - shape(corners, place - e)) @ corners for e in h * np.eye(2)]
    n = np.cross(*d)
    return n / np.linalg.norm(n)


def foot(corners, point):
    place = np.full(2, 0.2)
    for _ in range(60):
        place = at_line(corners, point, normal_at(corners, place))
    return place


def kirchhoff(corners, place):
    """Return u and theta of a point of a patch by its corners, (6, 3 n): theta from differences along the patch."""
    n = normal_at(corners, place)
    R = axes_of(n, corners[1] - corners[0])  # rows z, x, y
    z, x, y = R
    h = 1e-5 * np.linalg.norm(corners[1] - corners[0])
    here = shape(corners, place) @ corners
    N = [[shape(corners, at_line(corners, here + sign * h * e, n)) for sign in (1, -1)] for e in (x, y)]
    by = [(ahead - behind) / (2 * h) for ahead, behind in N]
    rows = np.zeros((6, 3 * len(corners)))
    for i, N in enumerate(shape(corners, place)):
        rows[:3, 3 * i : 3 * i + 3] = N * np.eye(3)
        rows[3:, 3 * i : 3 * i + 3] = (
            np.outer(x, by[1][i] * z) - np.outer(y, by[0][i] * z) + np.outer(z, by[0][i] * y - by[1][i] * x) / 2
        )
    return rows


def round_bar(ends, diameter, young=E):
    """Return K of a Timoshenko bar of a circle, shear by Cowper, (12, 12), basic axes."""
    length = np.linalg.norm(ends[1] - ends[0])
    area, inertia, shear = np.pi * diameter**2 / 4, np.pi * diameter**4 / 64, young / 2 / (1 + NU)
    phi = 12 * young * inertia / (6 * (1 + NU) / (7 + 6 * NU) * shear * area * length**2)
    flexibility = np.diag(
        [length / young / area] + [0.0] * 2 + [length / shear / 2 / inertia] + [length / young / inertia] * 2
    )
    bend = length**3 / 3 / young / inertia + phi * length**3 / 12 / young / inertia
    flexibility[1, 1] = flexibility[2, 2] = bend
    flexibility[1, 5] = flexibility[5, 1] = length**2 / 2 / young / inertia
    flexibility[2, 4] = flexibility[4, 2] = -(length**2) / 2 / young / inertia
    R = np.kron(np.eye(2), axes_of(ends[1] - ends[0], np.array([0.3, 0.5, 0.9])))
    K_b = R.T @ np.linalg.inv(flexibility) @ R
    B = np.hstack([-arm(ends[1] - ends[0]), np.eye(6)])
    return B.T @ K_b @ B


def dofs_at(body, points, components=(0, 1, 2)):
    found = []
    size = np.ptp(body.nodes)
    for point in points:
        near = np.flatnonzero(np.linalg.norm(body.nodes - point, axis=1) < 1e-9 * size)
        near = [k for k in near if (body.dofs[:, 0] == k).sum() == 6]
        found += [int(np.flatnonzero((body.dofs == (near[0], c)).all(axis=1))[0]) for c in components]
    return found


def added(tmp_path, grids, shells, cards, points, young=E, size=1.0):
    """Return what the weld adds to K, and the body without it; both by the translations and rotations of the grids."""
    parts = []
    for text, more in ((cards, points), ("", ())):
        folder = tmp_path / str(len(parts))
        folder.mkdir()
        body, _ = body_of(folder, deck(grids, shells, text, more, young, size), is_coupled=True)
        at = dofs_at(body, grids.values(), range(6))
        parts.append(body.K.toarray()[np.ix_(at, at)])
    return parts[0] - parts[1]


def expected(grids, ends, motions, diameter, young=E):
    """Return K of a bar at both ends of which motions by grids are known: (rows, grids, components of each)."""
    numbers = list(grids)
    T = np.zeros((12, 6 * len(numbers)))
    for k, (rows, at, width) in enumerate(motions):
        for j, number in enumerate(at):
            first = 6 * numbers.index(number)
            T[6 * k : 6 * k + 6, first : first + width] += rows[:, width * j : width * j + width]
    return T.T @ round_bar(ends, diameter, young) @ T


def assert_same(found, wanted, rtol=1e-7):
    assert np.abs(wanted).max() > 0
    assert_allclose(found, wanted, rtol=0, atol=rtol * np.abs(wanted).max())


@pytest.mark.parametrize(("size", "young"), [(1.0, E), (0.01, E * 1e-3)])
@pytest.mark.parametrize(
    ("number_a", "at"), [(105, (0.85, 0.62, 0.1)), (111, (1.75, 1.05, 0.2)), (100, (0.3, 0.2, 0.2))]
)
def test_a_weld_of_two_shells_follows_their_surfaces(tmp_path, number_a, at, size, young):
    """ELEMID; 111 is warped. The stiffness that the weld adds is that of a bar between the feet of GS."""
    grids, shells = placed(size)
    gs = size * (TURN @ at + [3.0, -1.0, 2.0])
    number_b = shell_under(grids, shells, UPPER, gs)
    cards = f"CWELD,9,5,999,ELEMID,,,,3\n,{number_a},{number_b}\nPWELD,5,1,{size * D!r}"
    found = added(tmp_path, grids, shells, cards, {999: gs}.items(), young, size)
    patches = [np.array([grids[k] for k in shells[n]]) for n in (number_a, number_b)]
    places = [foot(patch, gs) for patch in patches]
    assert all(is_in(*each) for each in zip(patches, places, strict=True))
    ends = [shape(*each) @ each[0] for each in zip(patches, places, strict=True)]
    motions = [(kirchhoff(*each), shells[n], 3) for *each, n in zip(patches, places, (number_a, number_b), strict=True)]
    assert_same(found, expected(grids, ends, motions, size * D, young))


def test_ends_of_a_weld_may_be_grid_points_beside_their_patches(tmp_path):
    """GRIDID with GA and GB off the patches: arms from the feet to the ends."""
    grids, shells = placed(1.0)
    a, b = ((3.0, -1.0, 2.0) + TURN @ x for x in ([0.8, 0.6, 0.04], [0.9, 0.7, 0.3]))
    at_a, at_b = shells[shell_under(grids, shells, LOWER, a)], shells[shell_under(grids, shells, UPPER, b)]
    cards = f"CWELD,9,5,,GRIDID,998,999,QT\n,{','.join(map(str, at_a))}\n,{','.join(map(str, at_b))}\nPWELD,5,1,.2"
    found = added(tmp_path, grids, shells, cards, {998: a, 999: b}.items())
    motions = []
    for point, at in ((a, at_a), (b, at_b)):
        patch = np.array([grids[k] for k in at])
        place = foot(patch, point)
        assert is_in(patch, place)
        motions.append((arm(point - shape(patch, place) @ patch) @ kirchhoff(patch, place), at, 3))
    assert_same(found, expected(grids, (a, b), motions, 0.2))


def test_a_weld_from_a_patch_to_a_point_and_one_between_two_points(tmp_path):
    grids, shells = placed(1.0)
    number = 56
    below = shell_under(grids, shells, LOWER, grids[number])
    patch = np.array([grids[k] for k in shells[below]])
    place = foot(patch, grids[number])
    assert is_in(patch, place)
    ends = (shape(patch, place) @ patch, grids[number])
    bar = (np.eye(6), (number,), 6)
    for k, format_ in enumerate((f"ELEMID\n,{below}", f"GRIDID,,,Q\n,{','.join(map(str, shells[below]))}")):
        folder = tmp_path / f"point_{k}"
        folder.mkdir()
        found = added(folder, grids, shells, f"CWELD,9,5,{number},{format_}\nPWELD,5,1,.15", ())
        assert_same(found, expected(grids, ends, [(kirchhoff(patch, place), shells[below], 3), bar], 0.15))
    folder = tmp_path / "align"
    folder.mkdir()
    found = added(folder, grids, shells, f"CWELD,9,5,,ALIGN,7,{number}\nPWELD,5,1,.15", ())
    assert_same(found, expected(grids, (grids[7], grids[number]), [(np.eye(6), (7,), 6), bar], 0.15), 1e-9)


@pytest.mark.parametrize("format_", ["ELPAT,,,,\n,105,208", "PARTPAT\n,7,8", "ELPAT,,,,\n,106,211", "XYZ"])
def test_a_wide_weld_follows_all_shells_under_its_square(tmp_path, format_):
    """Four points at the corners of a square of area pi D²/4, pierced along the weld, and the mean of their motions."""
    grids, shells = placed(1.0)
    gs = TURN @ [1.02, 0.68, 0.33] + [3.0, -1.0, 2.0]
    card, points = f"CWELD,9,5,999,{format_}", {999: gs}.items()
    if format_ == "XYZ":
        card, points = "CWELD,9,5,,ELPAT\n,105,208\n," + ",".join(repr(float(v)) for v in gs), ()
    found = added(tmp_path, grids, shells, f"{card}\nPWELD,5,1,{D}", points)
    ends, sides = [], [[n for n in shells if n < 200], [n for n in shells if n >= 200]]
    patch = {n: np.array([grids[k] for k in shells[n]]) for n in shells}
    for side in sides:
        number = next(n for n in side if is_in(patch[n], foot(patch[n], gs)))
        ends.append(shape(patch[number], foot(patch[number], gs)) @ patch[number])
    x = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    e = np.eye(3)[np.argmin(np.abs(x))]
    y = (e - (e @ x) * x) / np.linalg.norm(e - (e @ x) * x)
    z, half = np.cross(x, y), np.sqrt(np.pi * D**2 / 4) / 2
    motions = []
    for side, end in zip(sides, ends, strict=True):
        T, hit, rigid = np.zeros((12, 3 * len(grids))), set(), []
        for k, (a, b) in enumerate(((1, 1), (1, -1), (-1, 1), (-1, -1))):
            start = end + half * (a * y + b * z)
            places = {n: at_line(patch[n], start, x) for n in side}
            number = next(n for n in side if is_in(patch[n], places[n]))
            hit.add(number)
            N = shape(patch[number], places[number])
            for weight, grid in zip(N, shells[number], strict=True):
                first = 3 * list(grids).index(grid)
                T[3 * k : 3 * k + 3, first : first + 3] += weight * np.eye(3)
            rigid.append(arm(N @ patch[number] - end)[:3])
        assert len(hit) > 1
        motions.append((np.linalg.pinv(np.vstack(rigid)) @ T, tuple(grids), 3))
    assert_same(found, expected(grids, ends, motions, D), 1e-9)


def test_a_weld_has_no_mass(tmp_path):
    grids, shells = placed(1.0)
    cards = "CWELD,9,5,7,ALIGN,7,56\nPWELD,5,1,.15"
    masses = []
    for k, text in enumerate((cards, "")):
        (tmp_path / str(k)).mkdir()
        body, _ = body_of(tmp_path / str(k), deck(grids, shells, text), is_coupled=True)
        x = (body.dofs[:, 1] == 0).astype(float)
        masses.append(x @ body.M @ x)
    assert_allclose(masses[0], masses[1], rtol=1e-12)


def test_a_spot_weld_between_touching_plates_has_their_thickness_as_length(tmp_path):
    """SPOT where GA and GB are half of both thicknesses apart: as a weld without TYPE; elsewhere it is refused."""
    square = {1: (0, 0, 0), 2: (1, 0, 0), 3: (1, 1, 0), 4: (0, 1, 0)}
    grids = {n: np.array(x, dtype=float) for n, x in square.items()}
    grids |= {n + 4: np.add(x, (0.0, 0.0, 0.025)) for n, x in square.items() if n != 3}
    shells = {100: (1, 2, 3, 4), 200: (5, 6, 8)}
    cards = "CWELD,9,5,999,ELEMID\n,100,200\nPWELD,5,1,.2,,,,,SPOT"
    points = {999: np.array([0.3, 0.3, 0.0])}.items()
    found = added(tmp_path, grids, shells, cards, points)
    ends = [np.array([0.3, 0.3, z]) for z in (0.0, 0.025)]
    patches = [np.array([grids[k] for k in shells[n]]) for n in (100, 200)]
    motions = [(kirchhoff(p, foot(p, ends[0])), shells[n], 3) for p, n in zip(patches, (100, 200), strict=True)]
    assert_same(found, expected(grids, ends, motions, 0.2))
    folder = tmp_path / "refused"
    folder.mkdir()
    with pytest.raises(ValueError, match=r"SPOT: its length 0.025 is not half of both thicknesses, 0.035"):
        body_of(folder, deck(grids, shells, cards, points).replace("PSHELL,8,1,0.03", "PSHELL,8,1,0.05"))


@pytest.mark.parametrize(
    ("cards", "why"),
    [
        ("CWELD,9,6,999,ELEMID\n,105,208", "names PWELD 6, which is not defined"),
        ("CWELD,9,5,999,ELEMID\n,105,888", "patch B: shell 888 has no CTRIA3, CTRIAR, CQUAD4, CQUADR"),
        ("CWELD,9,5,999,PARTPAT\n,7,77", "patch B: property 77 has no"),
        ("CWELD,9,5,999,PARTPAT\n,7", "patch B: expected a number"),
        ("CWELD,9,5,999,ELEMID\n,100,208", "has no normal projection on its patch A"),
        ("CWELD,9,5,999,GRIDID,,,QQ\n,8,9,14\n,55,56,59", "SPTYP = QQ: patch A needs Q with its corners alone"),
        ("CWELD,9,5,,ELEMID\n,105,208", "has neither GS nor GA and GB"),
        ("CWELD,9,5,999,SOMEHOW\n,105,208", "SOMEHOW: expected PARTPAT, ELPAT, ELEMID, GRIDID or ALIGN"),
        ("CWELD,9,5,,ELEMID,8,999\n,105,208", "GA = 8 is a grid point of its own patch"),
        ("CWELD,9,5,,ALIGN,7,7", "has no length between its ends"),
        ("CWELD,9,5,1,ALIGN,7,20", r"its length is 6.3\d D, not between LDMIN = 0.2 and LDMAX = 5: versions"),
        ("CWELD,9,5,997,ELPAT\n,100,200", "reaches over the edge of its patch A"),
        ("CWELD,9,7,999,ELEMID\n,105,208\nPWELD,7,1,.3,,,,,CRIMP", "TYPE = CRIMP: expected SPOT or a blank field"),
        ("CWELD,9,7,999,ELEMID\n,105,208\nPWELD,7,1,0.", "D must be above zero"),
        ("CWELD,9,7,999,ELEMID\n,105,208\nPWELD,7,8,.3\nMAT8,8,1.+9,1.+9,.3,1.+9", "material 8 is not known here, or"),
    ],
)
def test_welds_that_cannot_be_taken_are_refused(tmp_path, cards, why):
    grids, shells = placed(1.0)
    points = {999: TURN @ [0.85, 0.62, 0.1] + [3.0, -1.0, 2.0], 997: TURN @ [0.15, 0.1, 0.1] + [3.0, -1.0, 2.0]}
    with pytest.raises(ValueError, match=why):
        body_of(tmp_path, deck(grids, shells, f"{cards}\nPWELD,5,1,.3", points.items()))
