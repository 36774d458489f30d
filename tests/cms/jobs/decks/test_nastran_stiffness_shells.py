"""PSHELL with MAT2 and MID4 against laminates, whose A, B, D are integrated here."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cms.jobs.body_of_job import uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models.body.material import OrthotropicMaterial
from fe_models.elements.shells.body import shell_body
from fe_models.elements.shells.laminate import shell_law
from fe_models.elements.shells.shell_property import LaminateProperty, Layer, StiffnessProperty
from fe_models.errors import MeshError
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.stages import Stages
from fe_models.foundation.units import unit_system
from fe_models.meshes.shell_mesh import ShellMesh

POINTS = np.array([[0.1, 0.2, 0.3], [2.1, 0.3, 0.2], [2.0, 1.3, 0.5], [0.0, 1.1, 0.6]])
PLIES = ((0.01, 0.0), (0.02, 30.0), (0.015, -60.0))  #: thickness, angle; bottom to top
E_1, E_2, NU, G_12, G_13, G_23, RHO = 1.4e11, 1e10, 0.3, 5e9, 4e9, 3e9, 1600.0
T = 0.045
MESH = ShellMesh(POINTS, {"quad": np.arange(4)[None]})
SI = unit_system("m-kg-s")


def ply_elasticity(angle):
    """Return the plane stress elasticity of a ply by turning its compliance, rows xx yy xy."""
    S = np.array([[1 / E_1, -NU / E_1, 0], [-NU / E_1, 1 / E_2, 0], [0, 0, 1 / G_12]])
    c, s = np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))
    stress = np.array([[c * c, s * s, 2 * c * s], [s * s, c * c, -2 * c * s], [-c * s, c * s, c * c - s * s]])
    return np.linalg.inv(stress.T @ S @ stress)


def moments():
    """Return ∫ Q dz, ∫ z Q dz and ∫ z² Q dz by Gauss points in each ply."""
    made, z = np.zeros((3, 3, 3)), -T / 2
    for h, angle in PLIES:
        for x, w in zip(*np.polynomial.legendre.leggauss(3), strict=True):
            at = z + h * (1 + x) / 2
            made += w * h / 2 * at ** np.arange(3)[:, None, None] * ply_elasticity(angle)
        z += h
    return made


def words(values):
    return ",".join(f"{value:.12e}".replace("e", "d") for value in values)


def sheet(number, G, rho=""):
    return f"MAT2*,{number},{words(G[0])}\n*,{words(G[1, 1:])},{words(G[2, 2:])},{rho}\n"


def deck_text(H, bending_ratio=1.0, sign=-1.0, mid4="14", theta="0."):
    A, B, D = moments()
    G3 = np.zeros((3, 3))
    G3[:2, :2] = H / (0.8 * T)
    text = "BEGIN BULK\n" + "".join(f"GRID,{k},,{x},{y},{z}\n" for k, (x, y, z) in enumerate(POINTS.tolist(), start=1))
    text += f"CQUAD4,1,1,1,2,3,4,{theta},.02\nPSHELL,1,11,{T},12,{bending_ratio},13,.8,3.\n,,,{mid4}\n"
    text += sheet(11, A / T, RHO) + sheet(12, 12 * D / T**3 / bending_ratio) + sheet(14, sign * B / T**2)
    text += f"MAT2*,13,{words(H[0] / (0.8 * T))},\n*,{words(H[1, 1:] / (0.8 * T))}\n"
    return text + "ENDDATA\n"


def body_of(folder, text):
    (folder / "plate.bdf").write_text(text)
    deck = parse_deck(folder / "plate.bdf")
    (folder / "plate.toml").write_text(job_text(deck, DeckOptions("m-kg-s", {}), "plate.bdf"))
    return uncoupled_body(read_job(folder / "plate.toml"), Stages())


def laminate(theta=0.0):
    ply = OrthotropicMaterial("ply", (E_1, E_2, E_2), (G_12, G_13, G_23), (NU, 0.0, 0.0), RHO)
    layers = tuple(Layer(ply, h, angle) for h, angle in PLIES)
    side, other = POINTS[1] - POINTS[0], POINTS[3] - POINTS[1]
    normal = np.cross(POINTS[2] - POINTS[0], other)
    normal /= np.linalg.norm(normal)
    side = side - normal * (normal @ side)
    angle = np.deg2rad(theta)
    along = np.cos(angle) * side + np.sin(angle) * np.cross(normal, side)
    return LaminateProperty(layers, tuple(along.tolist()), offset=0.02, added_mass=3.0)


def body_of_laminate(theta=0.0):
    return shell_body(MESH, laminate(theta), name="laminate", units=SI)


@pytest.mark.parametrize(("ratio", "theta"), [(1.0, 0.0), (12.0, 25.0)])
def test_matrices_of_a_layup_give_the_body_of_the_layup(tmp_path, ratio, theta):
    """The coupling is -T² G4: with the other sign the body is that of the layup turned over."""
    theirs = body_of_laminate(theta)
    H = shell_law(laminate(theta)).H
    ours = body_of(tmp_path, deck_text(H, ratio, theta=f"{theta}"))
    K = theirs.K.toarray()
    assert_allclose(ours.K.toarray(), K, rtol=0, atol=1e-9 * np.abs(K).max())
    turned = body_of(tmp_path, deck_text(H, ratio, sign=1.0, theta=f"{theta}"))
    assert np.abs(turned.K.toarray() - K).max() > 1e-3 * np.abs(K).max()


def test_wtmass_scales_the_mass_of_sheets(tmp_path):
    text = deck_text(shell_law(laminate()).H)
    plain, scaled = body_of(tmp_path, text), body_of(tmp_path, text.replace("BULK\n", "BULK\nPARAM,WTMASS,.25\n"))
    assert_allclose(scaled.M.toarray(), plain.M.toarray() / 4, rtol=1e-12)
    assert_allclose(scaled.K.toarray(), plain.K.toarray(), rtol=1e-12)


def test_the_mass_is_that_of_the_membrane_without_rotary_inertia(tmp_path):
    H = shell_law(laminate()).H
    ours, theirs = body_of(tmp_path, deck_text(H)), body_of_laminate()
    x = (ours.dofs[:, 1] == 0).astype(float)
    assert_allclose(x @ (ours.M @ x), x @ (theirs.M @ x), rtol=1e-12)
    turn = (ours.dofs[:, 1] == 3).astype(float)  # all nodes turn in place: offset and, in the laminate, its thickness
    area = x @ (ours.M @ x) / (RHO * T + 3.0)
    spread = area * (RHO * T**3 / 12 + 3.0 * T**2 / 12)
    difference = turn @ (theirs.M @ turn) - turn @ (ours.M @ turn)
    assert 0.5 * spread < difference < spread  # of the share across the axis; the plate is inclined


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (",,,14", ",,,99", "material 99 is not known"),
        ("12,1.0,13,", "12,1.0,11,", "MID3 = 11 is not known here, or a MAT2 with G13, G23 or G33"),
        ("12,1.0,13,.8,3.\n,,,14", "14,1.0,13,.8,3.\n,,,", "not positive definite"),
    ],
)
def test_what_gives_no_stiffness_is_refused(tmp_path, old, new, words):
    text = deck_text(shell_law(laminate()).H)
    assert old in text
    with pytest.raises(MeshError, match=words):
        body_of(tmp_path, text.replace(old, new))


def test_membrane_and_bending_of_two_poisson_ratios(tmp_path):
    grids = "".join(f"GRID,{k},,{x},{y},{z}\n" for k, (x, y, z) in enumerate(POINTS.tolist(), start=1))
    text = "BEGIN BULK\n" + grids + "CQUAD4,1,1,1,2,3,4\nPSHELL,1,1,.05,2,1.5,1,.7\n"
    ours = body_of(tmp_path, text + "MAT1,1,2.+11,,.3,7800.\nMAT1,2,1.+11,,.1\nENDDATA\n")

    def plane(E, nu):
        return E / (1 - nu**2) * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])

    def expected(membrane, bending, shear):
        C = np.zeros((6, 6))
        C[:3, :3], C[3:, 3:] = 0.05 * membrane, 1.5 * 0.05**3 / 12 * bending
        side = tuple((POINTS[1] - POINTS[0]).tolist())
        item = StiffnessProperty(0.05, C, 0.7 * 0.05 * shear, side, added_mass=7800.0 * 0.05)
        return shell_body(MESH, item, name="plate", units=SI).K.toarray()

    K = expected(plane(2e11, 0.3), plane(1e11, 0.1), 2e11 / 2.6 * np.eye(2))
    assert_allclose(ours.K.toarray(), K, rtol=0, atol=1e-9 * np.abs(K).max())
    text += "MAT1,2,1.+11,,.1\nMAT8,1,1.4+11,1.+10,.3,5.+9,4.+9,3.+9,7800.\nENDDATA\n"  # and one of three moduli
    K = expected(ply_elasticity(0.0), plane(1e11, 0.1), np.diag([G_13, G_23]))
    assert_allclose(body_of(tmp_path, text).K.toarray(), K, rtol=0, atol=1e-9 * np.abs(K).max())
