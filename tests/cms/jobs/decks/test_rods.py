"""Rods of a truss against closed forms, and their deck."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

from cms.jobs.body_of_job import uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models.assembly.rods import Rod, rod_body
from fe_models.body.material import Material
from fe_models.errors import MeshError
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.errors import BodyError
from fe_models.foundation.stages import Stages
from fe_models.foundation.units import unit_system
from fe_models.meshes.line_mesh import LineMesh

ROD = Rod(Material("m", E=2e11, nu=0.3, rho=8000.0), 3e-4)
SI = unit_system("m-kg-s")


def line(points):
    n = len(points)
    lines = np.column_stack([np.arange(n - 1), np.arange(1, n)])
    return LineMesh(points, lines, line_sets={"rods": np.arange(n - 1)})


def test_a_row_of_rods_stretches_with_the_frequencies_of_a_chain_and_towards_those_of_a_bar():
    """Linear elements, consistent mass: omega² = 6 c²/h² (1 - cos kh)/(2 + cos kh), k = pi m / L, free ends."""
    n, L, direction = 12, 2.0, np.array([2.0, -1.0, 2.0]) / 3
    body = rod_body(line(np.linspace(0, L, n + 1)[:, None] * direction), {"rods": ROD}, name="bar", units=SI)
    along = np.kron(np.eye(n + 1), direction[:, None])
    lam = eigh(along.T @ body.K @ along, along.T @ body.M @ along, eigvals_only=True)
    k, h, c2 = np.pi * np.arange(n + 1) / L, L / n, 2e11 / 8000
    assert_allclose(lam, 6 * c2 / h**2 * (1 - np.cos(k * h)) / (2 + np.cos(k * h)), rtol=1e-9, atol=1e-4)
    assert_allclose(np.sqrt(lam[1]), k[1] * np.sqrt(c2), rtol=3e-3)
    across = np.kron(np.ones(n + 1), [1.0, 0.0, -1.0]) / np.sqrt(2)  # no stiffness across
    assert_allclose(body.K @ across, 0, atol=1e-6 * abs(body.K).max() * 1e-6)
    assert_allclose(across @ body.M @ across, 8000 * 3e-4 * L, rtol=1e-13)


def test_rods_without_area_or_length_are_refused():
    with pytest.raises(BodyError, match="expected an area above zero, got -1"):
        rod_body(line(np.eye(3)), {"rods": Rod(ROD.material, -1.0)}, name="b", units=SI)
    with pytest.raises(BodyError, match="2 rods have no area"):
        rod_body(line(np.eye(3)), {}, name="b", units=SI)


TRUSS = """*NODE
1, 0, 0, 0
2, 3, 0, 4
3, 6, 0, 0
*ELEMENT, TYPE=T3D2, ELSET=bars
1, 1, 2
2, 2, 3
*MATERIAL, NAME=M
*ELASTIC
2e11, .3
*DENSITY
8000.
*SOLID SECTION, ELSET=bars, MATERIAL=M
3e-4
*BOUNDARY
1, 1, 3
3, 1, 3
"""


def test_a_truss_of_a_deck_has_the_stiffness_of_its_triangle(tmp_path):
    """Two rods of length 5: at the top 2 EA/L times 0.36 and 0.64, nothing across; mass 2 (1/3) rho A L."""
    path = tmp_path / "truss.inp"
    path.write_text(TRUSS)
    path.with_suffix(".toml").write_text(job_text(parse_deck(path), DeckOptions("m-kg-s", {}), path.name))
    body = uncoupled_body(read_job(path.with_suffix(".toml")), Stages())
    top = [int(np.flatnonzero((body.dofs[:, 1] == c) & (body.nodes[body.dofs[:, 0], 2] == 4))[0]) for c in range(3)]
    EA_L = 2e11 * 3e-4 / 5
    assert_allclose(body.K.toarray()[np.ix_(top, top)], EA_L * np.diag([0.72, 0, 1.28]), rtol=1e-12, atol=1e-6)
    assert_allclose(body.M.toarray()[np.ix_(top, top)], 8000 * 3e-4 * 10 / 3 * np.eye(3), rtol=1e-12)
    assert len(body.dofs) == 9
    path.write_text(TRUSS.replace("T3D2", "T3D3").replace("1, 1, 2\n2, 2, 3", "1, 1, 2, 3"))
    with pytest.raises(MeshError, match="T3D3"):
        parse_deck(path).ledger.require_whole()
