"""A nodal frame whose dofs are told by the user's numbers is the one told by counted nodes."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import cms
import fe_models as fm
from cms.errors import BodyError
from cms.jobs.reduction_table import ReductionSection
from fe_models.elements.solids.body import solid_body
from tests.bodies import STEEL, box_mesh

MESH = box_mesh(2, 1, 2, kind="hexahedron20")
CORNERS = [int(np.flatnonzero((MESH.nodes == corner).all(axis=1))[0]) for corner in ([0, 0, 0], [1, 0, 0], [0, 1, 0])]
COUNTED = (*((CORNERS[0], c) for c in (0, 1, 2)), (CORNERS[1], 1), (CORNERS[1], 2), (CORNERS[2], 2))


@pytest.fixture(scope="module")
def body():
    """A box whose nodes have numbers that go down, with gaps."""
    mesh = replace(MESH, node_numbers=9000 - 7 * np.arange(len(MESH.nodes)))
    ends = [fm.selections.NodeSet(name) for name in ("left", "right")]
    kept = [fm.rigid_interface(mesh, end.name, end) for end in ends]
    return cms.couple(solid_body(mesh, STEEL, name="box", units=cms.unit_system("m-kg-s"), interfaces=kept))


def named(body):
    return tuple((int(body.numbering.nodes[n]), ("ux", "uy", "uz", "rx", "ry", "rz")[c]) for n, c in COUNTED)


def test_numbers_and_counted_nodes_are_one_frame(body):
    modes = cms.craig_bampton(body, n_modes=3)
    counted, numbered = (
        cms.reduce(body, modes, frame=cms.NodalFrame(dofs=dofs), geometric=False) for dofs in (COUNTED, named(body))
    )
    assert_array_equal(numbered.frame.dofs, counted.frame.dofs)
    assert_array_equal(numbered.K, counted.K)
    mean = cms.reduce(body, modes, geometric=False)
    turned = cms.reduction.convert_frame(mean, cms.NodalFrame(dofs=named(body)))
    assert_array_equal(turned.frame.dofs, counted.frame.dofs)


def test_a_job_takes_both_and_refuses_what_is_neither(body):
    pairs = [list(pair) for pair in named(body)]
    assert ReductionSection(n_modes=1, frame="nodal", dofs=pairs).dofs == named(body)
    assert ReductionSection(n_modes=1, frame="nodal", dofs=[list(pair) for pair in COUNTED]).dofs == COUNTED
    for wrong in ([12, "up"], [-3, "ux"], [1.5, "ux"], ["PART-1.12", 0]):
        with pytest.raises(ValueError, match="six pairs"):
            ReductionSection(n_modes=1, frame="nodal", dofs=[*pairs[:5], wrong])


def test_numbers_that_are_not_there(body):
    modes = cms.craig_bampton(body, n_modes=1)
    missing = ((17, "ux"), *named(body)[1:])
    with pytest.raises(BodyError, match="no node 17"):
        cms.reduce(body, modes, frame=cms.NodalFrame(dofs=missing), geometric=False)
