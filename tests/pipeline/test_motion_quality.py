"""From a computed motion back to the question which mode set would have been good enough."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import floatframe as ff
from cms.assessment.quality import QualityError, nodal_deformation_error, recovered_displacements
from tests.bodies import bar


@pytest.fixture(scope="module")
def body():
    return cms.couple(bar(nx=5, kind="hexahedron"))


def swing(reduced):
    """Released horizontally from a pin at its left end, in gravity a thousand times ours: it bends."""
    pin = ff.RevoluteJoint("pin", ff.GROUND, ff.Marker("bar", "left"), axis=(0, 1, 0))
    system = ff.System([ff.FlexibleBody("bar", reduced)], [pin], [ff.Gravity((0, 0, -9810.0))], units=reduced.units)
    return ff.integrate(system, ff.GeneralizedAlpha(rho_inf=0.8), t_end=0.01, h=1e-4)


@pytest.fixture(scope="module", params=["tisserand", "nodal"])
def rich(request, body):
    frame = cms.TisserandFrame() if request.param == "tisserand" else cms.NodalFrame("left")
    return cms.reduce(body, cms.craig_bampton(body, n_modes=8), frame=frame, geometric=False)


def test_the_deformation_of_a_motion_lies_in_its_own_set_and_less_in_poorer_ones(body, rich):
    trajectory = swing(rich)
    motion = trajectory.body("bar")
    largest = {}
    for n_modes in (0, 2, 8):
        modes = cms.craig_bampton(body, n_modes=n_modes)
        reduced = cms.reduce(body, modes, frame=cms.NodalFrame("right"), geometric=False)
        u = recovered_displacements(rich, motion.q, reduced)
        assert u.shape == (len(reduced.nodes), 3, len(trajectory.t))
        largest[n_modes] = nodal_deformation_error(reduced, u, trajectory.t).largest("nodal")
    assert largest[8] < 1e-9
    assert 1e-4 < largest[2] < largest[0] < 1


def test_displacements_are_turned_into_the_axes_of_the_other_frame(body, rich):
    q = np.random.default_rng(0).normal(size=(3, rich.n_q))
    same = recovered_displacements(rich, q, rich)
    assert_allclose(same, np.einsum("nak,tk->nat", rich.Phi, q), rtol=0, atol=1e-12 * np.abs(same).max())


def test_motions_of_another_body_are_refused(body, rich):
    with pytest.raises(QualityError, match="expected q"):
        recovered_displacements(rich, np.zeros((3, rich.n_q + 1)), rich)
    larger = cms.couple(bar(nx=9, kind="hexahedron"))
    with pytest.raises(QualityError, match=r"lacks .* nodes of"):
        recovered_displacements(rich, np.zeros((3, rich.n_q)), cms.reduce(larger, cms.modes.guyan(larger)))
