"""A family of plates over two thicknesses, made in Python."""

from numpy.testing import assert_allclose

import cms
import fe_models as fm
from cms.reduction import parametric_body
from cms.reduction.parametric.interpolation_errors import errors_between
from tests.fe_models.small_shells import SI, STEEL

THIN, THICK = 0.01, 0.016


def reduced(thickness, width=0.7):
    """A plate with rigid opposite edges, in the frame of the first."""
    mesh = fm.shells.flat_plate(1.0, width, 5, 4)
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


def test_a_plate_between_two_widths_is_consistent():
    """Its edges move rigidly, its modes have the momentum of its frame, and its frequencies follow from its moments."""
    found = parametric_body({"width": (0.6, 0.8)}, [reduced(THIN, 0.6), reduced(THIN, 0.8)]).at(width=0.7)
    checks = {each.name: each.verdict for each in cms.check_body(found)}
    assert {name for name, verdict in checks.items() if verdict in ("warn", "fail")} == set()
    assert checks["rigid-interfaces"] == checks["free-frequencies"] == checks["frame-condition"] == "pass"
