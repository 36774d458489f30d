"""The same matrices reduced by another program: exudyn's Hurty-Craig-Bampton modes."""

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

import cms
from tests.bodies import STEEL, box_mesh

pytestmark = pytest.mark.external


def test_fixed_interface_frequencies_are_those_of_exudyn():
    """Rigid interfaces at both ends of a steel bar of 240 hexahedra; the tolerance is that of exudyn's eigensolver."""
    pytest.importorskip("exudyn", reason="exudyn is not installed: pip install 'floatframe[bench]'")
    from exudyn.FEM import FEMinterface, HCBstaticModeSelection

    from fe_models.elements.solids.body import solid_body

    mesh = box_mesh(15, 4, 4, 1.0, 0.05, 0.05, "hexahedron")
    solid = solid_body(mesh, STEEL, name="bar", units=cms.unit_system("m-kg-s"))
    ends = [mesh.node_sets["left"], mesh.node_sets["right"]]
    fem = FEMinterface()
    fem.nodes = {"Position": mesh.nodes}
    fem.massMatrix, fem.stiffnessMatrix = sp.csr_matrix(solid.M), sp.csr_matrix(solid.K)
    fem.ComputeHurtyCraigBamptonModes([end.tolist() for end in ends], 8, computationMode=HCBstaticModeSelection.RBE2)
    theirs = np.sort(np.sqrt(np.asarray(fem.eigenValues)) / (2 * np.pi))

    names = ("left", "right")
    interfaces = [
        cms.Interface(name, "rigid", end, mesh.nodes[end].mean(axis=0)) for name, end in zip(names, ends, strict=True)
    ]
    ours = cms.craig_bampton(cms.couple(solid.with_interfaces(*interfaces)), n_modes=8)
    assert_allclose(theirs[:8], ours.frequencies[~ours.is_static], rtol=1e-6)
