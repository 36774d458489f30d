"""Plane stress elements of Abaqus and shells of ANSYS: energies of uniform strain and of bending in closed form."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

from cms.jobs.body_of_job import coupled_body, uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.stages import Stages

E, NU, RHO, T = 2e11, 0.3, 7800.0, 0.02
#: distorted quads and triangles over a rectangle 2 by 1
POINTS = {1: (0, 0), 2: (0.9, 0), 3: (2, 0), 4: (0, 0.4), 5: (1.1, 0.6), 6: (2, 0.5), 7: (0, 1), 8: (1, 1), 9: (2, 1)}
QUADS = {1: (1, 2, 5, 4), 2: (2, 3, 6, 5), 3: (4, 5, 8, 7)}
TRIANGLES = {4: (5, 6, 9), 5: (5, 9, 8)}
C = E / (1 - NU**2) * np.array([[1, NU, 0], [NU, 1, 0], [0, 0, (1 - NU) / 2]])


def made(path, **options):
    deck = parse_deck(path)
    text = job_text(deck, DeckOptions("m-kg-s", {}, **options), path.name)
    path.with_suffix(".toml").write_text(text.replace("[body]", '[body]\naccept = ["parts"]'))
    job = read_job(path.with_suffix(".toml"))
    return coupled_body(job, uncoupled_body(job, Stages())), deck


def planar_deck(kind="CPS", data=f"{T!r},", extra=""):
    lines = ["*NODE", *(f"{k}, {x + 3.0!r}, {y - 1.0!r}" for k, (x, y) in POINTS.items())]
    for kind_name, cells in ((f"{kind}4", QUADS), (f"{kind}3", TRIANGLES)):
        lines += [
            f"*ELEMENT, TYPE={kind_name}, ELSET=ALL",
            *(f"{k}, {', '.join(map(str, n))}" for k, n in cells.items()),
        ]
    lines += [f"*SOLID SECTION, ELSET=ALL, MATERIAL=M{extra}", *([data] if data else [])]
    return "\n".join([*lines, "*MATERIAL, NAME=M", "*ELASTIC", f"{E!r}, {NU!r}", "*DENSITY", f"{RHO!r},"]) + "\n"


SLICE = E / (1 + NU) / (1 - 2 * NU) * np.array([[1 - NU, NU, 0], [NU, 1 - NU, 0], [0, 0, (1 - 2 * NU) / 2]])


@pytest.mark.parametrize(("kind", "C"), [("CPS", C), ("CPE", SLICE)])
@pytest.mark.parametrize(("data", "thickness"), [(f"{T!r},", T), ("", 1.0)])
def test_elements_of_plane_stress_and_plane_strain_are_planar_bodies(tmp_path, data, thickness, kind, C):
    """u = H x has the energy t A epsᵀ C eps / 2; six rigid motions, of which three are out of the plane."""
    path = tmp_path / "model.inp"
    path.write_text(planar_deck(kind, data))
    body, deck = made(path)
    assert deck.plane == 2
    H = np.array([[1e-3, 4e-4], [-7e-4, 2e-3]])
    u = np.zeros(body.n_dof)
    for k, (node, c) in enumerate(body.dofs):
        at = H @ body.nodes[node, :2]
        u[k] = at[c] if c < 2 else (H[1, 0] - H[0, 1]) / 2 if c == 5 else 0.0
    strain = np.array([H[0, 0], H[1, 1], H[0, 1] + H[1, 0]])
    assert_allclose(u @ body.K @ u, thickness * 2.0 * strain @ C @ strain, rtol=1e-9)
    values = eigh(
        body.K.toarray(), body.M.toarray() + 1e-12 * abs(body.M).max() * np.eye(body.n_dof), eigvals_only=True
    )
    assert (np.abs(values) < 1e-7 * values[-1]).sum() >= 6
    x = (body.dofs[:, 1] == 0).astype(float)
    assert_allclose(x @ body.M @ x, RHO * thickness * 2.0, rtol=1e-9)


@pytest.mark.parametrize(
    ("deck", "why"),
    [
        (planar_deck("CPEG"), "CPEG4 .*generalized plane strain"),
        (planar_deck("CPE").replace("CPE4", "CPE4P"), "CPE4P .*other unknowns than displacements"),
        (planar_deck("CPE").replace(f"*ELASTIC\n{E!r}, {NU!r}\n", ""), "plane strain: material M is not isotropic"),
        (planar_deck("CAX"), "CAX4 .*axisymmetric"),
        (planar_deck(extra=", ORIENTATION=O") + "*ORIENTATION, NAME=O\n1.,0.,0.,0.,1.,0.\n", "CPS4 .*ORIENTATION"),
        (planar_deck().replace("9, 5.0, 0.0", "9, 5.0, 0.0, 0.1"), "do not lie in one plane across z"),
        (planar_deck() + "*ELEMENT, TYPE=T3D2, ELSET=R\n9, 1, 9\n*SOLID SECTION, ELSET=R, MATERIAL=M\n1e-3\n",
         "beside elements in space"),
    ],
)  # fmt: skip
def test_plane_elements_that_are_no_body_are_refused_with_the_reason(tmp_path, deck, why):
    path = tmp_path / "model.inp"
    path.write_text(deck)
    with pytest.raises(ValueError, match=why):
        made(path)


R = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
R = R * np.sign(np.linalg.det(R))


def shell_deck(section, *, kind="181", commands=""):
    """A .cdb file of the plate of POINTS, turned in space."""
    lines = ["/PREP7", f"ET,1,{kind}", "NBLOCK,6,SOLID,9,9", "(3i9,6e21.13e3)"]
    for k, (x, y) in POINTS.items():
        lines.append(f"{k:9d}{0:9d}{0:9d}" + "".join(f"{v:21.13E}" for v in R @ [x, y, 0.0] + [1.0, -2.0, 0.5]))
    lines += ["N,R5.3,LOC,       -1,", "EBLOCK,19,SOLID,5,5", "(19i9)"]
    cells = QUADS | {k: (*n, n[2]) for k, n in TRIANGLES.items()}
    lines += ["".join(f"{v:9d}" for v in (1, 1, 1, 7, 0, 0, 0, 0, 4, 0, k, *n)) for k, n in cells.items()]
    lines += [f"{-1:9d}", *section, f"MP,EX,1,{E!r}", f"MP,PRXY,1,{NU!r}", f"MP,DENS,1,{RHO!r}"]
    lines += [f"MP,EX,2,{E / 3!r}", "MP,NUXY,2,0.2", "MP,DENS,2,2000.", commands]
    return "\n".join(lines) + "\n"


def uniform(body, strain, curvature):
    """Return the energy, doubled, of uniform strains and curvatures of the plane through the nodes."""
    u = np.zeros(body.n_dof)
    for k, (node, c) in enumerate(body.dofs):
        x, y, _ = R.T @ (body.nodes[node] - [1.0, -2.0, 0.5])
        w = -(curvature[0] * x * x + curvature[1] * y * y + curvature[2] * x * y) / 2
        move = np.array([strain[0] * x + strain[2] * y / 2, strain[1] * y + strain[2] * x / 2, w])
        w_x, w_y = -(curvature[0] * x + curvature[2] * y / 2), -(curvature[1] * y + curvature[2] * x / 2)
        u[k] = (R @ move)[c] if c < 3 else (R @ [w_y, -w_x, 0.0])[c - 3]
    return u @ body.K @ u


EPS, KAPPA = np.array([1e-3, -4e-4, 7e-4]), np.array([2e-2, 1e-2, -3e-2])


@pytest.mark.parametrize("kind", ["181", "SHELL181"])
@pytest.mark.parametrize(
    ("section", "layers", "bottom"),
    [
        (["SECTYPE,7,SHELL,,", "SECOFFSET,MID", "SECBLOCK,1", f"  {T}, 1, 0.0, 3"], [(T, 1)], -T / 2),
        (["SECTYPE,7,SHELL", f"SECDATA,{T},1,0.0,3", "SECOFFSET,TOP"], [(T, 1)], -T),
        (["SECTYPE,7,SHELL", f"SECDATA,{T},,0.0,3", "SECOFFSET,BOT"], [(T, 1)], 0.0),
        (["SECTYPE,7,SHELL", "SECOFFSET,BOT", "SECBLOCK,2", " 0.01, 1, 0.0, 3", " 0.03, 2, 45., 3"],
         [(0.01, 1), (0.03, 2)], 0.0),
    ],
)  # fmt: skip
def test_shells_of_ansys_have_their_section(tmp_path, kind, section, layers, bottom):
    """A, B and D about the nodes by the layers; the mass too."""
    path = tmp_path / "model.cdb"
    path.write_text(shell_deck(section, kind=kind))
    body, _ = made(path)
    moduli = {1: (E, NU, RHO), 2: (E / 3, 0.2, 2000.0)}
    energy, mass, z = 0.0, 0.0, bottom
    for t, material in layers:
        young, nu, rho = moduli[material]
        Q = young / (1 - nu**2) * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
        for s, w in zip(*np.polynomial.legendre.leggauss(3), strict=True):
            strain = EPS + (z + t * (1 + s) / 2) * KAPPA
            energy += w * t / 2 * 2.0 * strain @ Q @ strain
        mass += 2.0 * rho * t
        z += t
    assert_allclose(uniform(body, EPS, KAPPA), energy, rtol=2e-2)  # bending of distorted quads is not exact
    x = (body.dofs[:, 1] == 0).astype(float)
    assert_allclose(x @ body.M @ x, mass, rtol=1e-9)


@pytest.mark.parametrize(
    ("section", "commands", "why"),
    [
        (["SECTYPE,8,SHELL", f"SECDATA,{T},1"], "", "section 7: expected SECBLOCK or SECDATA"),
        (["SECTYPE,7,SHELL", f"SECDATA,{T},1", "SECOFFSET,USER,.1"], "", "SECOFFSET"),
        (["SECTYPE,7,BEAM,RECT", f"SECDATA,{T},1"], "", "TYPE = BEAM"),
        (["SECTYPE,7,SHELL", f"SECDATA,{T},1"], "MP,EY,1,1.E10", "isotropic materials"),
        (["SECTYPE,7,SHELL", f"SECDATA,{T},1", "SECCONTROL,0,0,0,5."], "", "SECCONTROL"),
        (["SECTYPE,7,SHELL", f"SECDATA,{T},1"], "KEYOPT,1,1,1", r"KEYOPT\(1\) = 1 of SHELL181"),
    ],
)  # fmt: skip
def test_shells_of_ansys_that_are_not_taken_over_are_refused_by_name(tmp_path, section, commands, why):
    path = tmp_path / "model.cdb"
    path.write_text(shell_deck(section, commands=commands))
    with pytest.raises(ValueError, match=why):
        made(path)
