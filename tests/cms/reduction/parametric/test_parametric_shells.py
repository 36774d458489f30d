"""A family of plates over two thicknesses, made in Python."""

from numpy.testing import assert_allclose

import cms
import fe_models as fm
from cms.reduction import parametric_body
from cms.reduction.parametric.interpolation_errors import errors_between
from tests.fe_models.small_shells import SI, STEEL

THIN, THICK = 0.01, 0.016


def reduced(thickness):
    """A plate on two opposite edges, of one thickness, in the frame of the first edge."""
    mesh = fm.shells.flat_plate(1.0, 0.7, 5, 4)
    edges = [fm.shells.shell_interface(mesh, edge, fm.selections.NodeSet(edge)) for edge in ("u0", "u1")]
    body = fm.shell_body(mesh, fm.shells.ShellProperty(thickness, STEEL), name="plate", units=SI, interfaces=edges)
    coupled = cms.couple(body)
    modes = cms.craig_bampton(coupled, n_modes=5)
    return cms.reduce(coupled, modes, frame=cms.NodalFrame("u0"), stress=False, geometric=False)


def test_a_plate_between_two_thicknesses():
    """Bending grows with the thickness and the membrane does not, so no single power holds for the stiffness."""
    plates = parametric_body({"t": (THIN, THICK)}, [reduced(THIN), reduced(THICK)], middle=reduced((THIN + THICK) / 2))
    for t in (0.011, 0.0145):
        errors = errors_between(plates.at(t=t), reduced(t))
        assert (errors.frequency <= 1.05 * plates.errors.frequency + 1e-9).all()
        assert (errors.free_frequency <= 1.05 * plates.errors.free_frequency + 1e-9).all()
        assert errors.static <= plates.errors.static
    assert plates.errors.frequency[0] < 1e-3
    assert_allclose(plates.at(t=0.012).moments.m, 0.7 * 0.012 * STEEL.rho, rtol=1e-12)
