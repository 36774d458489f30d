"""Plane strain of Nastran, PLPLANE and PSHELL with MID2 = -1, beside Hooke's law in space without strain across."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.cms.jobs.decks.nastran_bodies import body_of

E, NU, T, RHO = 3e9, 0.4, 0.07, 1200.0
LAMBDA, MU = E * NU / (1 + NU) / (1 - 2 * NU), E / 2 / (1 + NU)
PLANE = {  # corners of a triangle and a quad that share a side, one middle point each for elements of second order
    1: (0.0, 0.0), 2: (1.0, 0.2), 3: (1.3, 1.1), 4: (-0.1, 0.9), 5: (2.1, 0.7),
    12: (0.5, 0.1), 23: (1.15, 0.65), 34: (0.6, 1.0), 14: (-0.05, 0.45), 25: (1.55, 0.45), 35: (1.7, 0.9),
}  # fmt: skip
ELEMENTS = {
    "first": ("CQUAD4,1,9,1,2,3,4\nCTRIA3,2,9,2,5,3\n", (1, 2, 3, 4, 5)),
    "second": ("CQUAD8,1,9,1,2,3,4,12,23\n,34,14\nCTRIA6,2,9,2,5,3,25,35,23\n", tuple(PLANE)),
}
MAT1 = f"MAT1,7,{E!r},,{NU},{RHO}\n"
PROPERTIES = {
    "PLPLANE": f"PLPLANE,9,7,3,,{T}\n{MAT1}",
    "PLPLANE of rubber": f"PLPLANE,9,7,3,,{T}\nMATHP,7,{0.3 * MU!r},{0.2 * MU!r},{(LAMBDA + 2 / 3 * MU) / 2!r},{RHO}\n",
    "PSHELL": f"PSHELL,9,7,{T},-1,,,,3.\n{MAT1}",
}


def deck(normal, elements, property_, at=(3.0, -2.0, 5.0)):
    cards, numbers = ELEMENTS[elements]
    i, j = (normal + 1) % 3, (normal + 2) % 3
    held = "".join(str(c + 1) for c in sorted((normal, 3 + i, 3 + j)))
    grids = ""
    for number in numbers:
        x = np.array(at)
        x[[i, j]] += PLANE[number]
        grids += f"GRID,{number},,{','.join(repr(float(v)) for v in x)},,{held}\n"
    x, z = ([float(k == axis) for k in range(3)] for axis in (i, normal))
    system = "CORD2R,3,,0.,0.,0.," + ",".join(map(str, z)) + "\n," + ",".join(map(str, x)) + "\n"
    return grids + cards + system + property_ + "PARAM,COUPMASS,1\n", (i, j)


@pytest.mark.parametrize("normal", [0, 1, 2])
@pytest.mark.parametrize("elements", ELEMENTS)
@pytest.mark.parametrize("name", PROPERTIES)
def test_a_uniform_strain_has_the_energy_of_a_slice_without_strain_across(tmp_path, name, elements, normal):
    """V (lambda/2 tr(eps)² + mu eps : eps), and the mass rho V, with V = T A; PSHELL has 3 per area in addition."""
    text, (i, j) = deck(normal, elements, PROPERTIES[name])
    body, made = body_of(tmp_path, text, is_coupled=True)
    assert made.plane == normal
    corners = np.array([PLANE[k] for k in (1, 2, 5, 3, 4)])
    area = sum(np.linalg.det([a, b]) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)) / 2
    node, c = body.dofs.T
    for eps in (np.array([[1.0, 0.0], [0.0, 0.0]]), np.array([[0.3, -0.8], [-0.8, 0.7]])):
        u = np.zeros(body.n_dof)
        for k in np.flatnonzero(np.isin(c, (i, j))):
            u[k] = eps[0 if c[k] == i else 1] @ body.nodes[node[k]][[i, j]]
        energy = LAMBDA / 2 * np.trace(eps) ** 2 + MU * np.sum(eps**2)
        assert_allclose(u @ body.K @ u / 2, T * area * energy, rtol=1e-9)
    x = (c == i).astype(float)
    assert_allclose(x @ body.M @ x, area * (RHO * T + (3.0 if name == "PSHELL" else 0.0)), rtol=1e-9)


@pytest.mark.parametrize(
    ("property_", "why"),
    [
        (f"PLPLANE,9,7,,,{T}\n{MAT1}", "CID: its x-y plane is not that of the deck"),
        (f"PLPLANE,9,7,-2\n{MAT1}", "CID = -2: axes of a body of revolution"),
        (f"PLPLANE,9,8,3\nMAT8,8,1.+9,1.+9,.3,1.+9\n{MAT1}", "material 8 is not known here, or not isotropic"),
        (f"PSHELL,9,7,{T},-1,,7\n{MAT1}", "plane strain, with MID3"),
    ],
)
def test_plane_strain_that_cannot_be_taken_is_refused(tmp_path, property_, why):
    with pytest.raises(ValueError, match=why):
        body_of(tmp_path, deck(0, "first", property_)[0])


def test_plane_strain_in_space_is_refused(tmp_path):
    text, _ = deck(2, "first", PROPERTIES["PSHELL"])
    with pytest.raises(ValueError, match="plane strain: only where the deck holds all points in a plane"):
        body_of(tmp_path, text.replace(",345\n", ",3\n"))


def test_a_slice_of_plane_strain_has_thickness_one_where_it_is_blank(tmp_path):
    """A pressed pipe: the radial stiffness of a ring of inner radius a, 2 pi p a/u by Lame's solution, within 1 %."""
    a, b, n, m = 3.0, 4.5, 12, 96
    radii, angles = np.linspace(a, b, n + 1), np.arange(m) * 2 * np.pi / m
    grids, cards = "", ""
    for p, r in enumerate(radii):
        for q, t in enumerate(angles):
            grids += f"GRID,{1 + p * m + q},,{r * np.cos(t):.12g},{r * np.sin(t):.12g},0.,,345\n"
            if p < n:
                k = [1 + p * m + q, 1 + (p + 1) * m + q, 1 + (p + 1) * m + (q + 1) % m, 1 + p * m + (q + 1) % m]
                cards += f"CQUAD4,{1 + p * m + q},9," + ",".join(map(str, k)) + "\n"
    body, _ = body_of(tmp_path, grids + cards + f"PLPLANE,9,7\n{MAT1}", is_coupled=True)
    node, c = body.dofs.T
    radius, turn = np.hypot(*body.nodes[:, :2].T), np.arctan2(body.nodes[:, 1], body.nodes[:, 0])
    u = np.zeros(body.n_dof)
    p = 1e6
    C = p * a**2 / (b**2 - a**2) * (1 + NU) / E  # u_r = C ((1 - 2 nu) r + b²/r)
    for k in np.flatnonzero(c < 2):
        r, t = radius[node[k]], turn[node[k]]
        u[k] = C * ((1 - 2 * NU) * r + b**2 / r) * (np.cos(t), np.sin(t))[c[k]]
    assert_allclose(u @ body.K @ u, 2 * np.pi * a * p * C * ((1 - 2 * NU) * a + b**2 / a), rtol=0.01)
