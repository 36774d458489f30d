"""The same matrices reduced by another program: pyMOR's second-order IRKA."""

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

import cms
import fe_models as fm
from cms.modes.families.families import Families
from cms.modes.mode_sets import h2_optimal
from tests.bodies import STEEL, box_mesh, distorted

pytestmark = pytest.mark.external

N_MODES = 8


@pytest.mark.parametrize(("name", "axes"), [("left", "z"), ("right", "xyz")])
def test_the_h2_error_is_that_of_pymor_and_below_that_of_its_sor_irka(name, axes):
    """A crooked steel bar of 78 elastic modes, 2 % damping; pyMOR computes the norms of both errors."""
    pytest.importorskip("pymor", reason="pyMOR is not installed: pip install 'floatframe[bench]'")
    from pymor.core.logger import set_log_levels
    from pymor.models.iosys import SecondOrderModel
    from pymor.reductors.sor_irka import SORIRKAReductor

    set_log_levels({"pymor": "ERROR"})
    mesh = distorted(box_mesh(7, 1, 1, 0.6, 0.08, 0.05), 0.1, seed=2)
    sets = mesh.node_sets
    ends = [cms.Interface(end, "rigid", sets[end], mesh.nodes[sets[end]].mean(axis=0)) for end in ("left", "right")]
    body = cms.couple(fm.solid_body(mesh, STEEL, name="bar", units=cms.unit_system("m-kg-s"), interfaces=ends))
    inputs = [f"{name} u{axis}" for axis in axes]
    with Families(body) as families:
        modes = h2_optimal(
            families, n_modes=N_MODES, static=False, damping_ratio=0.02, n_rich=body.n_dof, inputs=inputs
        )
    omega2, Phi = la.eigh(body.K.toarray(), body.M.toarray())
    omega2, Phi = omega2[6:], Phi[:, 6:]
    at = Phi[body.interface(name).dofs[["xyz".index(axis) for axis in axes]]]
    unit = np.sqrt(omega2[0])  # the solvers of pyMOR need frequencies near 1
    B = (at / np.sqrt(np.einsum("bk,bk->b", at, at / omega2))[:, None]).T / unit
    K, D = np.diag(omega2) / unit**2, np.diag(0.04 * np.sqrt(omega2)) / unit
    V = la.orth(Phi.T @ (body.M @ modes.columns[:, 6:]))
    whole, own = (
        SecondOrderModel.from_matrices(np.eye(len(k)), d, k, b, b.T)
        for k, d, b in ((K, D, B), (V.T @ K @ V, V.T @ D @ V, V.T @ B))
    )
    theirs = SORIRKAReductor(whole).reduce(N_MODES, tol=1e-4, maxit=10)
    errors = [(whole - reduced).h2_norm() / whole.h2_norm() for reduced in (own, theirs)]
    assert_allclose(float(modes.data["h2 error"][0]), errors[0], rtol=1e-3)
    assert errors[0] < errors[1]
