"""K and M by parts of the mesh on ranks that are threads: entries of one process, bit for bit."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fe_models.body.couplings.couplings import couple
from fe_models.body.rigid_motion import MassLoads
from fe_models.elements.solids import assembly_on_ranks
from fe_models.elements.solids.body import solid_body
from fe_models.errors import MeshError
from fe_models.foundation.ranks.spread_columns import spread_columns
from fe_models.foundation.units import unit_system
from tests.bodies import ALUMINIUM, STEEL, bar, box_mesh
from tests.thread_ranks import ThreadRanks

UNITS = unit_system("m-kg-s")


def both(mesh, materials, size, **options):
    return (solid_body(mesh, materials, name="box", units=UNITS, ranks=r, **options) for r in (None, ThreadRanks(size)))


@pytest.mark.parametrize("size", [2, 3])
@pytest.mark.parametrize("kind", ["tetra10", "hexahedron", "hexahedron20", "wedge15"])
def test_entries_are_those_of_one_process(kind, size):
    mesh = box_mesh(4, 2, 1, kind=kind)
    one, spread = both(mesh, {"left half": STEEL, "right half": ALUMINIUM}, size)
    assert (spread.K.whole() != one.K).nnz == 0
    assert (spread.M.whole() != one.M).nnz == 0
    assert (spread.element_model.M_s.whole() != one.element_model.M_s).nnz == 0


def test_rules_of_the_elements_reach_the_ranks():
    one, spread = both(box_mesh(3, 1, 1), STEEL, 2, incompatible_modes=True, mass="lumped")
    assert (spread.K.whole() != one.K).nnz == 0
    assert (spread.M.whole() != one.M).nnz == 0


def test_a_rank_gets_its_share_of_the_mesh(monkeypatch):
    parts = []
    kept = assembly_on_ranks.mesh_part
    monkeypatch.setattr(assembly_on_ranks, "mesh_part", lambda *a: parts.append(kept(*a)) or parts[-1])
    *_, spread = both(box_mesh(24, 2, 2), STEEL, 4)
    cells = [part.mesh.n_cells for part in parts]
    assert sum(cells) <= 96 + 3 * 8  # two layers of four at each of three cuts
    assert max(cells) <= 36
    rows = [store[spread.K.key].n_own for store in spread.K.ranks.stores]
    assert sum(rows) == spread.n_dof
    assert max(rows) < 1.2 * min(rows)


def test_more_ranks_than_nodes_leave_some_without_rows():
    one, spread = both(box_mesh(1, 1, 1), STEEL, 9)
    assert (spread.K.whole() != one.K).nnz == 0
    u = np.random.default_rng(0).standard_normal((one.n_dof, 2))
    gram, expected = (body.element_model.mass_gram(u) for body in (spread, one))
    assert_allclose(gram, expected, rtol=0, atol=1e-13 * np.abs(expected).max())
    loads = MassLoads(np.zeros((1, 3, 3)), np.ones((1, 3)))
    columns = spread_columns(spread.K.layout, u)
    stiff, expected = (
        body.element_model.geometric_stiffness(u[:, :1], loads, v) for body, v in ((spread, columns), (one, u))
    )
    assert_allclose(stiff, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


def test_an_inverted_element_is_told_as_by_one_process():
    mesh = box_mesh(6, 1, 1)
    cells = mesh.cells["hexahedron"].copy()
    cells[4] = cells[4, [4, 5, 6, 7, 0, 1, 2, 3]]
    mesh = replace(mesh, cells={"hexahedron": cells})
    with pytest.raises(MeshError) as one:
        solid_body(mesh, STEEL, name="box", units=UNITS)
    ranks = ThreadRanks(2)
    with pytest.raises(MeshError) as many:
        solid_body(mesh, STEEL, name="box", units=UNITS, ranks=ranks)
    assert str(many.value) == str(one.value)
    assert ranks.stores == [{}, {}]  # nor do they keep the rows of the part without fault


@pytest.mark.parametrize("kind", ["rigid", "distributing", "nodes"])
def test_couplings_are_those_of_one_process(kind):
    def coupled(ranks):
        body = bar(nx=6, ny=2, nz=2, kind="hexahedron", ranks=ranks)
        return couple(replace(body, interfaces=tuple(replace(each, kind=kind) for each in body.interfaces)))

    one, spread = coupled(None), coupled(ThreadRanks(3))
    assert (spread.K.whole() != one.K).nnz == 0
    assert (spread.M.whole() != one.M).nnz == 0
    assert_array_equal(spread.b, one.b)
